"""Takes questions about planned motions one after the other, and keeps permissions true.

A question is read and computed in a thread, so that no message waits for it. One waits beside the
one that is computed: of more the newest is taken. Of all permissions the newest alone stands, for
two motions together were never judged; it is withdrawn as soon as what it rests on changes.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

from ugv_acceptance import BadSample
from ugv_acceptance.bag.trajectory import TrajectoryMessage, stamp_of, trajectory_from
from ugv_acceptance.evaluation.planned_motion import CheckedMotion, Trajectory, check_motion
from ugv_acceptance.monitoring.diagnostics import Status
from ugv_acceptance.monitoring.motion_answers import (
    EXPIRED,
    NOT_KNOWN,
    PERMITTED,
    REFUSED,
    VALID,
    VALID_NS,
    WITHDRAWN,
    Asked,
    answer,
    situation_values,
)
from ugv_acceptance.monitoring.motion_situation import (
    Situation,
    change,
    dangers,
    missing,
    situation_of,
)
from ugv_acceptance.monitoring.session import Session

# Bytes of a message beyond which it is not read: that of MOST_POINTS points of 20 joints.
LONGEST = 8_000_000
# A beginning (ns) that is over by no more than a message takes to come is now.
LATE = 500_000_000
# Questions displaced by newer ones that are answered in a second (ns); more are only counted.
DISPLACED, SECOND = 20, 1_000_000_000


@dataclass(frozen=True, slots=True)
class Question:
    """A question as it came: its bytes, when it came (ns, steady), and ROS time then (ns)."""

    data: bytes
    time: int
    ros: int


@dataclass(frozen=True, slots=True)
class Found:
    """What was computed of a question: what names it, and the motion judged or why it was not."""

    asked: Asked
    checked: CheckedMotion | None = None
    result: str = ''
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Permission:
    """A permission that stands: what for, what it rests on, until when (ns, steady)."""

    asked: Asked
    situation: Situation
    until: int


@dataclass(slots=True)
class MotionQuestions:
    """Answers questions about planned motions for one monitor.

    `session` returns its session (None: not active), `load_by` who told the payload ('': nobody),
    `on_problem(text)` writes to the log. Counted are questions `asked`, `malformed`, `displaced`.
    """

    session: Callable[[], Session | None]
    load_by: Callable[[], str]
    on_problem: Callable[[str], None]
    asked: int = 0
    malformed: int = 0
    displaced: int = 0
    standing: Permission | None = None
    _waiting: Question | None = None
    _computed: 'tuple[Question, Situation | None, Future[Found]] | None' = None
    _pool: ThreadPoolExecutor | None = None
    _second: int = 0
    _told: int = 0
    _ready: list[Status] = field(default_factory=list)

    @property
    def busy(self) -> bool:
        """Whether `look` has something to do: a question or a permission."""
        return self.computing or self.standing is not None

    @property
    def computing(self) -> bool:
        """Whether a question is not answered yet."""
        return self._waiting is not None or self._computed is not None

    def ask(self, question: Question) -> list[Status]:
        """Take a question; return the answers that can be given at once."""
        self.asked += 1
        if len(question.data) > LONGEST:
            reason = f'the message has {len(question.data):,} bytes, at most {LONGEST:,} are read'
            return [Asked('', stamp_of(question.data)).status(REFUSED, [reason])]
        before, self._waiting = self._waiting, question
        said = [] if before is None else list(self._displace(before, question.time))
        self._begin()
        return said

    def _displace(self, question: Question, now: int) -> Iterator[Status]:
        self.displaced += 1
        if now - self._second > SECOND:
            self._second, self._told = now, 0
        self._told += 1
        if self._told <= DISPLACED:
            reason = 'too many questions at once: a newer one took its place; ask again'
            yield Asked('', stamp_of(question.data)).status(REFUSED, [reason])

    def _begin(self) -> None:
        """Give the question that waits to the thread, if that is free."""
        if self._waiting is None or self._computed is not None:
            return
        question, self._waiting = self._waiting, None
        session, load_by = self.session(), self.load_by()
        reasons, result = tuple(dangers(session)), REFUSED
        if not reasons:
            reasons, result = tuple(missing(session, load_by)), NOT_KNOWN
        then = None if session is None or reasons else situation_of(session, load_by)
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1, thread_name_prefix='planned_motion')
        case = question, then, result, reasons
        self._computed = question, then, self._pool.submit(_found, *case)

    def look(self, now: int) -> list[Status]:
        """Return what there is to say at `now` (ns, steady); to be called often while `busy`."""
        said = list(self._watch(now))
        if self._computed is not None and self._computed[2].done():
            said += self._collect(now)
        self._begin()
        if self.session() is None and not self.busy:
            self.close()
        return said

    def _watch(self, now: int) -> Iterator[Status]:
        """Yield that the permission no longer stands, if so."""
        if self.standing is None:
            return
        asked, then = self.standing.asked, self.standing.situation
        cause, sentence = change(then, self.session(), self.load_by())
        values = situation_values(then)
        if cause:
            self.standing = None
            yield asked.status(WITHDRAWN, [sentence], values | {'cause': cause})
        elif now >= self.standing.until:
            self.standing = None
            yield asked.status(EXPIRED, [f'{VALID:g} s are over; ask again'], values)

    def _collect(self, now: int) -> Iterator[Status]:
        """Yield the answer that was computed, unless what it rests on has changed since."""
        if self._computed is None:
            return
        (question, then, future), self._computed = self._computed, None
        error = future.exception()
        if error is not None:
            self.on_problem(f'planned motion: fault of the monitor: {error!r}')
            reason = f'fault of the monitor: {error!r}'
            yield Asked('', stamp_of(question.data)).status(NOT_KNOWN, [reason])
            return
        found = future.result()
        self.malformed += not found.asked.sha256
        if found.checked is None or then is None:
            yield found.asked.status(found.result, found.reasons)
            return
        cause, sentence = change(then, self.session(), self.load_by())
        if cause or now >= question.time + VALID_NS:
            reason = sentence or f'it took longer than {VALID:g} s'
            reasons = [f'while it was computed: {reason}']
            yield found.asked.status(NOT_KNOWN, reasons, situation_values(then))
            return
        said = answer(found.asked, found.checked, then, question.ros + VALID_NS)
        if said.values['result'] == PERMITTED:
            yield from self._replace(found.asked)
            self.standing = Permission(found.asked, then, question.time + VALID_NS)
        yield said

    def _replace(self, asked: Asked) -> Iterator[Status]:
        """Yield that the permission of another motion ends with the newer one."""
        before = self.standing
        if before is not None and before.asked.sha256 != asked.sha256:
            reason = 'a newer motion is permitted, and both together were not judged'
            values = situation_values(before.situation) | {'cause': 'newer'}
            yield before.asked.status(WITHDRAWN, [reason], values)

    def give_up(self, why: str) -> Iterator[Status]:
        """Yield that nothing is known of what was asked, after a fault in here."""
        reason = f'fault of the monitor: {why}'
        if self.standing is not None:
            yield self.standing.asked.status(WITHDRAWN, [reason], {'cause': 'monitor'})
        for question in (self._waiting, self._computed and self._computed[0]):
            if question is not None:
                yield Asked('', stamp_of(question.data)).status(NOT_KNOWN, [reason])
        self.standing = self._waiting = self._computed = None

    def close(self) -> None:
        """End the thread."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None


def _found(
    question: Question, then: Situation | None, result: str, reasons: tuple[str, ...]
) -> Found:
    """Return what there is to say about a question; in a thread of its own."""
    try:
        message = trajectory_from(question.data)
    except BadSample as error:
        return Found(Asked('', stamp_of(question.data)), None, REFUSED, (str(error),))
    asked = Asked(message.sha256, message.stamp)
    if then is None:
        return Found(asked, None, result, reasons)
    if untimely := _untimely(message.stamp, question.ros):
        return Found(asked, None, NOT_KNOWN, (untimely,))
    conditions = then.conditions(message.names)
    return Found(asked, check_motion(then.settings, trajectory_of(message), conditions))


def _untimely(stamp: int, now: int) -> str:
    """Return why a motion does not begin while an answer holds, by its stamp; '' if it does."""
    ahead = (stamp - now) / 1e9
    if not stamp or -LATE <= stamp - now <= VALID_NS:
        return ''
    if ahead < 0.0:
        return f'by its header stamp it was to begin {-ahead:.1f} s ago; 0 is at once'
    return f'by its header stamp it begins in {ahead:.1f} s; ask at most {VALID:g} s before'


def trajectory_of(message: TrajectoryMessage) -> Trajectory:
    """Return a decoded message as a planned motion."""
    return Trajectory(
        message.names,
        message.times / 1e9,
        message.positions,
        message.velocities,
        message.accelerations,
    )
