"""The parameter desk: declares the monitor's parameters, judges each set of them, and applies it.

What each parameter means stands in parameters.py. The desk holds the settings that are in force.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.parameters import (
    LOAD,
    TunableParameter,
    changed,
    check_at_rest,
    check_declared,
    check_locked,
    declare_all,
    knobs_of,
    list_of,
    unknown,
)
from ugv_acceptance.nodes.monitor.publishers import MarginOutput
from ugv_acceptance.nodes.parameter_types import declare


class ParameterDesk:
    """Keeps a node's parameters and its settings the same.

    `settings` are None, and `tunables` none, until a robot's configuration is adopted. `session`
    and `margins` return those of the node; None: it is not active, not configured. With
    `only_operators` what an operator declares cannot be set by services, but by `declare` alone.
    """

    def __init__(
        self,
        node: Node,
        session: Callable[[], Session | None],
        margins: Callable[[], MarginOutput | None],
    ) -> None:
        self._node, self._session, self._margins = node, session, margins
        self.settings: Settings | None = None
        self.tunables: tuple[TunableParameter, ...] = ()
        self.only_operators = False
        # Settings and payload for which the payload's parameters were last compared.
        self._told: tuple[object, object] = (None, None)
        declare_all(node)
        node.add_on_set_parameters_callback(self._judge)
        node.add_post_set_parameters_callback(self._take)

    def value(self, name: str) -> Any:  # noqa: ANN401 - a parameter's value
        """Return the value of a parameter."""
        return self._node.get_parameter(name).value

    def adopt(self, defaults: Settings) -> Settings:
        """Declare a robot's parameters; return its settings with what the ROS arguments set."""
        node, tunables = self._node, knobs_of(defaults)
        for tunable in tunables:
            if not node.has_parameter(tunable.name):
                declare(node, tunable.name, tunable.get(defaults), tunable.descriptor())
        given = [name for name in node._parameter_overrides if not node.has_parameter(name)]  # noqa: SLF001 - rclpy has no public way
        for warning in unknown(given, tunables):
            node.get_logger().warning(warning)
        values = {tunable.name: self.value(tunable.name) for tunable in tunables}
        self.settings, self.tunables = changed(defaults, tunables, values), tunables
        return self.settings

    def forget(self) -> None:
        """Undeclare the robot's parameters."""
        for tunable in self.tunables:
            self._node.undeclare_parameter(tunable.name)
        self.tunables, self.settings = (), None

    def tell_load(self) -> None:
        """Set the payload's parameters to the payload in use after a message has changed it."""
        session = self._session()
        if self.settings is None or session is None:
            return
        at = self.settings, session.evaluator.payload
        if at[0] is self._told[0] and at[1] is self._told[1]:
            return
        self.settings = self._in_force(self.settings)
        self._told = self.settings, at[1]
        loads = {k.name: k.get(self.settings) for k in self.tunables if k.name in LOAD}
        if any(list_of(self.value(name)) != list_of(value) for name, value in loads.items()):
            told = [Parameter(name, value=value) for name, value in loads.items()]
            self._node.set_parameters_atomically(told)

    def declare(self, name: str, value: Any) -> None:  # noqa: ANN401 - a parameter's value
        """Set what an operator who may do so declares. Raises BadSample with the reason if not."""
        only, self.only_operators = self.only_operators, False
        try:
            result = self._node.set_parameters_atomically([Parameter(name, value=value)])
        finally:
            self.only_operators = only
        if not result.successful:
            raise BadSample(result.reason)

    def take_rates(self) -> None:
        """Hand the rate of publishing and the limits in force on to the margin topics."""
        rate, margins = self.value('publish_rate'), self._margins()
        if margins is not None and self.settings is not None:
            margins.period = int(1e9 / rate) if rate > 0 else 0
            margins.limits = self.settings.limits.torque

    def _judge(self, parameters: list[Parameter]) -> SetParametersResult:
        """Accept or refuse a set of parameters as a whole, with the reason; apply nothing."""
        values = {parameter.name: parameter.value for parameter in parameters}
        try:
            if self._session() is not None:
                check_at_rest(values)
                if self.value('lock_parameters'):
                    check_locked(values, self.tunables)
                if self.only_operators and self.settings is not None:
                    check_declared(values, self.tunables, self._in_force(self.settings))
            if self.settings is not None:
                changed(self._in_force(self.settings), self.tunables, values)
        except (BadConfig, TypeError, ValueError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _take(self, parameters: list[Parameter]) -> None:
        values = {parameter.name: parameter.value for parameter in parameters}
        if self.settings is not None:
            self.settings = changed(self._in_force(self.settings), self.tunables, values)
            if (session := self._session()) is not None:
                session.adopt(self.settings)
        self.take_rates()

    def _in_force(self, settings: Settings) -> Settings:
        """Return settings with the payload in use, which a message may have declared."""
        session = self._session()
        load = settings.robot.payload if session is None else session.evaluator.payload
        return replace(settings, robot=replace(settings.robot, payload=load))
