"""The operator's desk: takes every command on `~/operator` and answers it on `~/operator_answer`.

An answer is a DiagnosticStatus as well: `name` is the command, `hardware_id` who gave it, as the
command claims, `level` OK or, if it was refused, WARN; `message` what was done or why not, in a
sentence. Its values have the `id` of the command, `result`: done or refused, and `from`: the node
that sent it. Where the configuration names `operators`, only their commands are taken. A command
that comes twice with one id, from a client that heard no answer, is carried out once and answered
twice.
"""

from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import InertiaStamped
from rclpy.node import Node
from rclpy.serialization import serialize_message

from ugv_acceptance import AcceptanceError, BadSample
from ugv_acceptance.evaluation.alerts.alarms import Change
from ugv_acceptance.evaluation.alerts.state_machine import OK, WARN
from ugv_acceptance.evaluation.ground import KINDS, ground_words
from ugv_acceptance.evaluation.inputs.payload import payload_fault
from ugv_acceptance.monitoring.senders import Sender, check_operator, full_names
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.operator_commands import (
    DOINGS,
    LONGEST_TEXT,
    done_words,
    operate,
    operation_from,
)
from ugv_acceptance.nodes.monitor.operator_topic import OperatorTopic
from ugv_acceptance.nodes.monitor.publishers import key_values
from ugv_acceptance.nodes.monitor.subscriptions import Inputs

INACTIVE = 'the monitor is not active'
# Says whether the arm may touch the ground; value: allowed, true or false.
HAND = 'hand_may_touch'
DONE, REFUSED = 'done', 'refused'
# Commands that wait to be taken, and answers that wait for a client.
DEPTH = 50
# Answers that are kept for a command that comes again; letters of an id.
_KEPT, _LONGEST_ID = 50, 80
# The alert that somebody commanded who may not, its subject, and ns for which it stands.
FOREIGN, SUBJECT = 'FOREIGN_OPERATOR', 'operator'
_STANDS = 5_000_000_000

Values = dict[str, str]


class OperatorDesk:
    """Carries out commands on a monitor's session; None: the monitor is not active.

    `tell` publishes changes of alerts, `say` the verdict; both before the answer. `declare` sets a
    parameter in the name of an operator. `operators` are the nodes that may command, as configured.
    """

    def __init__(
        self,
        node: Node,
        session: Callable[[], Session | None],
        inputs: Callable[[], Inputs | None],
        tell: Callable[[list[Change]], None],
        say: Callable[[], None],
        declare: Callable[[str, Any], None],
        operators: Callable[[], tuple[str, ...] | None],
    ) -> None:
        self._node, self._session, self._inputs = node, session, inputs
        self._tell, self._say, self._declare = tell, say, declare
        self._operators = operators
        self._answers: dict[str, DiagnosticStatus] = {}
        self._refused_at = 0
        self._out = node.create_publisher(DiagnosticStatus, '~/operator_answer', DEPTH)
        self._topic = OperatorTopic(node, DEPTH, self._take)

    def destroy(self) -> None:
        """Hear no commands any more."""
        self._topic.destroy()

    def look(self) -> None:
        """Clear the alert about a refused sender that is long over; to be called once a second."""
        session = self._session()
        if session is not None and session.clock.now() - self._refused_at > _STANDS:
            session.faults.clear(session.clock.now(), FOREIGN, SUBJECT)

    def _take(self, message: DiagnosticStatus, sender: Sender) -> None:
        """Carry out a command and answer it, whatever is in it."""
        asked = {pair.key: pair.value for pair in message.values}.get('id', '')[:_LONGEST_ID]
        try:
            check_operator(sender, full_names(self._operators(), self._node.get_namespace()))
        except BadSample as error:
            # Not kept for its id: another node, which may, can have that too.
            self._out.publish(self._answer(message, sender, asked, REFUSED, str(error)))
            self._report(sender)
            return
        answer = self._answers.get(asked)
        if answer is None:
            answer = self._answered(message, sender, asked)
            if asked:
                self._answers[asked] = answer
                while len(self._answers) > _KEPT:
                    del self._answers[next(iter(self._answers))]
        self._out.publish(answer)

    def _report(self, sender: Sender) -> None:
        """Raise the alert that names a sender who may not command."""
        session = self._session()
        if session is not None:
            self._refused_at = session.clock.now()
            session.faults.set(self._refused_at, FOREIGN, SUBJECT, 1.0, sender.words)
            session.tick()

    def _answered(self, message: DiagnosticStatus, sender: Sender, asked: str) -> DiagnosticStatus:
        found: dict[str, object] = {}
        try:
            said, found = self._do(message, sender.words)
            result = DONE
        except AcceptanceError as error:
            said, result = str(error), REFUSED
        except Exception as error:  # noqa: BLE001 - no message may end the node
            said, result = f'fault of the monitor: {error!r}', REFUSED
        self._say()
        return self._answer(message, sender, asked, result, said, found)

    def _answer(
        self,
        message: DiagnosticStatus,
        sender: Sender,
        asked: str,
        result: str,
        said: str,
        found: dict[str, object] | None = None,
    ) -> DiagnosticStatus:
        """Log what came of a command and return it as a message."""
        log, who = self._node.get_logger(), message.hardware_id[:LONGEST_TEXT] or 'unknown'
        note = ' '.join(message.message[:LONGEST_TEXT].split())
        name = ' '.join(who.split())
        line = f'operator {name} (from {sender.words}): {said}{f"; note: {note}" if note else ""}'
        if result == DONE:
            log.info(line)
        else:
            log.warning(f'{line} (refused)')
        return DiagnosticStatus(
            level=bytes([OK if result == DONE else WARN]),
            name=message.name,
            hardware_id=who,
            message=said,
            values=key_values(
                {'id': asked, 'result': result, 'from': sender.words, **(found or {})}
            ),
        )

    def _do(self, message: DiagnosticStatus, sender: str) -> tuple[str, dict[str, object]]:
        """Carry out a command; return what was done and values for the answer."""
        session = self._session()
        if session is None:
            raise BadSample(INACTIVE)
        if message.name in DOINGS:
            changes = operate(session, message, sender)
            self._tell(changes)
            return done_words(operation_from(message), changes), {'changes': len(changes)}
        others: dict[str, Callable[[Session, Values], tuple[str, dict[str, object]]]] = {
            'ground': self._ground,
            'payload': self._payload,
            HAND: self._hand,
        }
        if message.name not in others:
            known = ', '.join([*DOINGS, *others])
            raise BadSample(f'name: expected one of {known}, got {message.name[:80]!r}')
        return others[message.name](session, {pair.key: pair.value for pair in message.values})

    def _ground(self, session: Session, values: Values) -> tuple[str, dict[str, object]]:
        kind, before = values.get('kind', 'nothing'), ground_words(session.settings.ground.kind)
        if kind not in ('', *KINDS):  # empty: not entered
            raise BadSample(f'ground: expected one of {", ".join(KINDS)}, got {kind[:80]!r}')
        self._declare('ground.kind', kind)
        said = f'ground is now {ground_words(kind or None)}; before: {before}'
        return said, {'ground': kind}

    def _hand(self, _: Session, values: Values) -> tuple[str, dict[str, object]]:
        allowed = values.get('allowed', '')
        if allowed not in ('true', 'false'):
            raise BadSample(f'{HAND}: expected allowed: true or false, got {allowed[:80]!r}')
        self._declare(HAND, allowed == 'true')
        if allowed == 'true':
            words = 'the arm may touch the ground; no torque is judged while it does'
        else:
            words = 'the arm may not touch the ground; every torque is judged'
        return words, {'allowed': allowed}

    def _payload(self, session: Session, values: Values) -> tuple[str, dict[str, object]]:
        """Take a load as if its topic had told it, so that the black box has it too."""
        robot, cog = session.settings.robot, session.evaluator.payload.cog
        mass = _number('mass_kg', values.get('mass_kg', ''))
        if 'cog_m' in values:
            places = values['cog_m'].split(',')
            if len(places) != 3:
                raise BadSample(
                    f'cog_m: expected three numbers with commas, got {values["cog_m"][:80]!r}'
                )
            x, y, z = (_number('cog_m', place) for place in places)
            cog = x, y, z
        link = robot.payload_link
        if link is None and mass > 0.0:
            raise BadSample(
                'payload: the monitor cannot place a load, because this robot has no payload link;'
                ' set payload.link in its configuration'
            )
        fault = payload_fault(robot, mass, cog, link or '')
        if fault:
            raise BadSample(f'payload: {fault}')
        message = load_message(link or '', mass, cog)
        message.header.stamp = self._node.get_clock().now().to_msg()
        session.take_payload(serialize_message(message))
        place = ', '.join(f'{c:g}' for c in cog)
        found = {'mass_kg': repr(mass), 'cog_m': ','.join(map(repr, cog)), 'link': link or ''}
        where = f' at {place} m in {link}' if mass else ''
        others = self._others()
        more = (
            f'; {" and ".join(others)} may replace it, for it publishes loads too' if others else ''
        )
        said = f'payload is now {mass:g} kg{where}{more}'
        return said, {**found, 'topic': self._free_topic()}

    def _others(self) -> list[str]:
        """Return the nodes whose next load replaces an operator's: consoles follow it."""
        inputs = self._inputs()
        nodes = [] if inputs is None else inputs.publishers.get('payload', [])
        return [
            node for node in nodes if not node.endswith(('/acceptance_console', '/acceptance_tell'))
        ]

    def _free_topic(self) -> str:
        """Return the payload topic if its client may tell recorders there; '' if others do."""
        inputs = self._inputs()
        if inputs is None or any(self._node.get_parameter('allowed_publishers').value):
            return ''
        topic = inputs.subscriptions['payload'].topic_name
        return '' if self._node.count_publishers(topic) else topic


def load_message(link: str, mass: float, cog: tuple[float, float, float]) -> InertiaStamped:
    """Return the message that declares a load (kg, m in the axes of `link`), without a stamp."""
    message = InertiaStamped()
    message.header.frame_id = link
    message.inertia.m = mass
    message.inertia.com.x, message.inertia.com.y, message.inertia.com.z = cog
    return message


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise BadSample(f'{name}: expected a number, got {text[:80]!r}') from None
