"""An answer that takes a while: page and terminal go on, and show it when it comes."""

import asyncio
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from console.test_terminal import Robot, screen, use
from textual.pilot import Pilot

from ugv_acceptance.cli.watch import recording_feed
from ugv_acceptance.config import load
from ugv_acceptance.console.hub import Hub
from ugv_acceptance.console.snapshot import Awaited, Snapshot
from ugv_acceptance.console.terminal import Terminal

BAG = Path(__file__).parents[2] / 'bags' / 'packbot_fail'
# Frames after which the answer comes: in sum longer than a page may stand still.
FRAMES = 12


@dataclass
class Slow(Robot):
    """A live robot whose monitor answers a command some snapshots later."""

    shown: int = 0

    def snapshot(self) -> Snapshot:
        """Count it."""
        self.shown += 1
        return super().snapshot()

    def command(self, do: str, values: dict[str, Any]) -> Awaited:  # type: ignore[override]
        """Return what gives the answer later; to reset is refused, later too."""
        due = self.shown + FRAMES

        def said() -> str | None:
            return None if self.shown < due else Robot.command(self, do, values)

        return said


@pytest.fixture(scope='module')
def robot() -> Slow:
    """Return it, as a recording that stands still."""
    recording = recording_feed(BAG, load())
    recording.command('pause', {})
    recording.command('seek', {'to_s': 26.0})
    return Slow(recording)


def said_to_page(robot: Slow, *commands: str) -> list[dict[str, Any]]:
    """Return what a page is sent from its commands to the last of their answers."""
    hub, sent, answered = Hub(robot), list[dict[str, Any]](), asyncio.Event()

    async def send(text: str) -> None:
        sent.append(json.loads(text))
        if sum(message['kind'] == 'answer' for message in sent) == len(commands):
            answered.set()

    async def run() -> None:
        client = hub.join()
        tasks = [asyncio.create_task(hub.run()), asyncio.create_task(hub.serve(client, send))]
        for number, do in enumerate(commands):
            hub.ask(client, json.dumps({'do': do, 'number': number}))
        await answered.wait()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(asyncio.wait_for(run(), 60.0))
    return sent


def test_a_page_gets_frames_until_its_command_is_answered(robot: Slow) -> None:
    """Each command is answered under its number, done or refused, when its answer is there."""
    sent = said_to_page(robot, 'acknowledge', 'reset')
    kinds = [message['kind'] for message in sent]
    assert kinds[: kinds.index('answer')].count('frame') >= FRAMES // 2
    answers = [message for message in sent if message['kind'] == 'answer']
    assert [(a['number'], a['ok']) for a in answers] == [(0, True), (1, False)]
    assert answers[0]['text'] == 'done: acknowledge'
    assert answers[1]['text'].startswith('refused: reset')


def test_only_so_many_commands_wait_for_an_answer(robot: Slow) -> None:
    """More are refused at once, and all are answered."""
    sent = said_to_page(robot, *['acknowledge'] * 20)
    assert all(message['ok'] for message in sent if message['kind'] == 'answer')
    hub = Hub(robot)
    clients = [hub.join() for _ in range(4)]
    for client in clients * 20:
        hub.ask(client, json.dumps({'do': 'acknowledge'}))
    texts = [text for client in clients for text in client.answers if 'answer' in text]
    assert len([text for text in texts if 'try again' in text]) == 16


def test_a_terminal_is_drawn_until_its_command_is_answered(robot: Slow) -> None:
    """The line of answers changes when the answer comes; the robot is shown all the time."""
    app = Terminal(robot, who='Ada')

    async def look(pilot: Pilot[None]) -> None:
        before = robot.shown
        await pilot.press('a')
        await pilot.press('enter')
        while 'done: acknowledge' not in screen(app):
            await pilot.pause(0.02)
        assert robot.shown - before >= FRAMES
        assert not app.note

    use(app, look)


def test_a_late_refusal_is_told_in_the_terminal(robot: Slow) -> None:
    """As one that comes at once."""
    app = Terminal(robot)

    async def look(pilot: Pilot[None]) -> None:
        app._command('reset', {})
        assert 'refused' not in app.said
        while not app.said:
            await pilot.pause(0.02)
        assert app.said.startswith('refused: reset')

    use(app, look)
