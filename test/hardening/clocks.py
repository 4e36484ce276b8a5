"""Clocks that jump, stand still or are days off: what an evaluation says, and how soon."""

from collections.abc import Callable
from dataclasses import replace

from evaluation.streams import MS, STILL, T0, Carry, Imu, Joints, Message, S, give, run_of, settings
from hardening.outcome import Outcome

from ugv_acceptance.evaluation.live import LiveEvaluator

HOUR, DAY = 3600 * S, 86_400 * S
# When the clock goes wrong, and when all messages end (ns after the start).
WRONG, END = 5 * S, 15 * S

# What the header stamp of a message received at t (ns after the start) says, while wrong.
CLOCKS: dict[str, Callable[[int], int]] = {
    'an hour ahead': lambda t: T0 + t + HOUR,
    'an hour back': lambda t: T0 + t - HOUR,
    'frozen': lambda _: T0 + WRONG,
    'zero stamps': lambda _: 0,
    'nine days off': lambda t: T0 + t - 9 * DAY,
    'time restarts every 2 s': lambda t: T0 + t % (2 * S),
}


def wrong(message: Message, clock: Callable[[int], int]) -> Message:
    """Return a message with the stamp of a clock that goes wrong at WRONG."""
    t = message.time - T0
    if t < WRONG or isinstance(message, Carry):
        return message
    return replace(message, stamp=clock(t))


def _trembling(message: Message) -> Message:
    """Return a joint state as an encoder tells it: a repeated one would be no new message."""
    if not isinstance(message, Joints):
        return message
    return replace(message, position=(0.1 + 1e-6 * (message.time // MS % 97), 0.0))


def trial(name: str) -> tuple[float, float, bool]:
    """Return seconds to the CLOCK alert, from the last message to STALE, and margins throughout."""
    evaluator = LiveEvaluator(settings())
    evaluator.start(T0)
    known = True
    for message in run_of(END / S, 50.0, 100.0, imu=Imu(0, omega=STILL)):
        margins = give(evaluator, wrong(_trembling(message), CLOCKS[name]))
        known = known and (margins is not None or message.time < T0 + S)
    for k in range(200):
        evaluator.tick(T0 + END + k * 10 * MS)
    log = evaluator.watch.log
    clocks = [a.start for a in log if a.rule.code == 'CLOCK']
    stale = [a.start for a in log if a.rule.code == 'INPUT_STALE']
    told = (min(clocks) - T0 - WRONG) / S if clocks else float('inf')
    return told, (max(stale) - T0 - END) / S if len(stale) == 2 else float('inf'), known


def outcomes() -> list[Outcome]:
    """Try every clock."""
    found = []
    for name in CLOCKS:
        told, silent, known = trial(name)
        text = f'{name}: CLOCK after {told:.2f} s, STALE {silent:.2f} s after the last message'
        held = told <= 1.0 and -0.02 < silent <= 0.11 and known
        found.append(Outcome(text + ('' if known else ', margins were lost'), held))
    return found
