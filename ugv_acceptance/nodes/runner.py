"""A plan run over DDS: step by step set up, move, hold, record; judged from the recording."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from rclpy.experimental.events_executor import EventsExecutor
from rclpy.task import Future

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config
from ugv_acceptance.nodes.guard import Guard
from ugv_acceptance.nodes.hands import OPERATOR, SIM, Hands
from ugv_acceptance.nodes.running import PATIENCE, Stop
from ugv_acceptance.plan.plan import SIMULATION, Posture, Step, radians_of
from ugv_acceptance.run.folder import RunFolder
from ugv_acceptance.run.verdicts import INCONCLUSIVE, SKIPPED, Done, judge_step

# Seconds: between two looks, for a motion beyond its time, for a person, for alerts to be over.
LOOK, GRACE, PERSON, CALM = 0.02, 3.0, 600.0, 6.0
# Times a step is tried.
ATTEMPTS = 3
# Unwanted in every motion between steps.
ALWAYS = ('ERROR', 'STALE')
# Speed (rad/s) of motions to and from home.
HOME_SPEED = math.radians(35.0)


@dataclass(slots=True)
class Runner:
    """Does the steps of a plan one after the other; `stop.asked` freezes and ends it."""

    config: Config
    folder: RunFolder
    guard: Guard
    hands: Hands
    stop: Stop
    _setup: Any = None
    _lying: bool = True

    def __post_init__(self) -> None:
        self.hands.wait = self.pause

    @property
    def going(self) -> bool:
        """Whether nothing has stopped the step in hand."""
        return not (self.stop.asked or self.guard.watched.stopped)

    def run(self, step: Step) -> dict[str, Any] | None:
        """Do one step and return its result, which is written; None if the run was interrupted.

        A step that showed nothing because messages were missing is done again, once.
        """
        refused = self._refused(step)
        if refused:
            return self._finish(step, {'verdict': SKIPPED, 'reasons': [refused]})
        result: dict[str, Any] | None = None
        for _ in range(ATTEMPTS):
            result = self._attempt(step)
            if result is None or result['verdict'] != INCONCLUSIVE or self.guard.watched.dead:
                break
        return None if result is None else self._finish(step, result)

    def _attempt(self, step: Step) -> dict[str, Any] | None:
        try:
            problem = self._prepare(step)
            if problem:
                self._lying = True
                return None if self.stop.asked else {'verdict': INCONCLUSIVE, 'reasons': [problem]}
            recording = self.folder.recording(step)
            self.guard.record(recording)
            self.hands.declare(step.payload_kg)
            self.pause(0.3)
            done = self._perform(step)
        finally:
            self.guard.disarm()
            self.guard.stop_recording()
        if self.stop.asked:
            self.guard.freeze()
            return None
        # After what cannot be held, or was stopped, the robot is set up from the start.
        self._lying = step.where == SIMULATION or bool(done.stopped or done.fault)
        return judge_step(step, recording, self.config, done)

    def _refused(self, step: Step) -> str:
        if step.action == 'pull' and self.hands.mode == SIM:
            return 'needs a person who pulls'
        if step.where == SIMULATION and self.hands.mode != SIM:
            return 'would pass a limit: in simulation only'
        return ''

    def _finish(self, step: Step, result: dict[str, Any]) -> dict[str, Any]:
        result = {'id': step.id, 'title': step.title, 'alerts': [], **result}
        self.folder.finish_step(step, result)
        return result

    # Before a step

    def wait_for_all(self, seconds: float) -> None:
        """Wait until robot and monitor are there; BadConfig says which of them was not."""
        there = self._until(lambda: bool(self.guard.position) and self.guard.heard > 0.0, seconds)
        if not there and not self.stop.asked:
            missing = 'the monitor' if self.guard.position else 'joint states of the robot'
            raise BadConfig(f'expected {missing} within {seconds:g} s, got nothing')

    def _prepare(self, step: Step) -> str:
        """Bring the robot home and set it up where anything changes; return what was wrong."""
        setup = (step.ground, step.payload_kg)
        if self._lying:
            self.guard.disarm()
            self.hands.stand_up()
            self._setup, self._lying = None, False
        if setup != self._setup:
            if not self._go(self.folder.plan.home_deg, HOME_SPEED, ALWAYS):
                return self._why('home was not reached')
            self.guard.disarm()
            self.hands.set_up(step)
            self._setup = setup
        self.guard.watched.unwanted = step.alerts.must_not
        calm = self._until(
            lambda: (
                not self.guard.watched.dead and not any(map(self.guard.unwanted, self.guard.active))
            ),
            CALM,
        )
        return '' if calm else self._why('not started: ' + self._trouble())

    def _trouble(self) -> str:
        if self.guard.watched.dead:
            return 'the monitor says nothing'
        active = [' '.join(a) for a in self.guard.active if self.guard.unwanted(a)]
        return f'active before it began: {", ".join(active)}'

    def _why(self, text: str) -> str:
        return self.guard.watched.stopped or text

    # A step

    def _perform(self, step: Step) -> Done:
        begin = time.time_ns()
        self.guard.arm(step.alerts.must_not)
        speed = math.radians(step.speed_degps)
        via = () if step.action == 'cycle' else step.via_deg
        slow = speed if step.action != 'sweep' else min(speed, HOME_SPEED / 2.0)
        for posture in via:
            if not self._go(posture, slow, step.alerts.must_not, step):
                return self._done(begin, time.time_ns(), reached=False)
        if step.action == 'sweep':
            self.pause(0.5)
            hold = time.time_ns()
            reached = self._go(step.posture_deg, speed, step.alerts.must_not, step)
        else:
            reached = self._go(step.posture_deg, speed, step.alerts.must_not, step)
            self.pause(self._settle)
            hold = time.time_ns()
        self._act(step)
        return self._done(begin, hold, reached=reached or not _holds(step))

    def _act(self, step: Step) -> None:
        if step.action == 'drive' and step.drive is not None:
            forward, yaw = step.drive[0], math.radians(step.drive[1])
            self.hands.drive(forward, yaw, step.hold_s, lambda: self.going)
        elif step.action == 'pull':
            self.hands.ask(f'{step.id}: pull with {step.force_n:g} N, then let go')
        elif step.action == 'cycle':
            end = time.monotonic() + step.hold_s
            while time.monotonic() < end and self.going:
                for posture in step.via_deg:
                    speed = math.radians(step.speed_degps)
                    if not self._go(posture, speed, step.alerts.must_not, step):
                        return
                    self.pause(min(1.0, max(end - time.monotonic(), 0.0)))
        else:
            self.pause(step.hold_s)

    def _done(self, begin: int, hold: int, *, reached: bool) -> Done:
        stopped = self.guard.watched.stopped
        # Missing data neither passes nor fails.
        missing = self.guard.watched.dead or stopped.startswith('STALE')
        fault = stopped if missing else ''
        return Done(begin, hold, time.time_ns(), reached, '' if fault else stopped, fault)

    @property
    def _settle(self) -> float:
        """Seconds after which alerts of the way are over."""
        delays = self.config.settings.delays
        return max(delays.off, delays.tip_off) + max(delays.tip_on, delays.torque_on) + 0.2

    def _go(
        self, posture: Posture, speed: float, unwanted: tuple[str, ...], step: Step | None = None
    ) -> bool:
        """Move to a posture (deg) and return whether it was reached."""
        if not self.guard.watched.armed:
            self.guard.arm(unwanted)
        if not self.going:
            return False
        target = radians_of(posture)
        seconds = self.hands.move(target, speed, step)
        if step is not None and not _holds(step):
            self.pause(seconds if self.hands.mode != OPERATOR else 0.0)
            return self.going
        limit = PERSON if self.hands.mode == OPERATOR else seconds + GRACE
        if math.isfinite(seconds):
            self.pause(0.9 * seconds)
        return self._until(lambda: self._there(target) or not self.going, limit) and self.going

    def _there(self, target: dict[str, float]) -> bool:
        tolerance = math.radians(self.folder.plan.tolerance_deg)
        now = self.guard.position
        return all(
            abs(now.get(name, math.inf) - angle) <= tolerance for name, angle in target.items()
        )

    def _until(self, condition: Callable[[], bool], seconds: float) -> bool:
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end or self.stop.asked:
                return False
            time.sleep(LOOK)
        return True

    def pause(self, seconds: float) -> None:
        """Let seconds pass, fewer when something stops the step in hand."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and self.going:
            time.sleep(LOOK)


def _holds(step: Step) -> bool:
    """Return whether the posture of a step can be held: the robot stands, the motors bear it."""
    return (
        step.action != 'tip'
        and step.expected.get('use', 0.0) < 0.995
        and (step.expected.get('tilt_left_deg', 90.0) > 0.0)
    )


@contextmanager
def spinning(guard: Guard) -> Iterator[None]:
    """Take messages on a thread of its own, so that recording and brake wait for nobody."""
    executor, over = EventsExecutor(), threading.Event()
    executor.add_node(guard)
    never: Future = Future()

    def spin() -> None:
        while not over.is_set():
            executor.spin_until_future_complete(never, timeout_sec=PATIENCE)

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        executor.remove_node(guard)
        executor.shutdown()
