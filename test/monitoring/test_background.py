"""Advice and bounds are computed beside the messages, and again only when the robot has moved."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import pytest
from monitoring.test_advisory import FOLDED, PACKBOT, STRETCHED, give
from nodes.live_case import NAMES

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.config import load
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.evaluation.advice.search import advise
from ugv_acceptance.evaluation.criteria.uncertainty import effects_of
from ugv_acceptance.monitoring.background import AtOnce
from ugv_acceptance.monitoring.ok_word import OkWord
from ugv_acceptance.monitoring.session import Session

SOURCES = sources_from(load())


class Counting(AtOnce):
    """Does what it is given at once, and counts it."""

    def __init__(self) -> None:
        self.done: list[Any] = []

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> 'Future[Any]':
        """Note the function and call it."""
        self.done.append(fn)
        return super().submit(fn, *args, **kwargs)


class Never(AtOnce):
    """Never ends what it is given."""

    def submit(self, *_: Any, **__: Any) -> 'Future[Any]':
        """Return a future of which nothing comes."""
        return Future()


class Clock:
    """A clock that is set."""

    at = 10**18

    def now(self) -> int:
        """Return the time (ns)."""
        return self.at


def run(pool: AtOnce, *postures: tuple[float, ...], seconds: float = 2.0) -> Session:
    """Return a session that saw a robot rest in each posture, advised twenty times a second."""
    clock = Clock()
    session = Session(
        PACKBOT, lambda *_: None, lambda: None, lambda _: None, clock, sources=SOURCES, pool=pool
    )
    for q in postures:
        for _ in range(round(20 * seconds)):
            clock.at += 50_000_000
            give(session, q)
            session.tick()
            session.advisory.renew(clock.at, session.active)
            session.advisory.arrived()
    return session


def nearby(q: tuple[float, ...], by: float) -> tuple[float, ...]:
    """Return a posture whose shoulder is `by` (rad) elsewhere."""
    return (q[0], q[1] + by, *q[2:])


@pytest.mark.parametrize(('by', 'count'), [(0.0, 1), (0.004, 1), (0.02, 2)])
def test_advice_is_computed_again_when_the_robot_has_moved(by: float, count: int) -> None:
    """Not for a quarter of a degree, and never for a robot that stands; for a degree it is."""
    pool = Counting()
    session = run(pool, STRETCHED, nearby(STRETCHED, by))
    assert pool.done.count(advise) == count
    margins = session.evaluator.margins
    assert margins is not None
    assert session.advisory.advice == advise(
        PACKBOT,
        nearby(STRETCHED, 0.0 if count == 1 else by),
        margins.gravity,
        PACKBOT.robot.payload,
    )


def test_advice_found_before_is_told_again_where_it_still_holds() -> None:
    """An alert that ends and begins again in the same posture needs no second search."""
    pool = Counting()
    session = run(pool, STRETCHED)
    advisory, now = session.advisory, session.clock.now()
    found = advisory.advice
    advisory.renew(now, [])
    assert advisory.advice == ()
    advisory.renew(now + 10**9, session.active)
    assert (advisory.advice, pool.done.count(advise)) == (found, 1)
    assert found


def test_other_settings_need_other_advice_and_bounds() -> None:
    """Limits that an operator changes are those that the advice keeps, and the bounds."""
    pool = Counting()
    session = run(pool, STRETCHED)
    # Equal, but another object, as a changed parameter gives.
    session.adopt(load().settings)
    session.advisory.renew(session.clock.now() + 10**9, session.active)
    session.certainty.look(
        session.clock.now(), session.evaluator.margins, session.evaluator.payload
    )
    assert (pool.done.count(advise), pool.done.count(effects_of)) == (2, 2)


def test_bounds_are_computed_again_when_the_robot_has_moved() -> None:
    """Once for a robot that stands still, once more where it has moved by two degrees."""
    pool = Counting()
    run(pool, FOLDED, nearby(FOLDED, 0.01), nearby(FOLDED, 0.05))
    assert pool.done.count(effects_of) == 2


def test_without_bounds_yet_nothing_is_in_doubt_and_they_are_looked_for_soon() -> None:
    """While they are being computed margins stand as they are; each tick looks for them."""
    session = run(Never(), FOLDED)
    assert session.certainty.told == {}
    assert session.certainty.due <= session.clock.now()


def test_the_word_for_programs_waits_for_the_first_bound() -> None:
    """A margin of which nobody knows how well it is known is not OK for a program."""
    words = []
    for pool in (Never(), Counting()):
        session = run(pool, FOLDED)
        word = OkWord(session)
        word.why_not()
        for _ in range(40):
            session.clock.at += 50_000_000  # type: ignore[attr-defined]
            give(session, FOLDED)
            session.tick()
            said = word.why_not()
        words.append(said)
    assert words == ['how well the margins are known is not worked out yet', '']


def test_what_the_bounds_raise_is_a_fault_of_the_monitor() -> None:
    """An error in the thread is told as any error of our own is."""
    session = run(Never(), FOLDED)
    failed: Future[Any] = Future()
    failed.set_exception(RuntimeError('no bound'))
    session.certainty._asked = failed
    with pytest.raises(RuntimeError, match='no bound'):
        session.tick()
    assert session.certainty.due > session.clock.now()


def test_the_messages_here_are_those_of_the_robot() -> None:
    """The names and the IMU of this file's robot are understood."""
    session = run(Counting(), FOLDED)
    now = session.clock.now()
    session.take_joint_state(joint_state_cdr(now, '', NAMES, FOLDED))
    session.take_imu(imu_cdr(now, 'imu_link', (0.0, 0.0, 0.0, 1.0), (0.0,) * 3, (0.0, 0.0, 9.81)))
    assert session.evaluator.margins is not None
