"""One situation as it is played: the robot runs, the question is asked, the answer carried out.

Time is simulated and advanced by the caller, so that a script runs as fast as it can.
"""

import math
import zlib
from dataclasses import dataclass, field, replace

import numpy as np

from ugv_acceptance import BadSample
from ugv_acceptance.config import Config
from ugv_acceptance.drill.acts import TURN, Scene
from ugv_acceptance.drill.judge import End, Facts, fault_of, has_tipped, success_of
from ugv_acceptance.drill.outcome import Outcome
from ugv_acceptance.drill.robot import LOOK, DrillRobot, Truth
from ugv_acceptance.drill.situation import (
    ADVICE,
    STOP,
    WAIT,
    Act,
    Case,
    Choice,
    Situation,
)
from ugv_acceptance.evaluation.advice.search import Advice
from ugv_acceptance.evaluation.alerts.state_machine import WARN

WATCH, ASK, ACTING, JUDGED = 'watch', 'ask', 'acting', 'judged'
# What may be done at any time: it ends neither the question nor, alone, the trouble.
FREE = (
    Choice(STOP, 'Stop arm and tracks, then think on', (Act('stop'),)),
    Choice(WAIT, 'Wait and see', halts=False),
)
# Why these are no answer.
TOO_LATE = 'no answer is an answer too: what was under way went on'
NOT_ENOUGH = 'to stop is a beginning: then do what the alert says'
# Seconds that a robot which has tipped is watched on, that nothing happens before a situation is
# over, and that lie between two motions of somebody who follows the advice.
FALLS, QUIET, AGAIN = 2.0, 1.0, 1.0
# Seconds that a robot is watched on which stands still because the operator only stopped it.
STANDS = 4.0
# Seconds in which an alert whose cause is gone ends by itself.
PATIENT = 6.5
# Seconds after which a question is asked whatever the robot does.
_AT_LAST = 40.0


@dataclass(slots=True)
class Play:
    """A situation under way: `phase`, the answers so far, in the end the `outcome`.

    `choices` are as shown, from the question on. Raises AcceptanceError where the robot cannot be
    simulated.
    """

    config: Config
    situation: Situation
    seed: int
    case: Case = field(init=False)
    scene: Scene = field(init=False)
    truth: Truth = field(init=False)
    phase: str = WATCH
    choices: tuple[Choice, ...] = ()
    answers: list[tuple[str, float]] = field(default_factory=list)
    outcome: Outcome | None = None
    facts: Facts = field(default_factory=Facts)
    _rng: np.random.Generator = field(init=False)
    _plan: list[tuple[float, Act]] = field(default_factory=list)
    _asked: float = math.inf
    _since: float = math.inf
    _until: float = math.inf
    _over: float = math.inf
    _first: frozenset[tuple[str, str]] = frozenset()
    _fell: bool = False
    _advice: Advice | None = None
    _left: float = 0.0
    _general: bool = False
    _halted: bool = False

    def __post_init__(self) -> None:
        name = self.situation.name
        self._rng = np.random.default_rng([self.seed, zlib.crc32(name.encode())])
        robot = self.config.settings.robot
        self.case = self.situation.draw(robot, self._rng)
        self.scene = Scene(DrillRobot(self.config, self.case.setup, self.seed), self.case.sensor)
        self.truth = self.robot.truth()
        self._schedule(self.case.course)

    @property
    def robot(self) -> DrillRobot:
        """The simulated robot and its monitor."""
        return self.scene.robot

    @property
    def answer(self) -> str | None:
        """The key of the last answer."""
        return self.answers[-1][0] if self.answers else None

    @property
    def left(self) -> float | None:
        """Seconds that are left for an answer; None while nothing is asked."""
        return max(self._until - self.robot.time, 0.0) if self.phase == ASK else None

    @property
    def asked_for(self) -> float:
        """Seconds since the question was asked; below 0 before."""
        return self.robot.time - self._asked

    def _schedule(self, acts: tuple[Act, ...]) -> None:
        self._plan += [(self.robot.time + act.at, act) for act in acts]
        self._plan.sort(key=lambda due: due[0])

    def advance(self, seconds: float) -> None:
        """Let so much simulated time (s) pass; nothing once it is judged."""
        self._left += seconds
        while self._left >= LOOK - 1e-9 and self.phase != JUDGED:
            self._left -= LOOK
            self._look()

    def _look(self) -> None:
        now = self.robot.time
        while self._plan and self._plan[0][0] <= now + 1e-9:
            self.scene.do(self._plan.pop(0)[1])
        self.truth = self.robot.look()
        if self.phase == WATCH:
            self._wait_for_trouble()
            return
        since = self.robot.time - self._asked
        if self.phase == ASK:
            self._renew()
        self.facts.take(self.truth, self.scene, since, answered=bool(self.answers))
        if self.phase == ASK and (self.robot.time >= self._until or self._failed()):
            self._act((), halt=False)
            if self._halted:
                self._until = self.robot.time + STANDS
        elif self.phase == ACTING and self.answer == ADVICE:
            self._follow()
        if self._is_over():
            self._judge()

    def _wait_for_trouble(self) -> None:
        """Ask once the trouble has lasted."""
        trouble, now = self.case.trouble, self.robot.time
        codes = {alert.rule.code for alert in self.robot.session.active}
        there = bool(codes & trouble.codes) if trouble.codes else has_tipped(self.truth)
        if not there or now < trouble.after:
            self._since = math.inf
        else:
            self._since = min(self._since, now)
        if now - self._since >= trouble.lasting - 1e-9 or now > _AT_LAST:
            self._ask()

    def _ask(self) -> None:
        robot, now = self.robot, self.robot.time
        self.phase, self._asked, self._until = ASK, now, now + self.case.patience
        self._fell = has_tipped(self.truth)
        active = robot.session.active
        self._first = frozenset((a.rule.code, a.rule.subject) for a in active)
        self._advice = self._computed()
        told = self._words()
        offered = [replace(c, words=told) if c.key == ADVICE else c for c in self.case.choices]
        order = self._rng.permutation(len(offered))
        self.choices = (*(offered[k] for k in order), *FREE)

    def _renew(self) -> None:
        """Offer what the monitor advises now: header and answers never differ."""
        newest = self._computed()
        if self._advice is None or newest is None or newest == self._advice:
            return
        self._advice = newest
        told = self._words()
        self.choices = tuple(replace(c, words=told) if c.key == ADVICE else c for c in self.choices)

    def _words(self) -> str:
        """Return what the monitor says is to be done now, as an answer."""
        said = str(self.robot.verdict.values.get('do', ''))
        words = self.case.advised_words or (said.partition(':')[0] if self._advice else said)
        return f'{words[:1].upper()}{words[1:]}'

    def _computed(self) -> Advice | None:
        """Return the advice of the verdict, if it was computed for this posture."""
        advice, said = self.robot.session.advisory.advice, self.robot.verdict.values.get('do')
        told = advice and advice[0].kind != 'stand_clear' and advice[0].sentence == said
        return advice[0] if told else None

    def choose(self, key: str) -> str:
        """Carry out the answer with a key; return its words. BadSample: not asked."""
        if self.phase != ASK:
            raise BadSample('choose: expected a question, there is none now')
        found = next((choice for choice in self.choices if choice.key == key), None)
        if found is None:
            keys = ', '.join(choice.key for choice in self.choices)
            raise BadSample(f'choice: expected one of {keys}, got {key!r:.40}')
        self.answers.append((key, round(self.robot.time - self._asked, 2)))
        if key == STOP:
            self._plan.clear()
            self._halted = True
            self._schedule(found.acts)
            self._until = self.robot.time + self.case.patience
        elif key == ADVICE:
            self._act(self._advised(), halt=True)
        else:
            self._act(found.acts, halt=found.halts)
        return found.words

    def _act(self, acts: tuple[Act, ...], *, halt: bool) -> None:
        """Carry out acts from now on, in place of the course of things if that is to `halt`."""
        if halt:
            self._plan.clear()
            self.scene.busy, self._halted = self.robot.time, True
        self._schedule(acts)
        self.phase, self._until = ACTING, self.robot.time + self.case.watched

    def _advised(self) -> tuple[Act, ...]:
        """Return what following the monitor means now: the advice that is shown."""
        return self.case.advised if self._advice is None else acts_of(self._advice)

    def _follow(self) -> None:
        """Go on as the monitor advises: by computed advice, and where none is left, by general."""
        idle = self.robot.time - self.scene.busy
        if self._plan or idle < AGAIN or self._end().over:
            return
        advice = self._computed()
        if advice is not None:
            self._schedule(acts_of(advice))
        elif idle > PATIENT and not self._general:
            self._general = True
            self._schedule(self.case.advised)

    def _failed(self) -> bool:
        """Return whether the robot tipped or gave in since the question: it is too late."""
        return not self._fell and math.isfinite(self._failed_at())

    def _failed_at(self) -> float:
        """Return when (s after the question) it did so; infinite: it did not."""
        ends = self.facts.tipped, self.facts.gave_in[1]
        return min((at for at in ends if not math.isnan(at)), default=math.inf)

    def _is_over(self) -> bool:
        """Return whether it is over: the robot failed, time is up, or all has become well."""
        now = self.robot.time
        if self._failed() and now - self._asked >= self._failed_at() + FALLS:
            return True
        if self.phase != ACTING:
            return False
        if now >= self._until:
            return True
        done = self._halted and not self._plan and now > self.scene.busy
        self._over = min(self._over, now) if done and not self._fault() else math.inf
        return now - self._over >= QUIET

    def _end(self) -> End:
        levels = {
            (a.rule.code, a.rule.subject) for a in self.robot.session.active if a.rule.level >= WARN
        }
        return End(self.truth, self.scene, not levels & self._first, self._fell)

    def _fault(self) -> str:
        return fault_of(self.case, self.facts, self._end())

    def _judge(self) -> None:
        self.phase = JUDGED
        fault = self._fault()
        happened = fault or success_of(self.facts, self._end())
        least = self.facts.least
        self.outcome = Outcome(
            self.situation.name,
            self.situation.title,
            self.seed,
            not fault,
            tuple(self.answers),
            f'{happened[:1].upper()}{happened[1:]}.',
            self._lesson(fault),
            math.degrees(least) if math.isfinite(least) else math.nan,
        )

    def _lesson(self, fault: str) -> str:
        if not fault:
            return self.case.lesson
        chosen = next((c for c in self.choices if c.key == self.answer), None)
        why = chosen.lesson if chosen else TOO_LATE
        if chosen and chosen.key == STOP:
            why = NOT_ENOUGH
        elif not why:
            why = TOO_LATE if self.answer == WAIT else ''
        return f'{why[:1].upper()}{why[1:]}. {self.case.lesson}' if why else self.case.lesson


def acts_of(advice: Advice) -> tuple[Act, ...]:
    """Return what following a piece of computed advice means."""
    if advice.kind == 'payload':
        return Act('stop'), Act('set_down', 2.0)
    if advice.kind == 'turn':
        length, way = abs(advice.amount) / TURN, math.copysign(TURN, advice.amount)
        return Act('stop'), Act('drive', 1.5, other=way), Act('drive', 1.5 + length)
    rate = abs(advice.amount) / max(advice.seconds, 0.1)
    return Act('stop'), Act('joint', 0.1, advice.subject, advice.amount, rate=rate)
