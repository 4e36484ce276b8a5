"""What the arm carried and touched: intervals, changes of the load, contacts."""

from dataclasses import replace

import numpy as np
import pytest
from evaluation.effort.falsified import Off, arm_of, falsified

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.effort.loads import Weighed, weigh
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats

PACKBOT = replace(load().settings.robot, payload=Payload())
LEVEL = (0.0, 0.0, -9.81)
# The scale of shoulder and elbow is known.
KNOWN = [None, 1.0, 1.0, None]


def postures(count: int, seed: int) -> Floats:
    """Return random postures."""
    rng = np.random.default_rng(seed)
    return rng.uniform((-1.0, -0.2, -2.0, 0.0), (1.0, 1.2, 1.0, 2.0), (count, 4))


def weighed(q: Floats, effort: Floats, declared: float = 0.0) -> Weighed:
    """Return what is told of level postures."""
    gravity = np.tile(LEVEL, (len(q), 1))
    return weigh(arm_of(PACKBOT, q, gravity, effort, declared)[0], KNOWN)


def held(q: Floats, mass: float) -> Floats:
    """Return the torques that hold a load (kg)."""
    return static_torque(PACKBOT, q, np.tile(LEVEL, (len(q), 1)), Payload(mass))


@pytest.mark.parametrize('carried', [0.0, 1.0, 6.0])
@pytest.mark.parametrize('declared', [0.0, 1.0, 4.0])
def test_a_load_is_weighed_and_compared_with_the_declared_one(
    carried: float, declared: float
) -> None:
    """6 kg carried and 1 declared differ; 1 and 1 do not."""
    q = postures(8, 1)
    (told,) = weighed(q, held(q, carried), declared).loads
    assert told.mass == pytest.approx(carried, abs=0.02)
    assert told.declared == pytest.approx(declared)
    assert told.half < 0.3
    assert told.differs is (carried != declared)


def test_intervals_hold_the_load_and_nothing_is_claimed_of_an_empty_hand() -> None:
    """With a model as far off as it is believed: 95 % intervals, no false load, few contacts."""
    inside, claimed, touched = [], 0, 0
    for seed in range(40):
        rng = np.random.default_rng((3, seed))
        mass = 0.0 if seed % 2 else float(rng.uniform(0.3, 4.0))
        made = falsified(PACKBOT, ('torque',), 12, rng, load=mass)
        found = weigh(made.arm, KNOWN)
        inside += [abs(x.mass - mass) <= x.half for x in found.loads]
        claimed += any(x.differs for x in found.loads) and not mass
        touched += bool(found.contacts)
    assert len(inside) >= 40
    assert np.mean(inside) >= 0.85
    assert claimed == 0
    assert touched <= 3


def test_friction_makes_no_load() -> None:
    """Friction of 8 to 25 % of the joint's torque, of either sign, is neither load nor change."""
    for seed in range(20):
        off = Off(friction=(0.08, 0.25))
        made = falsified(PACKBOT, ('torque',), 12, np.random.default_rng((4, seed)), 0.0, off)
        found = weigh(made.arm, KNOWN)
        assert not any(x.differs for x in found.loads)
        assert len(found.loads) <= 1


@pytest.mark.parametrize('seed', range(6))
def test_a_load_is_told_by_the_stretch_in_which_it_was_carried(seed: int) -> None:
    """0, 4, 0 kg: three stretches that end where the load changed, and no mean of them."""
    rng = np.random.default_rng(seed)
    q, ends = postures(15, seed), (0, 5, 10, 15)
    effort = np.concatenate(
        [held(q[a:b], m) for a, b, m in zip(ends, ends[1:], (0.0, 4.0, 0.0), strict=False)]
    )
    effort += rng.normal(0.0, 0.3, effort.shape)
    found = weighed(q, effort)
    assert [(x.first, x.last) for x in found.loads] == [(0, 4), (5, 9), (10, 14)]
    for told, mass in zip(found.loads, (0.0, 4.0, 0.0), strict=True):
        assert told.mass == pytest.approx(mass, abs=0.35)
    assert not found.contacts


def test_a_push_is_named_where_no_load_explains_it() -> None:
    """40 N m more on the elbow alone in one posture of ten is no load: something pulls on it."""
    q = postures(10, 2)
    effort = held(q, 1.0)
    effort[4, 2] += 40.0
    found = weighed(q, effort, declared=1.0)
    assert {x.row for x in found.contacts} == {4}


def test_a_load_below_nothing_is_a_contact() -> None:
    """An arm that rests on the ground in every posture weighs no negative load."""
    q = np.array([(0.0, 0.0, y, 2.0) for y in (-0.3, 0.0, 0.3)])
    found = weighed(q, held(q, 0.0) - 1.5 * (held(q, 1.0) - held(q, 0.0)))
    assert not found.loads
    assert found.contacts


@pytest.mark.parametrize('known', [[None] * 4, [1.0, None, None, 1.0]])
def test_without_a_joint_of_known_scale_that_feels_a_load_nothing_is_told(
    known: list[float | None],
) -> None:
    """Turret and flippers carry no load on level ground."""
    q = postures(8, 3)
    arm, _ = arm_of(PACKBOT, q, np.tile(LEVEL, (8, 1)), held(q, 3.0))
    found = weigh(arm, known)
    assert not any(x.differs for x in found.loads)


def test_the_sign_is_turned_round_where_it_is_known_to_be_opposite() -> None:
    """Efforts of the other sign weigh as well as those of the right one."""
    q = postures(8, 4)
    arm, _ = arm_of(PACKBOT, q, np.tile(LEVEL, (8, 1)), -held(q, 3.0))
    (told,) = weigh(arm, [None, -1.0, -1.0, None]).loads
    assert told.mass == pytest.approx(3.0, abs=0.02)
