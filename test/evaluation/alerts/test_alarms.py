"""Alarm states after operator actions, compared with a simple model of boolean flags.

UGV_ACCEPTANCE_ALARM_STEPS makes the run of random events longer.
"""

import os
import random
from dataclasses import dataclass, field

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from ugv_acceptance import AcceptanceError
from ugv_acceptance.evaluation.alerts.alarms import (
    LONGEST_SHELVING,
    Alarms,
    Change,
    Key,
    State,
    key_of,
    latches,
)
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, STALE, WARN, Alert, Rule

SECOND = 1_000_000_000
RULES = (
    Rule('TIP_OVER', 'front', ERROR, -0.1, -0.12, 0, SECOND),
    Rule('TIP_OVER', 'front', WARN, -0.2, -0.22, 0, SECOND),
    Rule('TORQUE_LIMIT', 'elbow', ERROR, 50.0, 48.0, 0, SECOND),
    Rule('INPUT_STALE', 'imu', STALE, 0.5, 0.5, 0, SECOND),
    Rule('CLOCK', 'imu', WARN, 0.5, 0.5, 0, SECOND),
)
TIP, TIP_WARN, ELBOW, STALE_IMU, CLOCK = (key_of(r) for r in RULES)


@dataclass
class Flags:
    """An alarm as plain flags: the oracle."""

    active: bool = False
    unseen: bool = False
    latched: bool = False
    shelf: int = 0

    def state(self) -> State:
        """Return the state these flags mean."""
        if self.active:
            return State.ACTIVE_UNACKNOWLEDGED if self.unseen else State.ACTIVE_ACKNOWLEDGED
        if self.unseen:
            return State.RETURNED_UNACKNOWLEDGED
        return State.LATCHED if self.latched else State.NORMAL


@dataclass
class Bench:
    """The alarms beside their oracle, driven by the same events."""

    alarms: Alarms = field(default_factory=Alarms)
    flags: list[Flags] = field(default_factory=lambda: [Flags() for _ in RULES])
    open: dict[int, Alert] = field(default_factory=dict)
    now: int = 0
    told: dict[Key, State] = field(default_factory=dict)

    def hear(self, changes: list[Change]) -> None:
        """Keep what the changes said, as a console does."""
        for change in changes:
            self.told[key_of(change.alert.rule)] = change.state

    def toggle(self, k: int) -> None:
        """Pass or leave limit k."""
        flags = self.flags[k]
        if k in self.open:
            alert = self.open.pop(k)
            alert.end = self.now
            self.hear(self.alarms.cleared(self.now, alert))
            flags.active = False
        else:
            self.open[k] = Alert(RULES[k], self.now, 1.0)
            self.hear(self.alarms.raised(self.now, self.open[k]))
            flags.active = flags.unseen = True
            flags.latched = k == 0

    def acknowledge(self, k: int | None) -> None:
        """Acknowledge one alarm, or all."""
        key = None if k is None else key_of(RULES[k])
        self.hear(self.alarms.acknowledge(self.now, 'operator', 'seen', key))
        for j, flags in enumerate(self.flags):
            if k in {None, j}:
                flags.unseen = False

    def reset(self, k: int | None) -> None:
        """Reset one alarm, or all, that are latched."""
        key = None if k is None else key_of(RULES[k])
        self.hear(self.alarms.reset(self.now, 'operator', '', key))
        for j, flags in enumerate(self.flags):
            if k in {None, j}:
                flags.latched = flags.latched and (flags.active or flags.unseen)

    def shelve(self, k: int, length: int) -> None:
        """Try to shelve."""
        flags, key = self.flags[k], key_of(RULES[k])
        known = flags.state() is not State.NORMAL or flags.shelf > 0
        allowed = known and RULES[k].level == WARN and 0 < length <= LONGEST_SHELVING
        if allowed:
            self.hear(self.alarms.shelve(self.now, key, length, 'operator'))
            flags.shelf = self.now + length
        else:
            with pytest.raises(AcceptanceError, match='shelve: '):
                self.alarms.shelve(self.now, key, length, 'operator')

    def pass_time(self, length: int) -> None:
        """Let time pass."""
        self.now += length
        self.hear(self.alarms.advance(self.now))
        for flags in self.flags:
            if flags.shelf <= self.now:
                flags.shelf = 0

    def check(self) -> None:
        """Hold the alarms to the flags."""
        for expected, key in zip(self.flags, map(key_of, RULES), strict=True):
            assert self.alarms.state(key) is expected.state()
            assert self.alarms.shelved(key) is (expected.shelf > 0)
            assert self.told.get(key, State.NORMAL) is expected.state()
        assert len(self.alarms.table) <= len(RULES)


class AlarmMachine(RuleBasedStateMachine):
    """Any order of events."""

    @initialize()
    def start(self) -> None:
        """Begin with nothing."""
        self.bench = Bench()

    @rule(k=st.integers(0, len(RULES) - 1))
    def toggle(self, k: int) -> None:
        """Pass or leave a limit."""
        self.bench.toggle(k)

    @rule(k=st.none() | st.integers(0, len(RULES) - 1))
    def acknowledge(self, k: int | None) -> None:
        """Acknowledge."""
        self.bench.acknowledge(k)

    @rule(k=st.none() | st.integers(0, len(RULES) - 1))
    def reset(self, k: int | None) -> None:
        """Reset."""
        self.bench.reset(k)

    @rule(k=st.integers(0, len(RULES) - 1), length=st.integers(-1, LONGEST_SHELVING + 1))
    def shelve(self, k: int, length: int) -> None:
        """Shelve."""
        self.bench.shelve(k, length)

    @precondition(lambda self: self.bench.now < 10**15)
    @rule(length=st.integers(0, LONGEST_SHELVING))
    def pass_time(self, length: int) -> None:
        """Let time pass."""
        self.bench.pass_time(length)

    @invariant()
    def same(self) -> None:
        """Alarms and flags agree, and so does who only heard the changes."""
        if hasattr(self, 'bench'):
            self.bench.check()


TestAlarmMachine = AlarmMachine.TestCase
TestAlarmMachine.settings = settings(max_examples=40, stateful_step_count=50)


def test_a_long_run_of_random_events_agrees_with_the_flags() -> None:
    """Ten thousand events (or more by environment): states, shelves and what was told agree."""
    bench, rng = Bench(), random.Random(7)
    for _ in range(int(os.environ.get('UGV_ACCEPTANCE_ALARM_STEPS', '10000'))):
        k = rng.randrange(len(RULES))
        event = rng.randrange(5)
        if event == 0:
            bench.toggle(k)
        elif event == 1:
            bench.acknowledge(rng.choice((None, k)))
        elif event == 2:
            bench.reset(rng.choice((None, k)))
        elif event == 3:
            bench.shelve(k, rng.randrange(-1, LONGEST_SHELVING + 2))
        else:
            bench.pass_time(rng.randrange(LONGEST_SHELVING // 10))
        bench.check()


def raised(alarms: Alarms, k: int) -> Alert:
    """Return an alert of rule k, just raised."""
    alert = Alert(RULES[k], 0, 1.0)
    alarms.raised(0, alert)
    return alert


def test_acknowledging_never_clears_an_active_limit() -> None:
    """What is active and acknowledged stays active, with who, when and why."""
    alarms = Alarms()
    raised(alarms, 2)
    change = alarms.acknowledge(5, 'Ada', 'known load')[0]
    assert alarms.state(ELBOW) is State.ACTIVE_ACKNOWLEDGED
    assert (change.who, change.time, change.note) == ('Ada', 5, 'known load')
    assert alarms.table[ELBOW].acknowledged == change


def test_a_tip_over_stays_until_it_is_reset() -> None:
    """Over and seen is not enough: only a reset lets go, and only of what was seen."""
    alarms = Alarms()
    alert = raised(alarms, 0)
    alarms.cleared(1, alert)
    assert alarms.reset(2, 'Ada') == []
    alarms.acknowledge(3, 'Ada')
    assert alarms.state(TIP) is State.LATCHED
    alarms.reset(4, 'Ada')
    assert alarms.state(TIP) is State.NORMAL


def test_a_newer_alert_is_not_cleared_by_the_end_of_an_older() -> None:
    """The end of an alert does not clear the alarm of a newer one that replaced it."""
    alarms = Alarms()
    first = raised(alarms, 2)
    raised(alarms, 2)
    assert alarms.cleared(1, first) == []
    assert alarms.state(ELBOW).active


def test_critical_alarms_and_lost_data_cannot_be_shelved() -> None:
    """Only warnings can be shelved; any other alarm is refused with the reason."""
    alarms = Alarms()
    for k, key in ((0, TIP), (2, ELBOW), (3, STALE_IMU)):
        raised(alarms, k)
        with pytest.raises(AcceptanceError, match='only CAUTION can be shelved'):
            alarms.shelve(0, key, SECOND, 'Ada')


def test_the_shelf_ends_by_itself_at_its_time() -> None:
    """Shelving ends by itself, and the change is dated to when it was due."""
    alarms = Alarms()
    raised(alarms, 4)
    alarms.shelve(0, CLOCK, 60 * SECOND, 'Ada')
    assert alarms.advance(59 * SECOND) == []
    (change,) = alarms.advance(80 * SECOND)
    assert (change.how, change.time) == ('unshelved', 60 * SECOND)


@pytest.mark.parametrize('length', [1, 600 * SECOND])
def test_a_warning_is_shelved_for_at_most_ten_minutes(length: int) -> None:
    """A warning can be shelved for exactly ten minutes, and no longer."""
    alarms = Alarms()
    raised(alarms, 4)
    (change,) = alarms.shelve(7, CLOCK, length, 'Ada', 'known')
    assert (change.how, change.time, change.who, change.note) == ('shelved', 7, 'Ada', 'known')
    assert change.state is State.ACTIVE_UNACKNOWLEDGED
    assert alarms.advance(6 + length) == []
    assert alarms.shelved(CLOCK)
    assert len(alarms.advance(7 + length)) == 1
    assert not alarms.shelved(CLOCK)


@pytest.mark.parametrize(
    ('length', 'got'), [(0, '0 s'), (-SECOND, '-1 s'), (601 * SECOND, '601 s')]
)
def test_shelving_for_no_time_or_too_long_is_refused(length: int, got: str) -> None:
    """Shelving for 0 s or too long is refused with the permitted range in seconds."""
    alarms = Alarms()
    raised(alarms, 4)
    expected = f'^shelve: expected above 0 and at most 600 s, got {got}$'
    with pytest.raises(AcceptanceError, match=expected):
        alarms.shelve(0, CLOCK, length, 'Ada')
    assert not alarms.shelved(CLOCK)


def test_what_is_not_known_cannot_be_shelved() -> None:
    """Shelving an alarm that does not exist is refused with its code and subject."""
    with pytest.raises(
        AcceptanceError, match=r"^shelve: expected a known alarm, got 'CLOCK' of 'imu'$"
    ):
        Alarms().shelve(0, CLOCK, SECOND, 'Ada')
    assert Alarms().unshelve(0, CLOCK) == []


def test_shelves_end_in_the_order_of_their_times() -> None:
    """Shelved alarms return in the order of their end times, however they were shelved."""
    alarms = Alarms()
    raised(alarms, 1)
    raised(alarms, 4)
    alarms.shelve(0, TIP_WARN, 9 * SECOND, 'Ada')
    alarms.shelve(0, CLOCK, 5 * SECOND, 'Ada')
    over = [(key_of(c.alert.rule), c.time) for c in alarms.advance(20 * SECOND)]
    assert over == [(CLOCK, 5 * SECOND), (TIP_WARN, 9 * SECOND)]


@pytest.mark.parametrize(
    ('state', 'active', 'unseen'),
    [
        (State.NORMAL, False, False),
        (State.ACTIVE_UNACKNOWLEDGED, True, True),
        (State.ACTIVE_ACKNOWLEDGED, True, False),
        (State.RETURNED_UNACKNOWLEDGED, False, True),
        (State.LATCHED, False, False),
    ],
)
def test_a_state_says_what_is_active_and_what_was_seen(
    state: State, *, active: bool, unseen: bool
) -> None:
    """An alarm has one of five states of ISA-18.2, by whether it is active and acknowledged."""
    assert (state.active, state.unseen) == (active, unseen)


@pytest.mark.parametrize(
    ('code', 'level', 'latched'),
    [
        ('TIP_OVER', ERROR, True), ('NO_SUPPORT', ERROR, True), ('TIP_OVER', WARN, False),
        ('TORQUE_LIMIT', ERROR, False), ('NO_SUPPORT', STALE, False),
    ],
)  # fmt: skip
def test_only_a_robot_that_may_lie_on_its_side_latches(
    code: str, level: int, *, latched: bool
) -> None:
    """Only critical TIP_OVER and NO_SUPPORT alarms stay until they are reset."""
    assert latches(Rule(code, 'front', level, 1.0, 0.5, 0, 0)) is latched


def test_an_alarm_that_is_over_and_seen_is_forgotten_unless_it_is_shelved() -> None:
    """An alarm that is over and acknowledged is removed, unless it is shelved."""
    alarms = Alarms()
    alert = raised(alarms, 4)
    alarms.shelve(0, CLOCK, 60 * SECOND, 'Ada')
    alarms.acknowledge(1, 'Ada')
    alarms.cleared(2, alert)
    assert alarms.state(CLOCK) is State.NORMAL
    assert CLOCK in alarms.table
    (change,) = alarms.unshelve(3, CLOCK, 'Eve')
    assert (change.how, change.who, change.time) == ('unshelved', 'Eve', 3)
    assert CLOCK not in alarms.table
