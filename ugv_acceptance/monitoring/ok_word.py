"""The one word for programs, `~/ok`: whether margins are known and kept, and if not, why not.

It is for a team that lets its own gate of motion depend on it, so it is stricter than the verdict:
false wherever the verdict is DANGER or NO DATA, and also

* until margins have been known without a gap for SETTLED, or for the longest delay of an alert if
  that is longer: before, an alert that is due may not have been raised (activation, reset, gap);
* while a margin that motion depends on is not judged: tip-over (no IMU, `attitude: level`), or
  torques while the hand touches the ground;
* under a CAUTION that leaves something essential unknown: all but those of ADVISING. So a limit
  that is relaxed, a second or foreign publisher, a robot that is not the configured one, another
  payload than declared, a margin smaller than its uncertainty, a wrong clock, a slow input, an IMU
  or a motor that contradicts itself. An alert that is new here is one of these;
* while a margin is where DANGER begins, before the alert's delay is over too;
* while a failure of the robot that is over waits to be acknowledged, of tip-over to be reset;
* until the uncertainty of the margins has been worked out once;
* while the data are older than the stale limit of their input: by receipt, by a header stamp that
  stands still (a driver that repeats its last message), and by how much later than the quickest of
  the last minute they come (a queue before us). With simulated time not by the last.

What it cannot see: values that stand still under stamps that run on. A robot at rest sends the
same; alerts say it later, of an IMU after 1 s.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from ugv_acceptance.evaluation.alerts.level_words import level_words
from ugv_acceptance.evaluation.alerts.state_machine import WARN
from ugv_acceptance.evaluation.criteria.not_judged import unknown_words
from ugv_acceptance.evaluation.inputs.joint_rows import NEVER
from ugv_acceptance.evaluation.inputs.joints import JointMerger
from ugv_acceptance.evaluation.inputs.timeouts import FOREVER, InputTimeout
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import RAISED, STANDING
from ugv_acceptance.monitoring.session import Session

# Time (s) for which margins must have been known before the word can be true.
SETTLED = 1.0
# The alerts whose CAUTION says that a margin is small, and nothing that it is not known: the only
# ones under which the word may be true.
ADVISING = frozenset(
    {
        'ACCELERATION',
        'EFFORT_LIMIT',
        'MESSAGES_LOST',
        'SLIDE',
        'TIP_AHEAD',
        'TIP_MOVING',
        'TIP_OVER',
        'TIP_TREND',
        'TORQUE_AHEAD',
        'TORQUE_LIMIT',
        'TRACK_LIFT',
    }
)
# Half of the time (ns) over which the quickest message of an input is remembered.
HALF = 30_000_000_000
# What is so while an alert of DANGER waits for its delay.
REACHED = 'a limit of DANGER is passed'


@dataclass(slots=True)
class Delay:
    """How much later than the quickest of the last minute the messages of an input come (ns).

    Stamp and receipt are of two clocks, so only their difference to the least seen tells something.
    """

    _least: int = FOREVER
    _before: int = FOREVER
    _until: int = 0

    def behind(self, now: int, after: int) -> int:
        """Return how late a message is that came `after` its stamp (ns, of two clocks)."""
        if now >= self._until:
            self._before, self._least, self._until = self._least, after, now + HALF
        self._least = min(self._least, after)
        return after - min(self._least, self._before)


@dataclass(slots=True)
class OkWord:
    """Judges one session; ask it often, about ten times a second, or gaps go unseen.

    `why_not()` is '' where the word is true, else the first reason in words.
    """

    session: Session
    _known_since: int | None = None
    _delays: dict[str, Delay] = field(default_factory=dict)

    def why_not(self) -> str:
        """Return why the word is false now; '': it is true. Does not let time pass: tick before."""
        now = self.session.clock.now()
        unknown = next(self._unknown(now), '')
        if unknown:
            self._known_since = None
            return unknown
        if self._known_since is None:
            self._known_since = now
        known = now - self._known_since
        settled = _settled(self.session.settings)
        if known < settled:
            return f'margins known for {known / 1e9:.1f} s, expected {settled / 1e9:g} s'
        return next(self._objections(), '')

    def _unknown(self, now: int) -> Iterator[str]:
        """Yield which margins, or data that they rest on, are not known at `now` (ns)."""
        session, evaluator = self.session, self.session.evaluator
        margins = evaluator.margins
        if margins is None:
            yield 'margins not known'
            return
        if not session.settings.judges_tilt:
            yield 'tip-over is not judged'
        if not evaluator.load_known:
            yield 'the payload is not known'
        if evaluator.joints.doubted:
            yield 'a joint is taken as held that may be elsewhere'
        if margins.state not in (STANDING, RAISED):
            yield 'no tip-over margin'
        angles: Any = margins.angle
        if any(map(math.isnan, (*angles, *margins.torque))):
            yield 'tip-over or a torque is not judged'
        yield from self._old(now)

    def _old(self, now: int) -> Iterator[str]:
        """Yield the inputs whose data are older than their stale limit at `now` (ns)."""
        evaluator, settings = self.session.evaluator, self.session.settings
        joints, imu = evaluator.fresh
        if settings.hears_joints:
            yield from self._late('joint_states', joints, told_anew(evaluator.joints), now)
        yield from self._late('imu', imu, imu.moved, now)

    def _late(self, name: str, timeout: InputTimeout, anew: int, now: int) -> Iterator[str]:
        """Yield whether what an input told, anew last at `anew` (ns), is too old at `now` (ns)."""
        if timeout.last is None:
            yield f'no {name}'
            return
        age = now - min(anew, timeout.moved)
        if not self.session.stamps.simulated:
            delay = self._delays.setdefault(name, Delay())
            behind = delay.behind(now, timeout.last - timeout.stamp)
            age = max(age, now - timeout.last + behind)
        if age > timeout.limit:
            limit = timeout.limit / 1e9
            yield f'{name} {age / 1e9:.2f} s old, stale from {limit:.2f} s on'

    def _objections(self) -> Iterator[str]:
        """Yield what speaks against the word though all margins are known."""
        session = self.session
        for alert in sorted(session.active, key=lambda alert: -alert.rule.level):
            rule = alert.rule
            if rule.level > WARN or rule.code not in ADVISING:
                yield f'{level_words(rule.level)} {rule.code} {rule.subject}'
        if danger_is_reached(session):
            yield REACHED
        if session.evaluator.waits_for_trend:
            yield 'whether the robot begins to tip is not known yet'
        if not session.certainty.known:
            yield 'how well the margins are known is not worked out yet'
        if session.settings.unknown:
            yield unknown_words(session.settings)
        for alarm in session.alarm_tracker.waiting:
            yield f'{alarm.rule.code} {alarm.rule.subject}: {alarm.state.value}'


def told_anew(joints: JointMerger) -> int:
    """Return when (ns) the oldest position in force was told anew: not by a message repeated.

    NEVER while a joint was not told; joints that are taken as held do not count.
    """
    if min(joints.seen, default=FOREVER) == NEVER:
        return NEVER
    newest = [
        layout.repeats.since
        for layout in joints.layouts.values()
        if any(joints.seen[j] == layout.last for j, _ in layout.pairs)
    ]
    return min([*newest, *joints.seen])


def danger_is_reached(session: Session) -> bool:
    """Return whether a margin is now where DANGER begins, though the alert's delay is not over."""
    watch = session.evaluator.watch
    return any(error.raw for _, error in (*watch.torque, *watch.tip))


def _settled(settings: Settings) -> int:
    """Return for how long (ns) margins must have been known: no alert takes longer to be raised."""
    delays, imu = settings.delays, settings.imu
    longest = max(delays.tip_on, delays.torque_on, delays.fault_on, imu.agreement_delay)
    return int(max(SETTLED, longest) * 1e9)
