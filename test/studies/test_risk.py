"""Risk: exact intervals, the same counts for a seed, and the probability that quadrature gives."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import tracked
from scipy import stats

from bench.quadrature import saturation_probability
from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Link, Payload, Robot
from ugv_acceptance.model.stability import stability
from ugv_acceptance.model.statics import inverse_dynamics
from ugv_acceptance.studies import risk as risk_module
from ugv_acceptance.studies.planar import PAPER, arm_robot
from ugv_acceptance.studies.risk import Study, failures_of, run
from ugv_acceptance.studies.risk_kernel import known_names, risk_kernel
from ugv_acceptance.studies.spread import clopper_pearson, normal, together, uniform

TURN = uniform(-math.pi, math.pi)
LIMITS = (math.inf, 60.0, 40.0, math.inf)


def two_link() -> Study:
    """Return the paper's arm with angles, load and limits uncertain."""
    spreads = {
        'theta1.position': uniform(0.0, math.pi),
        'theta2.position': uniform(0.0, 2.0 * math.pi),
        'payload.mass': normal(4.0, 0.4),
        'theta1.limit': normal(50.0, 5.0),
        'theta2.limit': normal(50.0, 5.0),
    }
    return Study(arm_robot(PAPER), spreads, (0.0, 0.0), (50.0, 50.0))


def on_slopes(**more: object) -> Study:
    """Return a tracked robot on random slopes, its flippers up."""
    spreads = {
        'slope': uniform(0.0, 0.6),
        'heading': TURN,
        'turret.position': TURN,
        'shoulder.position': uniform(0.0, math.pi),
        'elbow.position': TURN,
        'elbow.rate': normal(0.0, 1.0),
        'shoulder.rate': normal(0.0, 1.0),
        'payload.mass': uniform(0.0, 6.0),
        'base_link.mass': uniform(20.0, 28.0),
        'base_link.x': normal(0.02, 0.02),
        'link2.mass': normal(2.5, 0.3),
        'turret.x': uniform(-0.1, 0.1),
    }
    return Study(tracked(), {**spreads, **more}, (0.0, 0.0, 0.0, 2.0), LIMITS)  # type: ignore[dict-item]


def moved(robot: Robot, values: dict[str, float]) -> Robot:
    """Return the robot with the numbers of one sample written into it."""
    links = [
        replace(
            link,
            mass=values.get(f'{link.name}.mass', link.mass),
            cog=(values.get(f'{link.name}.x', link.cog[0]), *link.cog[1:]),
        )
        for link in robot.links
    ]
    joints = [
        replace(joint, xyz=(values.get(f'{joint.name}.x', joint.xyz[0]), *joint.xyz[1:]))
        for joint in robot.joints
    ]
    load = Payload(values.get('payload.mass', robot.payload.mass), robot.payload.cog)
    return replace(robot, links=tuple(links), joints=tuple(joints), payload=load)


@pytest.mark.parametrize('flippers', [None, uniform(-0.6, 2.0)])
def test_each_sample_is_judged_as_a_robot_of_its_own(flippers: object) -> None:
    """A sample's numbers written into a robot: inverse dynamics and tip angle say the same."""
    study = on_slopes() if flippers is None else on_slopes(**{'flippers.position': flippers})
    rng = np.random.default_rng(3)
    columns = {name: spread.draw(rng, 120) for name, spread in study.spreads.items()}
    saturated, tipped, either = failures_of(study, columns, 120)
    names = study.robot.joint_names
    for k in range(120):
        values = {name: float(column[k]) for name, column in columns.items()}
        robot = moved(study.robot, values)
        q = [values.get(f'{n}.position', f) for n, f in zip(names, study.q, strict=True)]
        qd = [values.get(f'{n}.rate', 0.0) for n in names]
        s, h = values['slope'], values['heading']
        g = -9.81 * np.array([math.sin(s) * math.cos(h), math.sin(s) * math.sin(h), math.cos(s)])
        torque = inverse_dynamics(robot, q, qd, np.zeros(4), g)
        least = min(float(a) for a in stability(robot, q, g).angle)
        assert saturated[k] == (np.abs(torque) > study.limits).any()
        assert tipped[k] == (not least > 0.0)
        assert either[k] == (saturated[k] or tipped[k])


@pytest.mark.parametrize('contacts', ['raised', 'too few', 'none'])
def test_a_robot_without_fixed_edges_is_judged_by_its_stance(contacts: str) -> None:
    """Raised by its flippers, on two points, or on none: no margin at all counts as tipped."""
    robot, q = tracked(), (0.0, 0.5, -0.5, -0.6)
    if contacts != 'raised':
        robot = replace(robot, contacts=robot.contacts[: 2 * (contacts == 'too few')])
    spreads = {'slope': uniform(0.0, 0.9), 'heading': TURN}
    study = Study(robot, spreads, q, (math.inf,) * 4)
    assert risk_kernel(robot, ('slope', 'heading'), q, ()).edges == 0
    rng = np.random.default_rng(4)
    columns = {name: spread.draw(rng, 200) for name, spread in spreads.items()}
    saturated, tipped, _ = failures_of(study, columns, 200)
    s, h = columns['slope'], columns['heading']
    gravity = -9.81 * np.stack([np.sin(s) * np.cos(h), np.sin(s) * np.sin(h), np.cos(s)], axis=-1)
    least = np.array(stability(robot, q, gravity).angle).min(axis=0)
    assert not saturated.any()
    assert (tipped == (~(least > 0.0) & bool(robot.contacts))).all()
    assert tipped.any() == bool(robot.contacts)


def test_a_robot_that_carries_nothing_is_judged_too() -> None:
    """A robot without a payload is judged by the torque of its links alone."""
    robot = replace(arm_robot(PAPER), payload_link=None)
    study = Study(robot, {'theta1.position': uniform(0.0, math.pi)}, (0.0, 0.0), (20.0, math.inf))
    at = np.linspace(0.1, 3.0, 20)
    saturated, _, _ = failures_of(study, {'theta1.position': at}, 20)
    q = np.stack([at, np.zeros(20)], axis=-1)
    torque = inverse_dynamics(robot, q, 0.0 * q, 0.0 * q, (0.0, 0.0, -9.81))
    assert (saturated == (np.abs(torque[:, 0]) > 20.0)).all()
    assert 0 < saturated.sum() < 20


def test_counts_of_samples_not_looked_at_leave_the_bins() -> None:
    """They add to the samples and failures alone."""
    bins = np.ones((2, 3, risk_module.BINS), np.int64)
    counts = risk_module.Counts(10, np.array((1, 2, 3)), 10, bins)
    counts.add(risk_module.Counts(5, np.array((1, 1, 1))))
    assert (counts.samples, counts.looked_at, counts.failures.tolist()) == (15, 10, [2, 3, 4])
    assert (counts.bins == 1).all()
    counts.add(risk_module.Counts(5, np.zeros(3, np.int64), 5, bins))
    assert (counts.bins == 2).all()


def test_a_seed_gives_the_same_counts_whatever_the_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """One worker or two processes: equal counts, equal sensitivities."""
    one = run(two_link(), 600_000, seed=5, workers=1)
    monkeypatch.setattr(risk_module, 'WORTH_A_PROCESS', 0)
    two = run(two_link(), 600_000, seed=5, workers=2)
    assert one.estimates == two.estimates
    assert one.sensitivity == two.sensitivity
    assert run(two_link(), 1000, seed=6).estimates != run(two_link(), 1000, seed=5).estimates


def test_monte_carlo_and_quadrature_agree() -> None:
    """The quadrature's probability lies in the exact 99.99 % interval of a million samples."""
    exact = saturation_probability(uniform(0.0, math.pi), normal(4.0, 0.4), normal(50.0, 5.0))
    found = run(two_link(), 1_000_000, seed=2, workers=1).estimates['saturation']
    low, high = clopper_pearson(found.failures, found.samples, 0.9999)
    assert low < exact < high


def test_quadrature_has_converged() -> None:
    """Twice the nodes change the probability by less than 1e-9."""
    spreads = (uniform(0.0, math.pi), normal(4.0, 0.4), normal(50.0, 5.0))
    finer = saturation_probability(*spreads, nodes=(96, 192, 24))
    assert saturation_probability(*spreads) == pytest.approx(finer, abs=1e-9)


@given(trials=st.integers(1, 10_000), share=st.floats(0.0, 1.0))
def test_intervals_are_exact(trials: int, share: float) -> None:
    """Clopper-Pearson as scipy.stats computes it."""
    failures = round(share * trials)
    book = stats.binomtest(failures, trials).proportion_ci(0.95, method='exact')
    assert clopper_pearson(failures, trials) == pytest.approx((book.low, book.high), abs=1e-12)


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    """Of 400 runs at least 93 % hold the quadrature's probability in their 95 % interval."""
    exact = saturation_probability(uniform(0.0, math.pi), normal(4.0, 0.4), normal(50.0, 5.0))
    runs = [run(two_link(), 2000, seed=s, workers=1).estimates['saturation'] for s in range(400)]
    assert sum(r.low <= exact <= r.high for r in runs) >= 0.93 * 400


def test_progress_and_history_reach_the_end() -> None:
    """Every chunk is told; the last line of the history is the result."""
    told: list[int] = []
    found = run(two_link(), 700_000, workers=1, progress=told.append)
    assert told == [2**18, 2**19, 700_000]
    assert found.history['either'][-1] == found.estimates['either']
    assert [e.samples for e in found.history['either']] == [2**18, 2**19, 700_000]


def test_what_does_not_matter_explains_nothing() -> None:
    """The load's place across the arm explains no saturation; the elbow's angle explains most."""
    study = two_link()
    more = {**study.spreads, 'payload.y': normal(0.0, 0.05)}
    found = run(replace(study, spreads=more), 400_000, workers=1).sensitivity
    shares = {name: share['saturation'] for name, share in found.items()}
    assert shares['payload.y'] < 1e-3
    assert max(shares, key=lambda name: shares[name]) == 'theta2.position'


def test_first_order_shares_are_those_of_a_sum() -> None:
    """A threshold on a limit alone is explained wholly by that limit."""
    robot = arm_robot(PAPER)
    study = Study(
        robot, {'theta1.limit': uniform(50.0, 100.0), 'slope': uniform(0, 0)}, (0, 0), (1, 99)
    )
    found = run(study, 200_000, workers=1)
    assert found.estimates['saturation'].probability == pytest.approx(0.495, abs=0.01)
    assert found.sensitivity['theta1.limit']['saturation'] > 0.9


def test_a_mission_fails_if_any_part_fails() -> None:
    """1 - (1 - 0.1)^3 (1 - 0.2) by hand."""
    assert together([0.1, 0.2], [3, 1]) == pytest.approx(1.0 - 0.9**3 * 0.8)
    assert together([0.0], [1000]) == 0.0
    assert together([1.0], [1]) == pytest.approx(1.0)


def test_an_unknown_name_is_refused() -> None:
    """The error says what may vary."""
    with pytest.raises(BadConfig, match=r'wheel\.mass: expected slope'):
        risk_kernel(tracked(), ('wheel.mass',), (0.0,) * 4, ())


def test_every_known_name_can_vary() -> None:
    """Each name compiles into a kernel of its own."""
    robot = replace(
        tracked(), links=(*tracked().links[:-1], Link('flippers', 2.0, (0.1, 0.0, 0.0)))
    )
    for name in known_names(robot):
        if not name.endswith('.limit'):
            assert risk_kernel(robot, (name,), (0.0,) * 4, robot.joint_names).names == (name,)
