"""What an operator does at a console: commands to the monitor, and the load that is in force."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import InertiaStamped
from rclpy.node import Node

from ugv_acceptance import BadSample
from ugv_acceptance.config import Config
from ugv_acceptance.console.alert_list import AlertBook
from ugv_acceptance.console.hub import number_in
from ugv_acceptance.console.monitor_values import load_of, same_load
from ugv_acceptance.console.snapshot import AlertRow, Awaited
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS
from ugv_acceptance.model.robot import Vector
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.operator_commands import DOINGS, SHELVED
from ugv_acceptance.nodes.monitor.operator_desk import HAND, load_message
from ugv_acceptance.nodes.monitor.subscriptions import qos_of
from ugv_acceptance.nodes.operator_client import Answer, Command, OperatorClient

# Seconds for the monitor to answer a command: on a busy robot it may look for the sender's name for
# one of them. Page and terminal go on meanwhile.
ANSWER_WITHIN = 5.0
# Seconds after which the verdict's payload is newer than one that was told.
SETTLED = 1.5


class ConsoleOperator:
    """Sends the commands of page or terminal, with name and note, and returns the answers."""

    def __init__(self, node: Node, config: Config, session: Session, book: AlertBook) -> None:
        self._node, self._topic = node, config.topics.payload
        self._session, self._book = session, book
        self._client = OperatorClient(node)
        self._load: InertiaStamped | None = None
        self._load_out: Any = None
        self._declared = -math.inf

    def command(self, do: str, values: dict[str, Any]) -> Awaited:
        """Ask the monitor for what an operator wants; return what gives its answer in a moment.

        Alerts are named by `key` or `keys`, of which those are taken that offer the command; with
        neither all are meant. Raises BadSample, as what is returned does if it was refused or is
        not answered.
        """
        if do == 'payload':
            return self._declare(values)
        if do == 'ground':
            return self._ask(do, values, {'kind': str(values.get('kind'))})
        if do == 'hand':
            allowed = 'true' if values.get('allowed') is True else 'false'
            return self._ask(HAND, values, {'allowed': allowed})
        if do not in DOINGS:
            raise BadSample(f'a live robot cannot do {do!r:.80}')
        if values.get('key') is None and values.get('keys') is None:
            return self._ask(do, values)
        seconds = number_in(values, 'for_s') if 'for_s' in values else SHELVED
        return self._ask(
            do, values, *({**row, 'seconds': seconds} for row in self._rows(do, values))
        )

    def _rows(self, do: str, values: dict[str, Any]) -> list[dict[str, object]]:
        """Return the alerts a command names: that of a key, or those of keys that offer it."""
        keys = values.get('keys')
        if keys is not None and not isinstance(keys, list):
            raise BadSample(f'keys: expected a list, got {keys!r:.80}')
        rows = [self._book.row(values['key'])] if keys is None else self._offering(do, keys)
        return [
            {'code': row.code, 'subject': row.subject, 'level': LEVELS[row.level]} for row in rows
        ]

    def _offering(self, do: str, keys: list[object]) -> list[AlertRow]:
        known = self._book.rows
        rows = [known[key] for key in map(str, keys) if key in known and do in known[key].offers]
        if not rows:
            raise BadSample(f'{do}: no alert of this card offers that now')
        return rows

    def _ask(self, do: str, values: dict[str, Any], *each: Mapping[str, object]) -> Awaited:
        """Send a command for each of these values; return what gives the monitor's answers."""
        if not self._client.heard:
            raise BadSample(f'{do}: no monitor hears it ({self._client.where()})')
        who, note = str(values.get('by') or 'console')[:40], str(values.get('note') or '')[:200]
        return partial(
            _said,
            [
                self._client.send(Command(do, who, note, more), ANSWER_WITHIN)
                for more in each or ({},)
            ],
        )

    def _declare(self, values: dict[str, Any]) -> Awaited:
        cog = values.get('cog_m')
        if not isinstance(cog, list) or len(cog) != 3:
            raise BadSample(f'cog_m: expected three numbers, got {cog!r:.80}')
        numbers = dict(zip('xyz', cog, strict=True))
        mass = number_in(values, 'mass_kg')
        x, y, z = (number_in(numbers, k) for k in 'xyz')
        told = {'mass_kg': repr(mass), 'cog_m': f'{x!r},{y!r},{z!r}'}
        answer = self._ask('payload', values, told)

        def said() -> str | None:
            text = answer()
            if text is not None:
                self._carry(mass, (x, y, z))
            return text

        return said

    def _carry(self, mass: float, cog: Vector) -> None:
        """Say a load on its topic from now on, for recorders and other consoles."""
        if self._load_out is None:
            self._load_out = self._node.create_publisher(
                InertiaStamped, self._topic.name, qos_of(self._topic, self._topic.depth)
            )
        self._load = load_message(self._session.settings.robot.payload_link or '', mass, cog)
        self._declared = time.monotonic()
        self.say_load()

    def say_load(self) -> None:
        """Publish the declared load, each second, so that a late subscriber receives it too."""
        if self._load is not None:
            self._load.header.stamp = self._node.get_clock().now().to_msg()
            self._load_out.publish(self._load)

    def follow_load(self, said: Mapping[str, str]) -> None:
        """Take the load that is in force at the monitor by its verdict, whoever told it how."""
        told, now, evaluator = load_of(said), self._session.clock.now(), self._session.evaluator
        since = self._session.counts['payload'].last if self._load is None else 0
        fresh = time.monotonic() - self._declared < SETTLED or now - since < SETTLED * 1e9
        if told is None or fresh or same_load(told, evaluator.payload):
            return
        evaluator.carry(now, told.mass, told.cog, '')
        if self._load is not None:
            self._load = load_message(self._load.header.frame_id, told.mass, told.cog)


def _said(asked: Sequence[Callable[[], Answer | None]]) -> str | None:
    """Return the answers in a sentence, None until all are there. BadSample: nothing was done."""
    answers = [answer for one in asked if (answer := one()) is not None]
    if len(answers) < len(asked):
        return None
    said = '; '.join(f'{"" if a.done else "refused: "}{a.text}' for a in answers)
    if not any(answer.done for answer in answers):
        raise BadSample(said)
    return said
