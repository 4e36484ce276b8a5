"""A day of simulated time with faults sprinkled over it: no critical alert missed, none false."""

import math
from bisect import bisect_right
from dataclasses import replace
from random import Random

from evaluation.streams import T0, Imu, Joints, Message, S, give, settings, tilted, upright
from hardening.outcome import Outcome, memory

from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.monitoring.alarm_tracker import AlarmTracker

HZ = 50
STEP = S // HZ
# Arm raised; arm level and its slide out: 49 N m of 45.
CALM, REACH = Joints(0, position=(-1.3, 0.0)), Joints(0, position=(0.1, 0.4))
LEAN = tilted(0.05)
STILL = Imu(0, LEAN, acceleration=upright(LEAN))
# What goes wrong -> how long (s). A jolt is shorter than the delay of a torque alert.
KINDS = {
    'overload': 3.0, 'jolt': 0.04, 'nan': 1.0, 'silent imu': 1.5, 'silent joints': 1.5,
    'clock': 2.0, 'garbage': 1.0, 'duplicates': 1.0,
}  # fmt: skip


def events(seconds: int, seed: int, every: int = 60) -> list[tuple[int, int, str]]:
    """Return (start, end, kind) in ns, one in each stretch of `every` seconds."""
    rng, found = Random(seed), []
    for first in range(every // 2, seconds - every // 2, every):
        start = T0 + first * S + rng.randrange(0, every // 3 * HZ) * STEP
        kind = rng.choice(list(KINDS))
        found.append((start, start + int(KINDS[kind] * S), kind))
    return found


def told(now: int, kind: str) -> list[Message]:
    """Return the two messages received at `now` while `kind` ('' for nothing) goes wrong."""
    joints, imu = replace(CALM, time=now), replace(STILL, time=now + 1_000_000)
    if kind in ('overload', 'jolt'):
        joints = replace(REACH, time=now)
    if kind == 'nan':
        joints = replace(joints, position=(math.nan, 0.0))
    if kind == 'garbage':
        imu = replace(imu, orientation=(1e308,) * 4, acceleration=(math.inf, 0.0, 0.0))
    if kind == 'clock':
        joints, imu = replace(joints, stamp=0), replace(imu, stamp=now + 3600 * S)
    found: list[Message] = [joints, imu]
    if kind == 'silent imu':
        return found[:1]
    if kind == 'silent joints':
        return found[1:]
    return found * 2 if kind == 'duplicates' else found


def trial(seconds: int, seed: int = 0) -> Outcome:
    """Evaluate `seconds` of both inputs at 50 Hz as the monitor does, and judge its alerts."""
    evaluator, planned = LiveEvaluator(settings()), events(seconds, seed)
    evaluator.start(T0)
    alarm_tracker = AlarmTracker(evaluator.watch.log)
    starts, raised = [start for start, _, _ in planned], dict[int, Alert]()
    begun = memory()
    for k in range(seconds * HZ):
        now = T0 + k * STEP
        which = bisect_right(starts, now) - 1
        kind = planned[which][2] if which >= 0 and now < planned[which][1] else ''
        for message in told(now, kind):
            give(evaluator, message)
        if k % 5 == 0:
            evaluator.tick(now + STEP // 2)
            raised |= (
                {id(a): a for a in alarm_tracker.log if critical(a)}
                if alarm_tracker.changed()
                else {}
            )
            alarm_tracker.take()
        if k == seconds * HZ // 10:
            begun = memory()
    return judged(planned, list(raised.values()), memory() - begun, seconds)


def critical(alert: Alert) -> bool:
    """Return whether an alert says that the robot fails."""
    return alert.rule.code in FAILURES and alert.rule.level == ERROR


def judged(
    planned: list[tuple[int, int, str]], raised: list[Alert], drift: float, seconds: int
) -> Outcome:
    """Hold each overload to one alert within 0.3 s and each alert to an overload."""
    loads = [start for start, _, kind in planned if kind == 'overload']
    seen = sorted(a.start for a in raised)
    due = {start: [t for t in seen if start <= t <= start + 3 * S // 10] for start in loads}
    missed = sum(not found for found in due.values())
    false = len(seen) - sum(map(len, due.values()))
    text = (
        f'{seconds / 3600:.2f} h, {2 * HZ * seconds} messages, {len(planned)} faults, '
        f'{len(loads)} overloads: {missed} missed, {false} false, {drift:+.1f} MB'
    )
    return Outcome(text, bool(loads) and not missed and not false and drift < 5.0)
