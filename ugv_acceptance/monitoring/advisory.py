"""Computes advice and predictions for the operator while messages are being processed.

Advice takes some hundredths of a second, so that it is computed in a thread of its own, and again
only when the robot has moved.
"""

import math
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.advice.search import COMPUTED, Advice, advise
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR, has_tipped
from ugv_acceptance.evaluation.alerts.messages import advice
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.effort.facts import JointMeaning
from ugv_acceptance.evaluation.effort.live_rests import LiveRests, PayloadEstimate
from ugv_acceptance.evaluation.effort.understanding import Understanding, understand
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.model.sliding import slide_left
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.monitoring.background import Snapshot, one_thread, snapshot_of
from ugv_acceptance.monitoring.trends import Ahead, Trends, end_words

# Age (ns) from which computed advice is renewed, if a joint has moved by more than MOVED (rad, m)
# since or gravity by more than TURNED (m/s2), half a degree each: its angles are whole degrees.
FRESH = 250_000_000
MOVED, TURNED = 0.0087, 0.085
# Time to a limit (s) below which the operator is warned at once; time (ns) between such warnings.
URGENT, AGAIN = 2.0, 1_000_000_000


@dataclass(slots=True)
class Advisory:
    """Keeps the advice of one session up to date; `advice` is the newest, best first.

    `efforts` is what the joints' efforts mean and say, None before the robot has rested; `estimate`
    is the payload that they suggest, if it differs from the declared one. `on_problem(text)` writes
    to the log. `pool` computes: a thread, unless simulated time has to wait for it.
    """

    evaluator: LiveEvaluator
    trends: Trends
    on_problem: Callable[[str], None]
    advice: tuple[Advice, ...] = ()
    estimate: PayloadEstimate | None = None
    efforts: Understanding | None = None
    rests: LiveRests = field(init=False)
    _made: int = 0
    _told: int = 0
    pool: Executor = field(default_factory=one_thread)
    _asked: 'Future[tuple[Advice, ...]] | None' = None
    _at: Snapshot | None = None
    _found: tuple[Advice, ...] = ()
    _judging: 'Future[Understanding] | None' = None

    def __post_init__(self) -> None:
        self.rests = LiveRests(self.evaluator.settings)

    def renew(self, now: int, active: list[Alert]) -> None:
        """Start computing new advice if an active alert needs it and the last is too old."""
        margins, evaluator = self.evaluator.margins, self.evaluator
        if margins is None or not any(alert.rule.code in COMPUTED for alert in active):
            self.advice = ()
        elif self._asked is None:
            at = snapshot_of(evaluator.settings, margins, evaluator.payload)
            if self._at is not None and self._at.holds(at, MOVED, TURNED):
                self.advice = self._found
            elif now - self._made >= FRESH:
                case = at.settings, at.q, at.gravity, at.payload
                self._at, self._made = at, now
                self._asked = self.pool.submit(advise, *case)

    def arrived(self) -> bool:
        """Collect advice whose computation has finished; return whether its subjects changed."""
        if self._asked is None or not self._asked.done():
            return False
        asked, self._asked, before = self._asked, None, self.advice
        error = asked.exception()
        if error is not None:
            self.on_problem(f'advice: fault of the monitor: {error!r}')
            self._at = None
        self.advice = self._found = () if error is not None else asked.result()
        return [a.subject for a in self.advice] != [b.subject for b in before]

    def close(self) -> None:
        """Stop: end the thread that computes advice."""
        self.pool.shutdown(wait=False, cancel_futures=True)

    def feel(self) -> None:
        """Remember the efforts at rest and judge them now and then; to be called once a second."""
        margins, evaluator = self.evaluator.margins, self.evaluator
        if self._judging is not None and self._judging.done():
            judged, self._judging = self._judging, None
            error = judged.exception()
            if error is None:
                self.felt(judged.result())
            else:
                self.on_problem(f'efforts: fault of the monitor: {error!r}')
        if margins is None:
            return
        rates, efforts = evaluator.measured
        due = self.rests.see(
            margins.time, margins.q, rates, efforts, margins.gravity, margins.torque
        )
        if due and self._judging is None:
            self._judge()

    def _judge(self) -> None:
        """Judge the efforts remembered so far, in the thread for advice."""
        case = self.evaluator.settings, (), self.rests.rests()
        self._judging = self.pool.submit(understand, *case)

    def felt(self, found: Understanding) -> None:
        """Take what the efforts mean and say; in motion the payload suggested before stays."""
        self.efforts = found
        if self.rests.judged_by(found):
            estimate = self.rests.estimate(found)
            self.estimate = estimate if estimate is not None and estimate.differs else None

    @property
    def opposed(self) -> list[JointMeaning]:
        """The joints whose effort has the opposite sign."""
        joints = () if self.efforts is None else self.efforts.joints
        return [joint for joint in joints if joint.opposed]

    @property
    def tipped(self) -> bool:
        """Whether the robot has tipped over, by its newest margins."""
        margins = self.evaluator.margins
        return margins is not None and has_tipped(margins.angle)

    def do(self, alert: Alert) -> str:
        """Return what to do about an alert: the computed advice for its margin, else general.

        To stand clear is all that is said, about any alert, once the robot has tipped.
        """
        rule = alert.rule
        if self.tipped:
            return STAND_CLEAR
        if rule.code in COMPUTED and self.advice and self.advice[0].margin == rule.subject:
            return self.advice[0].sentence
        return advice(rule.code, self.evaluator.settings.robot)

    def ahead(self, now: int) -> tuple[Ahead, ...]:
        """Return the margins that will be used up soon, the soonest first."""
        return self.trends.ahead(now) if self.evaluator.margins is not None else ()

    def urgent(self, now: int) -> bool:
        """Return whether a margin is used up so soon that a verdict must be published at once.

        Cheap: most of the time it compares a few numbers.
        """
        if now - self._told < AGAIN:
            return False
        soon = self.ahead(now)
        if soon and soon[0].seconds <= URGENT:
            self._told = now
            return True
        return False

    def values(self, now: int) -> dict[str, object]:
        """Return values for the verdict: time to a limit, near misses, slope, payload, advice."""
        values: dict[str, object] = {}
        for ahead in reversed(self.ahead(now)):
            kind = 'tip' if ahead.subject in SIDES else 'saturation'
            values |= {f'{kind}_in_s': round(ahead.seconds, 2), f'{kind}_of': ahead.subject}
        for miss in self.trends.near_misses():
            tilt = miss.subject in SIDES
            left = math.degrees(miss.left) if tilt else miss.left
            name = 'near_miss_tilt_deg' if tilt else 'near_miss_torque'
            values |= {name: round(left, 2), f'{name}_of': miss.subject, f'{name}_ns': miss.time}
        left = self.slide()
        if math.isfinite(left):
            values['slide_left_deg'] = round(math.degrees(left), 2)
        if self.estimate is not None:
            values['payload_estimate_kg'] = round(max(self.estimate.mass, 0.0), 2)
        # What was computed before a fall may arrive after it.
        told = [STAND_CLEAR] if self.tipped else [found.sentence for found in self.advice[:3]]
        values |= {f'advice_{k + 1}': sentence for k, sentence in enumerate(told)}
        return values

    def slide(self) -> float:
        """Return the slope (rad) left until the tracks slide; infinite if it is not known."""
        margins, settings = self.evaluator.margins, self.evaluator.settings
        if margins is None or not settings.hears_imu:
            return math.inf
        return float(slide_left(margins.gravity, settings.limits.friction))

    def hints(self, now: int) -> list[str]:
        """Return sentences for the operator in addition to alerts: margins that shrink."""
        hints = []
        soon = self.ahead(now)
        if soon and soon[0].seconds > 0.0:
            hints.append(_ahead_words(soon[0]))
        return hints


def _ahead_words(ahead: Ahead) -> str:
    tips, rate = ahead.subject in SIDES, abs(ahead.rate)
    shrinks = f'{math.degrees(rate):.0f} deg/s' if tips else f'{rate:.0f} N m/s'
    end = end_words(ahead.subject, f'{ahead.seconds:.1f}', tips=tips)
    return f'shrinking by {shrinks}: {end}'
