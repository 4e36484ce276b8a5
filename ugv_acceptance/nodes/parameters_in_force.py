"""The monitor's parameters in force, asked of it whenever they may have changed.

How they are recorded: bag/told_parameters.py. The hash of the limits is that which the monitor's
verdict tells.
"""

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import qos_profile_parameter_events
from rclpy.serialization import deserialize_message
from rclpy.task import Future

from ugv_acceptance.bag.told_parameters import HASH, parameters_message

# Seconds after which an answer is no longer waited for; between two questions at least, and at
# most: a monitor may be restarted unnoticed.
PATIENCE, AGAIN, SURELY = 5.0, 0.3, 10.0


class ParametersInForce:
    """Asks the node `monitor` (its full name); `on_found` is called with each new message.

    `told` is the number of them.
    """

    def __init__(self, node: Node, monitor: str, on_found: Callable[[bytes], None]) -> None:
        self._monitor, self._on_found = monitor, on_found
        self._list: Any = node.create_client(ListParameters, f'{monitor}/list_parameters')
        self._get: Any = node.create_client(GetParameters, f'{monitor}/get_parameters')
        node.create_subscription(
            ParameterEvent, '/parameter_events', self._changed, qos_profile_parameter_events
        )
        self._wanted, self._asked, self._waits = True, 0.0, False
        self._hash, self._values = '', dict[str, object]()
        self._message = b''
        self.told = 0

    def look(self) -> None:
        """Ask, if something may have changed and the monitor can answer; to be called often."""
        now = time.monotonic()
        if self._waits and now - self._asked < PATIENCE:
            return
        ready = self._list.service_is_ready() and self._get.service_is_ready()
        due = AGAIN if self._wanted else SURELY
        if now - self._asked >= due and ready:
            self._wanted, self._waits, self._asked = False, True, now
            self._list.call_async(ListParameters.Request()).add_done_callback(self._listed)

    def hear(self, verdict: bytes) -> None:
        """Take a verdict of the monitor: its hash of the limits may be a new one."""
        with suppress(Exception):  # one that cannot be read tells nothing
            values = deserialize_message(verdict, DiagnosticStatus).values
            told = next((pair.value for pair in values if pair.key == HASH), '')
            if told != self._hash:
                self._hash, self._wanted = told, True
                self._tell()

    def _changed(self, event: ParameterEvent) -> None:
        if event.node == self._monitor:
            self._wanted = True

    def _listed(self, future: Future) -> None:
        answer: Any = future.result() if future.exception() is None else None
        if answer is None:
            self._waits, self._wanted = False, True
            return
        names = sorted(answer.result.names)
        asked = self._get.call_async(GetParameters.Request(names=names))
        asked.add_done_callback(lambda got: self._got(names, got))

    def _got(self, names: list[str], future: Future) -> None:
        self._waits = False
        answer: Any = future.result() if future.exception() is None else None
        if answer is None or len(answer.values) != len(names):
            self._wanted = True
            return
        values = map(parameter_value_to_python, answer.values)
        self._values = dict(zip(names, values, strict=True))
        self._tell()

    def _tell(self) -> None:
        if not self._values:
            return
        message = parameters_message(self._monitor, self._values, self._hash)
        if message != self._message:
            self._message, self.told = message, self.told + 1
            self._on_found(message)
