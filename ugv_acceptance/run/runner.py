"""Runs a plan step by step: set up, move, hold, record, and judge the step by its recording.

A step's recording begins before its set-up and ends after its action, so that it contains every
motion of the robot.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.config import Config
from ugv_acceptance.plan.arm_paths import safe_path
from ugv_acceptance.plan.plan import SIMULATION, Step, vector_of
from ugv_acceptance.plan.search import Arm
from ugv_acceptance.run.actuation import SIM, Hands
from ugv_acceptance.run.folder import RunFolder
from ugv_acceptance.run.motions import REFUSED, Moves, holds
from ugv_acceptance.run.step_verdict import INCONCLUSIVE, SKIPPED, Done, judge_step
from ugv_acceptance.run.world import ERROR, STALE, Brake, World, alert_words

# Longest wait (s) for alerts to end; time (s) recorded after a stop.
CALM, AFTER = 10.0, 1.0
# Times a step is tried that showed nothing because messages were missing.
ATTEMPTS = 5
# Unwanted in every motion between steps.
ALWAYS = (ERROR, STALE)
# Speed (rad/s) of motions to and from home.
HOME_SPEED = math.radians(35.0)


@dataclass(slots=True)
class Runner:
    """Carries out the steps of a plan one after the other; `asked()` says when to freeze and end.

    `over` is the reason why no further step can be done; empty: they can.
    """

    config: Config
    folder: RunFolder
    world: World
    hands: Hands
    asked: Callable[[], bool] = lambda: False
    attempts: int = ATTEMPTS
    over: str = ''
    _setup: Any = None
    _lying: bool = True
    _touched: bool = False
    moves: Moves = field(init=False)

    def __post_init__(self) -> None:
        tolerance = math.radians(self.folder.plan.tolerance_deg)
        self.moves = Moves(self.world, self.hands, tolerance, self.asked)
        self.hands.going = lambda: self.moves.going

    @property
    def brake(self) -> Brake:
        """The brake that freezes motion at an unexpected alert."""
        return self.world.brake

    def run(self, step: Step) -> dict[str, Any] | None:
        """Do one step, write its result and return it; None if the run was interrupted.

        A step that showed nothing because messages were missing is done again; the result says how
        often and why.
        """
        refused = self._refused(step)
        if refused:
            return self._finish(step, {'verdict': SKIPPED, 'reasons': [refused]}, [])
        earlier: list[dict[str, Any]] = []
        for number in range(self.attempts):
            self.folder.note('attempt', step=step.id, number=number + 1)
            result = self._alive() or self._attempt(step, number)
            if result is None:
                self.folder.note('interrupted', step=step.id)
                return None
            earlier.append(result)
            if result['verdict'] != INCONCLUSIVE or self.over or self.hands.refused:
                break
        return self._finish(step, earlier.pop(), earlier)

    def _refused(self, step: Step) -> str:
        if step.where == SIMULATION and self.hands.mode != SIM:
            return 'would exceed a limit: in simulation only'
        return ''

    def _finish(
        self, step: Step, result: dict[str, Any], earlier: list[dict[str, Any]]
    ) -> dict[str, Any]:
        self.hands.refused = False
        tried = [{'verdict': e['verdict'], 'reasons': e['reasons']} for e in earlier]
        result = {'id': step.id, 'title': step.title, 'alerts': [], **result, 'earlier': tried}
        self.folder.finish_step(step, result)
        self.folder.note('result', step=step.id, verdict=result['verdict'])
        return result

    def _attempt(self, step: Step, number: int) -> dict[str, Any] | None:
        recording = self.folder.recording(step, 'attempt' if number else 'interrupted')
        done, problem = None, ''
        self.world.record(recording)
        try:
            self.world.commands.declare(self._setup[1] if self._setup else 0.0)
            self.world.commands.may_touch(allowed=step.hand_may_touch or self._touched)
            problem = self._prepare(step)
            self._touched = step.hand_may_touch
            self.world.commands.may_touch(allowed=self._touched)
            done = None if problem else self._perform(step)
        finally:
            self.brake.disarm()
            self.world.stop_recording()
            self.world.commands.may_touch(allowed=False)
        if self.asked():
            self.brake.freeze()
            return None
        # After what cannot be held, or was stopped, the robot is set up from the start.
        self._lying = done is None or step.where == SIMULATION or bool(done.stopped or done.fault)
        if done is None:
            return {'verdict': INCONCLUSIVE, 'reasons': [problem]}
        try:
            return judge_step(step, recording, self.config, done)
        except AcceptanceError as error:
            return {'verdict': INCONCLUSIVE, 'reasons': [f'recording: {error}']}

    # Before a step

    def wait_for_all(self, seconds: float) -> None:
        """Wait up to `seconds` for robot and monitor. Raises BadConfig naming what is missing."""
        if not self.moves.until(lambda: not self.world.missing(), seconds) and not self.asked():
            raise BadConfig(f'expected {self.world.missing()} within {seconds:g} s, got nothing')

    def _alive(self) -> dict[str, Any] | None:
        """Return an INCONCLUSIVE result where the monitor is silent, None where it watches."""
        if self.moves.until(lambda: not self.world.dead(), CALM) or self.asked():
            return None
        self.over = 'the monitor publishes nothing'
        return {'verdict': INCONCLUSIVE, 'reasons': [self.over]}

    def _prepare(self, step: Step) -> str:
        """Bring the robot home and set it up where a step needs it; return what was wrong."""
        setup = (step.ground, step.payload_kg)
        # A step of the simulation begins at the start: no path home has to be safe.
        if self._lying or (step.where == SIMULATION and setup != self._setup):
            self._setup, self.moves.trail = None, []
            if not self.hands.stand_up():
                return REFUSED
            self._lying = False
        if setup != self._setup or self._touched:
            wrong = self._go_home()
            self.brake.disarm()
            if wrong:
                return f'on the way home: {wrong}'
            if setup != self._setup and not self.hands.set_up(step):
                return REFUSED
            self._setup = setup
        self.brake.unwanted = step.alerts.must_not
        self.world.wait(0.2)
        calm = self.moves.until(lambda: not self.brake.trouble, CALM)
        trouble = ', '.join(map(alert_words, self.brake.trouble))
        return '' if calm else f'active before the step began: {trouble}'

    def _go_home(self) -> str:
        """Go home, straight where that is safe, else back as it came; return what was wrong."""
        self.brake.arm(ALWAYS)
        home, paths = self.folder.plan.home_deg, self.moves.trail[-2::-1]
        robot = self.config.settings.robot
        if self.moves.trail and self._setup:
            arm = Arm(self.config.settings)
            straight = [np.array(vector_of(robot, home, p)) for p in (self.moves.trail[-1], home)]
            ground, load = self._setup
            slope = ground.orientation, math.radians(ground.tilt_deg)
            if safe_path(arm, straight, slope, load):
                paths = []
        for posture in (*paths, home):
            if wrong := self.moves.go(posture, HOME_SPEED):
                return wrong
        self.moves.trail = []
        return ''

    # A step

    def _perform(self, step: Step) -> Done:
        begin = hold = self.world.stamp()
        self.brake.arm(step.alerts.must_not)
        for alert in self.brake.trouble:
            self.brake.stop(f'{alert_words(alert)} is active', blind=alert[0] == STALE)
        speed = math.radians(step.speed_degps)
        sweeps = step.action == 'sweep'
        wrong = ''
        slow = min(speed, HOME_SPEED / 2.0) if sweeps else speed
        for posture in () if step.action == 'cycle' else step.via_deg:
            wrong = wrong or self.moves.go(posture, slow)
        if sweeps:
            self.moves.pause(0.5)
            hold = self.world.stamp()
        wrong = wrong or self.moves.go(step.posture_deg, speed, step)
        if not sweeps and not wrong:
            self.moves.pause(self._settle)
            hold = self.world.stamp()
        wrong = wrong or self._act(step)
        done = self._done(begin, hold, wrong if holds(step) else '')
        if self.brake.stopped:
            # The recording also shows that it stands still from now on.
            self.world.wait(AFTER)
        return done

    def _act(self, step: Step) -> str:
        """Do the action of a step: hold, drive, pull, cycle or wait; return what was wrong."""
        if step.action == 'drive' and step.drive is not None:
            self.hands.drive(step, step.drive[0], math.radians(step.drive[1]), step.hold_s)
        elif step.action == 'pull':
            self.hands.pull(step)
        elif step.action == 'cycle':
            return self.moves.cycle(step)
        elif holds(step):
            return self.moves.hold(step)
        else:
            self.moves.pause(step.hold_s)
        return ''

    def _done(self, begin: int, hold: int, wrong: str) -> Done:
        stopped = self.brake.stopped
        # Missing data neither passes nor fails.
        missing = self.world.dead() or self.brake.blind
        fault = REFUSED if self.hands.refused else stopped if missing else ''
        return Done(begin, hold, self.world.stamp(), wrong, '' if fault else stopped, fault)

    @property
    def _settle(self) -> float:
        """Seconds after which the alerts raised on the way to a posture have ended."""
        delays = self.config.settings.delays
        return max(delays.off, delays.tip_off) + max(delays.tip_on, delays.torque_on) + 0.2
