"""What efforts mean: falsified robots against the truth, and rules for what is not certain."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from evaluation.effort.falsified import (
    MEANINGS,
    Falsified,
    arm_of,
    falsified,
    others,
    own_robots,
)
from robots import paper_arm

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.effort.facts import (
    CONSTANT,
    NONE,
    OTHER_SIGN,
    SATURATED,
    SCALED,
    TORQUE,
    UNKNOWN,
    WITHOUT,
    JointMeaning,
    Ratio,
    signs_of,
)
from ugv_acceptance.evaluation.effort.loads import Weighed, weigh
from ugv_acceptance.evaluation.effort.meaning import Named, name_meanings
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats

PACKBOT = replace(load().settings.robot, payload=Payload())
# Every robot with every meaning, and arms whose joints have a meaning each.
RUNS = [
    (name, robot, meanings, seed)
    for name, robot in [*own_robots(1, 2), *others()]
    for seed, meanings in enumerate([*((m,) for m in MEANINGS), MEANINGS, MEANINGS])
]


def run(robot: Robot, meanings: Sequence[str], seed: int) -> Falsified:
    """Return a falsified run in eight postures."""
    return falsified(robot, meanings, 8, np.random.default_rng((7, seed)))


def test_of_the_named_meanings_99_percent_are_right_and_a_fifth_is_unknown() -> None:
    """With wrong masses, centres, zeros, friction, offsets, noise, and loads that nobody told."""
    count: Counter[str] = Counter()
    for _, robot, meanings, seed in RUNS:
        made = run(robot, meanings, seed)
        for truth, found in zip(made.truth, name_meanings(made.arm), strict=True):
            unknown = found.meaning == UNKNOWN
            count['unknown' if unknown else 'right' if found.meaning == truth else 'wrong'] += 1
    assert count.total() > 200
    assert count['wrong'] <= 0.01 * (count['right'] + count['wrong'])
    assert count['unknown'] <= 0.20 * count.total()


def signs(names: Sequence[Named]) -> list[float | None]:
    """Return what makes each effort a torque."""
    return signs_of([one.meaning for one in names])


def test_no_payload_is_told_that_is_not_carried() -> None:
    """With the declared load carried, whatever the efforts mean: no other load is told."""
    told = 0
    for _, robot, meanings, seed in RUNS:
        rng = np.random.default_rng((8, seed))
        arm = falsified(robot, meanings, 8, rng, load=0.0).arm
        weighed = weigh(arm, signs(name_meanings(arm)))
        told += len(weighed.loads)
        assert not any(load.differs for load in weighed.loads)
    assert told > 20


def test_what_is_told_of_a_load_holds_the_truth() -> None:
    """A load of a third of what the arm itself weighs is told with an interval that holds it."""
    held = []
    for name, robot, meanings, seed in RUNS:
        if meanings not in {(TORQUE,), (OTHER_SIGN,)} or robot.payload_link is None:
            continue
        rng = np.random.default_rng((9, seed, len(name)))
        made = falsified(robot, meanings, 8, rng)
        loads = weigh(made.arm, signs(name_meanings(made.arm))).loads
        held += [abs(x.mass - made.load) <= 1.5 * x.half for x in loads]
    assert len(held) > 8
    assert np.mean(held) >= 0.9


def efforts(robot: Robot, q: Floats, change: Floats | float, declared: float = 0.0) -> list[Named]:
    """Return the meanings where the effort is `change` times the static torque, level."""
    gravity = np.tile((0.0, 0.0, -9.81), (len(q), 1))
    torque = static_torque(robot, q, gravity, Payload(declared, robot.payload.cog))
    return name_meanings(arm_of(robot, q, gravity, torque * change, declared)[0])


ONE = np.array([(0.0, 0.6, 1.5, 2.0)])
SEVERAL = np.array([(0.0, 0.0, 0.3, 2.0), *ONE, (0.0, 1.0, -1.2, 1.0), (0.0, 0.3, -2.0, 0.5)])


@pytest.mark.parametrize(
    ('scale', 'meaning'),
    [(1.0, TORQUE), (-1.0, OTHER_SIGN), (0.12, SCALED), (1.0 / 12.0, SCALED), (-40.0, SCALED)],
)
def test_two_loaded_joints_tell_in_one_posture(scale: float, meaning: str) -> None:
    """Shoulder and elbow alike off by one factor: one driver and one meaning."""
    for q in (ONE, SEVERAL):
        _, shoulder, elbow, _ = efforts(PACKBOT, q, scale, declared=4.0)
        assert (shoulder.meaning, elbow.meaning) == (meaning, meaning)
        for joint in (shoulder, elbow):
            assert joint.probability >= 0.95
            if meaning == SCALED:
                assert joint.ratio is not None
                assert joint.ratio.low <= scale <= joint.ratio.high


def test_one_loaded_joint_in_one_posture_tells_nothing_but_its_ratio() -> None:
    """98 N may be 1.25 times 8 kg, or 10 kg."""
    scale = np.array((np.nan, 1.25, np.nan, np.nan))
    shoulder = efforts(PACKBOT, ONE, scale, declared=4.0)[1]
    assert shoulder.meaning == UNKNOWN
    assert shoulder.ratio is not None
    assert shoulder.ratio.low < 1.25 < shoulder.ratio.high


def test_a_joint_without_load_is_unknown() -> None:
    """A turret on level ground holds nothing, so its effort says nothing of its unit."""
    turret = efforts(PACKBOT, SEVERAL, 1.0)[0]
    assert turret.meaning in {UNKNOWN, NONE}


@pytest.mark.parametrize('value', [0.0, np.nan, 5e-310, -1e-300])
def test_zero_missing_and_denormal_efforts_are_none(value: float) -> None:
    """Nothing is measured where nothing but such numbers comes; under load zero is told apart."""
    gravity = np.tile((0.0, 0.0, -9.81), (len(SEVERAL), 1))
    arm, _ = arm_of(PACKBOT, SEVERAL, gravity, np.full(SEVERAL.shape, value))
    found = name_meanings(arm)
    assert [one.meaning for one in found] == [NONE] * 4
    words = JointMeaning('elbow', 'N m', NONE, below=found[2].below).why
    assert ('gravity is compensated' in words) is bool(np.isfinite(value))
    assert weigh(arm, signs(found)) == Weighed()


def test_one_number_under_a_changing_load_is_no_measurement() -> None:
    """An effort of 5 N m in every posture is constant; where the load is alike too, unknown."""
    gravity = np.tile((0.0, 0.0, -9.81), (len(SEVERAL), 1))
    arm, _ = arm_of(PACKBOT, SEVERAL, gravity, np.full(SEVERAL.shape, 5.0))
    assert name_meanings(arm)[1].meaning == CONSTANT
    alike = np.tile(SEVERAL[:1], (4, 1)) + np.linspace(0.0, 0.05, 4)[:, None]
    arm, _ = arm_of(PACKBOT, alike, gravity, np.full(alike.shape, 5.0))
    assert name_meanings(arm)[1].meaning == UNKNOWN


def test_an_effort_that_is_cut_off_tells_its_meaning_below() -> None:
    """Three postures at the same largest number while the torque differs: saturated."""
    q = np.array([(0.0, x, y, 2.0) for x in (0.0, 0.5, 1.0) for y in (0.0, 0.7, -1.5)])
    gravity = np.tile((0.0, 0.0, -9.81), (len(q), 1))
    torque = static_torque(PACKBOT, q, gravity, Payload())
    cut = np.sort(np.abs(torque[:, 1]))[5]
    arm, _ = arm_of(PACKBOT, q, gravity, np.clip(torque, -cut, cut))
    shoulder = name_meanings(arm)[1]
    assert shoulder.meaning == SATURATED
    assert shoulder.level == pytest.approx(cut)
    assert shoulder.below == TORQUE
    assert JointMeaning('x', 'N m', SATURATED, below=TORQUE).sign == 1.0
    assert not JointMeaning('x', 'N m', SATURATED, below=TORQUE).weighs


def test_gravity_compensated_efforts_are_named_whatever_is_left() -> None:
    """Noise of some hundredths of a newton metre, or the friction, where gravity is left out."""
    rng = np.random.default_rng(4)
    gravity = np.tile((0.0, 0.0, -9.81), (len(SEVERAL), 1))
    for noise in (0.02, 0.5):
        arm, _ = arm_of(PACKBOT, SEVERAL, gravity, noise * rng.normal(size=SEVERAL.shape), 4.0)
        found = name_meanings(arm)
        assert (found[1].meaning, found[2].meaning) == (WITHOUT, WITHOUT)
        assert weigh(arm, signs(found)) == Weighed()


@pytest.mark.parametrize('scale', [1.0, 1.0 / 12.0])
def test_a_load_that_comes_and_goes_changes_no_meaning(scale: float) -> None:
    """0, 4 and 0 kg in turn: torque stays torque with three loads; another unit weighs nothing."""
    q = np.concatenate([SEVERAL[:3]] * 3) + 0.08 * np.arange(9)[:, None] % 0.3
    gravity = np.tile((0.0, 0.0, -9.81), (9, 1))
    torque = [static_torque(PACKBOT, q, gravity, Payload(m)) for m in (0.0, 4.0, 0.0)]
    effort = scale * np.concatenate([t[3 * k : 3 * k + 3] for k, t in enumerate(torque)])
    arm, _ = arm_of(PACKBOT, q, gravity, effort)
    found = name_meanings(arm)
    weighed = weigh(arm, signs(found))
    if scale == 1.0:
        assert found[1].meaning == TORQUE
        assert [(x.first, x.last) for x in weighed.loads] == [(0, 2), (3, 5), (6, 8)]
        for load, mass in zip(weighed.loads, (0.0, 4.0, 0.0), strict=True):
            assert abs(load.mass - mass) <= load.half
            assert load.differs is (mass > 0.0)
    else:
        assert found[1].meaning != TORQUE
        assert weighed == Weighed()


def test_without_any_rest_all_is_unknown() -> None:
    """No posture, no meaning and no load."""
    arm, _ = arm_of(PACKBOT, np.empty((0, 4)), np.empty((0, 3)), np.empty((0, 4)))
    assert [one.meaning for one in name_meanings(arm)] == [NONE] * 4
    assert weigh(arm, [1.0] * 4) == Weighed()


def test_a_robot_that_cannot_carry_has_its_load_at_the_end_of_the_arm() -> None:
    """Without a payload link 4 kg at the gripper are found where the arm ends."""
    robot = replace(paper_arm(), payload_link=None, payload=Payload())
    q = np.array([(0.0, 0.3), (0.6, -1.5), (1.0, 0.2), (0.3, -2.0)])
    gravity = np.tile((0.0, 0.0, -9.81), (4, 1))
    effort = static_torque(paper_arm(), q, gravity, Payload(4.0))
    arm, sizes = arm_of(robot, q, gravity, effort)
    assert (sizes.guessed, sizes.link) == (True, 'gripper')
    (load,) = weigh(arm, [1.0, 1.0]).loads
    assert load.mass == pytest.approx(4.0, abs=load.half)
    assert load.differs


@pytest.mark.parametrize(
    ('ratio', 'opposed', 'odd'),
    [
        (Ratio(-1.0, -1.1, -0.9), True, True),
        (Ratio(-1.4, -2.0, 0.1), False, True),
        (Ratio(-3.0, -3.1, -2.9), False, True),
        (Ratio(1.0, 0.9, 1.1), False, False),
        (Ratio(0.5, 0.4, 0.6), False, True),
        (None, False, False),
    ],
)
def test_a_sign_may_be_certain_where_the_scale_is_not(
    ratio: Ratio | None, *, opposed: bool, odd: bool
) -> None:
    """About minus the torque, for sure: the sign to set is named though the meaning is unknown."""
    joint = JointMeaning('elbow', 'N m', UNKNOWN, ratio=ratio)
    assert (joint.opposed, joint.odd) == (opposed, odd)
    assert ('effort_sign: -1' in joint.do) is opposed
    assert joint.sign is None
