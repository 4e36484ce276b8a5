"""Minutes of real time over DDS: every overload alerted, nothing else critical, nothing lost."""

import json
import time
from random import Random
from statistics import median

from hardening.outcome import Outcome
from hardening.robot import Sent, Task
from hardening.wire import NS, Ears, Heard, line_of, listening, memory_of, monitor, robot

from ugv_acceptance.evaluation.alerts.rules import FAILURES

JOINTS_HZ, IMU_HZ = 200.0, 400.0
# What goes wrong -> how long (s). A jolt is shorter than the delay of a torque alert.
KINDS = {
    'overload': 2.0, 'jolt': 0.04, 'nan': 0.5, 'silent imu': 0.6, 'silent joints': 0.6,
    'clock': 1.0, 'garbage': 0.2, 'half': 0.6,
}  # fmt: skip
# Seconds between faults, until the first, and from an overload to its alert.
EVERY, FIRST, SOON = 5.0, 3.0, 0.3
# Seconds after which the monitor's memory is what it will be, or this share of the trial.
WARM, SHARE = 30.0, 0.25


def planned(seconds: float, seed: int) -> tuple[tuple[float, float, str], ...]:
    """Return (start, end, kind) in s, one every few seconds; the first is an overload."""
    rng, found = Random(seed), []
    for k in range(int((seconds - FIRST) / EVERY)):
        kind = rng.choice(list(KINDS)) if k else 'overload'
        start = FIRST + k * EVERY + rng.random()
        found.append((start, start + KINDS[kind], kind))
    return tuple(found)


def trial(
    seconds: float,
    seed: int = 0,
    rates: tuple[float, float] = (JOINTS_HZ, IMU_HZ),
    soon: float = SOON,
) -> Outcome:
    """Send both inputs for so long to a monitor, and judge its alerts, counts and memory."""
    faults = planned(seconds, seed)
    task = Task('load', *rates, seconds, faults, listeners=2)
    with listening() as (live, ears), monitor() as watcher:
        live.until(lambda: ears.verdicts)
        with robot(task) as load:
            line_of(load), line_of(load)
            memory, end = [], time.monotonic() + seconds
            while time.monotonic() < end:
                live.spin(min(2.0, seconds / 10))
                memory.append(memory_of(watcher))
            live.until(lambda: load.poll() is not None)
            sent = Sent(**json.loads(line_of(load)))
        live.until(lambda: counted(ears) >= sent.joints + sent.imu or late(sent))
        settled = round(len(memory) * max(SHARE, min(WARM / seconds, 0.5)))
        drift = median(memory[-settled:]) - memory[settled - 1]
        return judged(task, sent, ears, drift, soon)


def late(sent: Sent) -> bool:
    """Return whether counts that were published after the last message must have come."""
    return time.time_ns() > sent.ended + 30 * NS


def counted(ears: Ears) -> int:
    """Return how many messages of both inputs the monitor says it took, whole or malformed."""
    told = [ears.of_input(name) for name in ('joint_states', 'imu')]
    return sum(int(of.get('messages', 0)) + int(of.get('malformed', 0)) for of in told)


def judged(task: Task, sent: Sent, ears: Ears, drift: float, soon: float) -> Outcome:
    """Hold each overload to one critical alert soon after, and each of those to an overload."""
    begun = [when for kind, when in sent.began if kind == 'overload']
    raised = [heard for heard in ears.alerts if critical(heard)]
    starts = [int(heard.values['start_ns']) for heard in raised]
    due = [[t for t in starts if when <= t <= when + soon * NS] for when in begun]
    missed = sum(not found for found in due)
    false = len(starts) - sum(map(len, due))
    lost = sent.joints + sent.imu - counted(ears)
    text = (
        f'{task.seconds:.0f} s at {task.joints_hz:.0f} + {task.imu_hz:.0f} Hz, '
        f'{len(sent.began)} changes, '
        f'{len(begun)} overloads: {missed} missed, {false} false, {lost} of '
        f'{sent.joints + sent.imu} messages lost, {drift:+.1f} MB'
    )
    held = bool(begun) and not missed and not false and not lost and drift < 5.0
    return Outcome(text, held)


def critical(heard: Heard) -> bool:
    """Return whether the robot is said to fail."""
    of = heard.values
    return of['state'] == 'raised' and of['level'] == 'ERROR' and of['code'] in FAILURES
