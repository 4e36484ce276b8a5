"""A recording played through a lossy relay over DDS: recorded on each lane, monitored on one."""

import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from hardening.outcome import Outcome
from hardening.relay import LANES, TOPICS, as_offered
from hardening.wire import Ears, child, line_of
from nodes.live_case import live_nodes, ros_context
from rclpy.node import Node

from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.type_aliases import Json

PLAYER = 'from ugv_acceptance.cli import main; main()'
MONITOR = 'from ugv_acceptance.nodes.monitor.node import main; main()'
# The lane on which the monitor listens: the last, on which everything goes wrong.
HEARD = len(LANES) - 1
Failures = set[tuple[str, str]]


class Recorder(Node):
    """Writes what comes on each lane, with its time of receipt, until it is closed."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        super().__init__('recorder')
        for k in range(len(LANES)):
            writer = stack.enter_context(BagWriter(folder / f'lane_{k}'))
            for topic, kind in TOPICS:
                name = f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
                writer.add_topic(f'/{topic}', name)
                take = self._taker(writer, f'/{topic}')
                place = f'/lane_{k}/{topic}'
                self.create_subscription(kind, place, take, as_offered(topic), raw=True)

    def _taker(self, writer: BagWriter, topic: str) -> Any:
        return lambda data: writer.write(topic, time.time_ns(), data)


def judged(path: Path) -> Json:
    """Return the result of a recording."""
    return evaluate(path).result


def failures(result: Json) -> Failures:
    """Return code and subject of every failure of the robot in a result."""
    found = [a for a in result['alerts'] if a['level'] == 'ERROR' and a['code'] in FAILURES]
    return {(a['code'], a['subject']) for a in found}


def played(recording: Path, folder: Path, seed: int) -> Failures:
    """Play a recording through the relay, record the lanes; return the failures that were told."""
    here = f'lane_{HEARD}'
    remaps = [w for t, _ in TOPICS for w in ('-r', f'/{t}:=/sent/{t}')]
    player = ('-c', PLAYER, 'replay', str(recording), '--restamp', '--ros-args', *remaps)
    with ExitStack() as stack:
        stack.enter_context(ros_context())
        live = stack.enter_context(live_nodes())
        live.add(Recorder(folder, stack))
        ears: Ears = live.add(Ears(here))
        relay = stack.enter_context(child('-m', 'hardening.relay', str(seed)))
        line_of(relay)
        monitor = ('-c', MONITOR, '--ros-args', '-r', f'__ns:=/{here}')
        stack.enter_context(child(*monitor))
        live.until(lambda: ears.verdicts)
        play = stack.enter_context(child(*player))
        while play.poll() is None:
            live.spin(0.5)
        live.spin(1.0)
        said = [h.values for h in ears.alerts if h.values['state'] == 'raised']
    return {
        (of['code'], of['subject'])
        for of in said
        if of['level'] == 'ERROR' and of['code'] in FAILURES
    }


def trial(recording: Path, folder: Path, seed: int = 0) -> list[Outcome]:
    """Judge each lane's recording beside the original, and the monitor beside its lane's."""
    whole, told = judged(recording), played(recording, folder, seed)
    lanes = [judged(folder / f'lane_{k}') for k in range(len(LANES))]
    found = []
    for way, result in zip(LANES, lanes, strict=True):
        gaps = sum(result['inputs'][name]['gaps'] for name in ('joint_states', 'imu'))
        share = result['coverage']['fraction']
        text = (
            f'{recording.name} ({whole["verdict"]}), {way}: {result["verdict"]}, '
            f'{share:.1%} covered, {gaps} gaps'
        )
        # What bursts took is not covered, and says so.
        marked = 'bursts' not in way or (gaps > 0 and share < lanes[0]['coverage']['fraction'])
        allowed = (whole['verdict'], 'INCONCLUSIVE' if any(LANES[way]) else whole['verdict'])
        found.append(Outcome(text, result['verdict'] in allowed and marked))
    same = told == failures(lanes[HEARD])
    text = f'{recording.name}, the monitor on the worst lane: {len(told)} failures told'
    return [*found, Outcome(f'{text}, those of its recording: {same}', same)]
