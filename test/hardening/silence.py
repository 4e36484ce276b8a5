"""Inputs that fall silent, never speak, or have two voices, over DDS: how soon that is said."""

import os
import signal
import statistics
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from hardening.outcome import Outcome
from hardening.robot import Task
from hardening.wire import NS, Ears, line_of, listening, monitor, robot, running, tell
from nodes.live_case import OK, STALE, WARN, Live

from ugv_acceptance.config import load

# The joints at 20 Hz, the IMU at 100 Hz: 3 periods, at least 0.1 s.
TASK = Task(joints_hz=20.0, imu_hz=100.0, listeners=2)
LIMITS = {'joint_states': 0.15, 'imu': 0.1}
TICK = 0.05
# What the trial itself adds (s): from stamping to receipt, and a tick that has to wait its turn.
WIRE = 0.02
# A publisher is looked for once a second, a name is told at the next look.
NAMED = 2.0
Process = subprocess.Popen[str]


def killed(process: Process) -> int:
    """Kill a driver; return when (ns)."""
    process.kill()
    process.wait()
    return time.time_ns()


def stopped(process: Process) -> int:
    """Stop a driver; return when (ns)."""
    os.kill(process.pid, signal.SIGSTOP)
    return time.time_ns()


# Way -> what ends the input, code and subjects of the alert.
ENDS: dict[str, tuple[Callable[[Process], int], str, tuple[str, ...]]] = {
    'killed': (killed, 'INPUT_STALE', ('joint_states', 'imu')),
    'SIGSTOP': (stopped, 'INPUT_STALE', ('joint_states', 'imu')),
    'half the joints': (lambda p: tell(p, 'half'), 'INPUT_INCOMPLETE', ('joint_states',)),
    'joints silent': (lambda p: tell(p, 'silent joints'), 'INPUT_STALE', ('joint_states',)),
    'IMU silent': (lambda p: tell(p, 'silent imu'), 'INPUT_STALE', ('imu',)),
}


def trial(way: str, times: int) -> Outcome:
    """End an input `times` times; take the time from its last message to what the monitor says."""
    late: dict[str, list[float]] = {subject: [] for subject in ENDS[way][2]}
    fine = 0
    with listening() as (live, ears), monitor():
        for _ in range(times):
            with robot(TASK) as process:
                running(live, ears)
                live.spin(2.0)  # a period is learnt from 32 messages
                # A busy machine's inputs are late at times: what is not there cannot end.
                live.until(lambda: not any(ears.open(ENDS[way][1], s) for s in late))
                silence(live, ears, process, way, late)
                fine += ears.verdicts[-1].level[0] < STALE
            ears.verdicts.clear()
    worst = {s: max(seconds) for s, seconds in late.items()}
    text = ', '.join(
        f'{s} {statistics.median(late[s]):.3f} s, at most {most:.3f} of {LIMITS[s] + TICK:.2f} s'
        for s, most in worst.items()
    )
    held = not fine and all(x <= LIMITS[s] + TICK + WIRE for s, x in worst.items())
    return Outcome(f'{way}, {times} times: said after {text}; {fine} times OK then', held)


def silence(
    live: Live, ears: Ears, process: Process, way: str, late: dict[str, list[float]]
) -> None:
    """End an input once, and add the seconds until it was said of each subject."""
    end, code, subjects = ENDS[way]
    told = end(process)
    live.until(lambda: all(ears.open(code, s) for s in subjects))
    live.spin(0.2)  # the verdict follows
    for subject in subjects:
        said = ears.open(code, subject)
        assert said is not None
        # Half a message is a message: there the time of the order counts, which is earlier.
        last = told if code == 'INPUT_INCOMPLETE' else ears.last[subject]
        late[subject].append((said.heard - last) / NS)


def absent(kind: str, seconds: float = 4.0) -> Outcome:
    """Let an input never speak: `mute`, `silent joints` or `silent imu`."""
    task = Task(faults=((0.0, 1e6, kind),))
    with listening() as (live, ears), monitor(), robot(task):
        # Verdicts are latched: the alert may have been raised before anybody listened.
        live.until(lambda: any('no message from' in v.message for v in ears.verdicts))
        live.spin(seconds)
        levels = {verdict.level[0] for verdict in ears.verdicts}
    text = f'{kind}, from the start: {len(ears.verdicts)} verdicts, all STALE: {levels == {STALE}}'
    return Outcome(text, levels == {STALE})


def mismatched(folder: Path) -> Outcome:
    """Offer best effort to a monitor that asks for reliable."""
    source = Path(load().path)
    text = source.read_text('utf-8').replace('../urdf', str(source.parents[1] / 'urdf'))
    config = folder / 'reliable.yaml'
    config.write_text(text.replace('reliability: best_effort', 'reliability: reliable'), 'utf-8')
    with listening() as (live, ears), monitor(config=config):
        live.until(lambda: ears.verdicts)
        with robot(Task(reliable=False)) as process:
            began = int(line_of(process).split()[1])
            live.until(lambda: all(ears.first('raised', 'INPUT_QOS', s) for s in LIMITS))
            live.spin(2.0)
        levels = {verdict.level[0] for verdict in ears.verdicts}
        late = max(h.time for h in ears.alerts if h.says('raised', 'INPUT_QOS')) - began
    text = f'mismatched QoS: named on both inputs after {late / NS:.2f} s, never OK'
    return Outcome(text, not levels & {OK, WARN})


def strangers(times: int) -> Outcome:
    """Start a second publisher `times` times; take the time until both inputs name it.

    It counts from when DDS has joined it to the monitor: no message of it can come before.
    """
    with listening(inputs=False) as (live, ears), monitor(), robot(Task()):
        running(live, ears)
        found = [stranger(live, ears, f'stranger_{k}') for k in range(times)]
    joining, late = zip(*found, strict=True)
    text = (
        f'{times} times: named on both inputs after {statistics.median(late):.2f} s, at most '
        f'{max(late):.2f} s after DDS joined it to the monitor, for which DDS took up to '
        f'{max(joining):.2f} s'
    )
    return Outcome(text, max(late) <= NAMED)


def stranger(live: Live, ears: Ears, name: str) -> tuple[float, float]:
    """Start a second publisher and end it; return the seconds until it was joined, then named."""
    ears.alerts.clear()
    with robot(Task(name=name, faults=((0.0, 1e6, 'mute'),), listeners=1)) as process:
        began, joined = (int(line_of(process).split()[1]) for _ in range(2))
        live.until(lambda: len(naming(ears, name)) >= len(LIMITS))
        late = (max(naming(ears, name)) - joined) / NS
        # A publisher that is killed stays in the graph for 20 s.
        tell(process, 'end')
        process.wait()
    live.until(lambda: sum(h.says('cleared', 'SECOND_PUBLISHER') for h in ears.alerts) > 1)
    return (joined - began) / NS, late


def naming(ears: Ears, name: str) -> list[int]:
    """Return when (ns) the second publisher was told with its name."""
    said = [h for h in ears.alerts if h.says('raised', 'SECOND_PUBLISHER')]
    return [h.time for h in said if f'/{name}' in h.message]
