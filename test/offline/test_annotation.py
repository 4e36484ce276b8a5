"""What is said about a recording: as by a session that takes every message, one after another."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ugv_acceptance.bag.blocks import Message
from ugv_acceptance.bag.encode import inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.advice.search import advise
from ugv_acceptance.evaluation.ground import STAIRS, UNEVEN, Ground, GroundWindow
from ugv_acceptance.evaluation.inputs.timeouts import FOREVER
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.monitoring.footprint import TILTS
from ugv_acceptance.offline import stretches
from ugv_acceptance.offline.annotation import TYPES, Annotation
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.evaluation import Evaluation
from ugv_acceptance.offline.margins import margin_rows
from ugv_acceptance.offline.replayed_advice import AdviceBook
from ugv_acceptance.offline.replayed_session import Replay

BAGS = Path(__file__).parents[2] / 'bags'
GROUNDS = Ground(windows=(GroundWindow(STAIRS, 4.0, 9.0), GroundWindow(UNEVEN, 12.0, 20.0)))
# Stairs for so short that no look falls on them, just before a verdict.
SHORTLY = Ground(UNEVEN, windows=(GroundWindow(STAIRS, 4.988, 4.996),))
WORDS = list(TYPES)


class EveryRow(Replay):
    """A replay that leaves out no row."""

    def part(self, rows: MarginRows, moments: Sequence[int]) -> None:  # noqa: ARG002 - as its base
        """Begin the next part."""
        self._take_until(FOREVER)
        self._wait(rows, np.arange(len(rows.time)))


class EmptyBook(AdviceBook):
    """A book without advice, so that each is searched by itself."""

    def look_up(self, rows: MarginRows, times: Sequence[int]) -> None:  # noqa: ARG002 - as its base
        """Forget all advice."""
        self.found.clear()


def said(evaluation: Evaluation, *, by_message: bool = False) -> list[Message]:
    """Return all messages about a recording; `by_message`: from every row and moment by itself."""
    told = Annotation(evaluation)
    if by_message:
        loads = evaluation.judgement.measurement.payloads.at
        told._replay = EveryRow(told._session, loads)
        told._advice = EmptyBook(told.settings, loads, (), told._advice.found)
    return [message for block in told.said() for message in block.messages()]


def loaded(folder: Path) -> Path:
    """Return a copy of the run that fails with other loads, in chunks of half a second."""
    bag = open_bag(BAGS / 'packbot_fail')
    with BagWriter(folder) as writer:
        for name, topic in bag.topics.items():
            writer.add_topic(name, topic.type)
        link = load().settings.robot.payload_link or ''
        masses = enumerate((0.0, 3.0, 1.0, 5.0, 6.0, 4.5, 2.0))
        due = [(bag.start_ns + k * 2 * 10**9, mass) for k, mass in masses]
        for message in messages(bag, bag.topics.keys() - {'/payload'}):
            while due and message.log_time >= due[0][0]:
                now, mass = due.pop(0)
                writer.write('/payload', now, inertia_cdr(now, link, mass, (0.0, 0.0, 0.0)))
            writer.write(message.topic, message.log_time, message.data)
    return folder


def as_messages(found: list[Message], word: str) -> list[Message]:
    """Return the messages of one topic."""
    return [message for message in found if WORDS[message[2]] == word]


@pytest.mark.parametrize(
    ('name', 'how'),
    [
        ('packbot_fail', {}),
        ('packbot_gap', {}),
        ('packbot_fail', {'ground': GROUNDS}),
        ('packbot_fail', {'ground': SHORTLY}),
        ('loaded', {}),
    ],
)
def test_what_is_said_is_what_a_session_says_that_takes_every_message(
    tmp_path: Path, name: str, how: dict[str, Any]
) -> None:
    """Byte by byte, in its order: verdicts, alerts, drawings; on any ground, with any load."""
    run = loaded(tmp_path / 'run') if name == 'loaded' else BAGS / name
    evaluation = evaluate(open_recording(run), **how)
    found, wanted = said(evaluation), said(evaluation, by_message=True)
    assert found == wanted
    assert {WORDS[number] for _, _, number, _ in found} == set(WORDS)


def test_advice_is_that_of_its_own_moment(tmp_path: Path) -> None:
    """Searched for all moments of a part together, it is what a search of each finds."""
    evaluation = evaluate(open_recording(loaded(tmp_path / 'run')))
    judged = evaluation.judgement
    settings, loads = judged.settings, judged.measurement.payloads.at
    book = AdviceBook(settings, loads, judged.evaluator.watch.log)
    found, told = 0, set[str]()
    for rows in margin_rows(evaluation.recording.bag, judged.topics, settings):
        times = [int(rows.time[0]) - 1, *(rows.time[rows.known] + 1).tolist()[::40]]
        book.look_up(rows, times)
        assert book.found.keys() <= set(times)
        for time, advice in book.found.items():
            k = int(np.flatnonzero(rows.time <= time)[-1])
            load = loads(int(rows.pairs.joints.time[rows.pairs.of_joints[k]]))
            alone = advise(settings, rows.q[k].tolist(), rows.gravity[k].tolist(), load)
            assert [replace(a, gain=0.0) for a in advice] == [replace(a, gain=0.0) for a in alone]
            assert [a.gain for a in advice] == pytest.approx([a.gain for a in alone], rel=1e-9)
            found += 1
            told |= {a.sentence for a in advice}
    assert found > 50
    assert any('load' in sentence for sentence in told)


def test_what_is_said_does_not_depend_on_the_parts_that_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same messages of a recording read in one piece and in many, in order of log time."""
    evaluation = evaluate(open_recording(loaded(tmp_path / 'run')))
    found = []
    for length in (100, 10**6):
        monkeypatch.setattr(stretches, 'STRETCH', length)
        found.append(said(evaluation))
    assert found[0] == found[1]
    assert [m[0] for m in found[0]] == sorted(m[0] for m in found[0])


def test_margins_are_said_of_every_message_that_has_some() -> None:
    """Torque, torque left and tilt of each row, as single messages have them."""
    evaluation = evaluate(open_recording(BAGS / 'packbot_gap'))
    judged = evaluation.judgement
    settings, bag = judged.settings, evaluation.recording.bag
    joints, limits = settings.robot.joint_names, settings.limits.torque
    wanted: dict[str, list[bytes]] = {'static_torque': [], 'torque_margin': [], 'stability': []}
    for rows in margin_rows(bag, judged.topics, settings, detail=True):
        for k in np.flatnonzero(rows.known).tolist():
            stamp, q, torque = int(rows.stamp[k]), rows.q[k].tolist(), rows.torque[k].tolist()
            left = [limit - abs(tau) for limit, tau in zip(limits, torque, strict=True)]
            angle, moment = rows.angle[k].tolist(), rows.moment[k].tolist()
            for word, (names, at, held) in {
                'static_torque': (joints, q, torque),
                'torque_margin': (joints, q, left),
                'stability': (TILTS, angle, moment),
            }.items():
                wanted[word].append(joint_state_cdr(stamp, '', names, at, (), held))
    found = said(evaluation)
    assert len(wanted['stability']) > 4000
    for word, contents in wanted.items():
        assert [message[3] for message in as_messages(found, word)] == contents
    # Of one row after the other, not of one topic after the other.
    order = [WORDS[number] for _, _, number, _ in found if WORDS[number] in wanted]
    assert order == list(wanted) * len(wanted['stability'])
