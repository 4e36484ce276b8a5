"""Node `acceptance_monitor`, a lifecycle node: docs/ros_interface.md.

It advises; it is not a safety function. It configures and activates itself unless `autostart` is
false. Inputs are subscribed as raw bytes on activation, so an inactive monitor costs nothing.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.config import Config
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.evaluation.alerts.alarms import Change
from ugv_acceptance.evaluation.criteria.uncertainty import Source
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.monitoring.diagnostics import (
    Status,
    alert_status,
    diagnostics_of,
    unavailable,
    verdict_of,
)
from ugv_acceptance.monitoring.receipt_clock import StampShift
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.executor import run
from ugv_acceptance.nodes.monitor.black_box import BlackBox
from ugv_acceptance.nodes.monitor.guarded import answering, guarded
from ugv_acceptance.nodes.monitor.lamps import Lamps
from ugv_acceptance.nodes.monitor.motion_desk import MotionDesk
from ugv_acceptance.nodes.monitor.ok_output import OkOutput
from ugv_acceptance.nodes.monitor.operator_commands import (
    all_reset,
    black_box_of,
    by_service,
    service_refusal,
)
from ugv_acceptance.nodes.monitor.operator_desk import INACTIVE, OperatorDesk
from ugv_acceptance.nodes.monitor.own_description import OwnDescription
from ugv_acceptance.nodes.monitor.parameter_desk import ParameterDesk
from ugv_acceptance.nodes.monitor.publishers import MarginOutput, MarkerOutput, StatusOutput
from ugv_acceptance.nodes.monitor.subscriptions import Inputs
from ugv_acceptance.nodes.parameter_types import FittingParameters
from ugv_acceptance.nodes.transport import transport_now

NAME = 'acceptance_monitor'
UNLOCKED = (
    'operators: only they may command, but anybody may set limits, delays and thresholds by'
    ' parameter services: set lock_parameters as well'
)
# Called with ('alert' or 'verdict', the status).
Listener = Callable[[str, Status], None]


class Monitor(FittingParameters, LifecycleNode):
    """The monitor's node. `listener` is called with every verdict and change of an alert."""

    def __init__(self, listener: Listener = lambda _kind, _status: None, **node: Any) -> None:  # noqa: ANN401 - handed on to rclpy
        super().__init__(NAME, **node)
        self.listener = listener
        self.config: Config | None = None
        self.session: Session | None = None
        self.problem = ''
        self._sources: tuple[Source, ...] = ()
        self._inputs: Inputs | None = None
        self._margins: MarginOutput | None = None
        self._tick: Timer | None = None
        self._box: BlackBox | None = None
        self._lamps: Lamps | None = None
        self.own = OwnDescription(self, self._on_description)
        # Whether it is to bring itself up as soon as the robot tells its URDF.
        self._awaits = False
        self._transport = transport_now().values()
        self.parameter_desk = ParameterDesk(self, lambda: self.session, lambda: self._margins)
        self.output = StatusOutput(self)
        self.markers = MarkerOutput(self, lambda: self.session)
        self.ok = OkOutput(self, self)
        # Steady: a frozen /clock must not silence the diagnostics.
        self.steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, guarded(self, self._every_second), clock=self.steady)
        self.create_service(Trigger, '~/acknowledge', self._acknowledge)
        self.create_service(Trigger, '~/reset', self._reset)
        self.desk = OperatorDesk(
            self,
            lambda: self.session,
            lambda: self._inputs,
            self._tell,
            self.say,
            self.parameter_desk.declare,
            self._operators,
        )
        self.motions = MotionDesk(
            self, lambda: self.session, lambda: self._inputs, self.output, self.steady
        )
        for service in self.services:
            service.callback = answering(self, service.srv_name, service.callback)
        self.say()

    def destroy_node(self) -> None:
        """Destroy the node and what rclpy does not know of it."""
        self.desk.destroy()
        super().destroy_node()

    # Lifecycle

    def bring_up(self) -> None:
        """Configure and activate if `autostart`. Raises BadConfig where that is not possible.

        Where the robot itself tells its URDF, that is done as soon as it does.
        """
        if not self.parameter_desk.value('autostart'):
            return
        if self.own.is_needed(*self._files()):
            self._awaits = True
        elif not self._brought_up():
            raise BadConfig(self.problem)

    def _brought_up(self) -> bool:
        success = TransitionCallbackReturn.SUCCESS
        return bool(self.trigger_configure() == success and self.trigger_activate() == success)

    def _try_again(self) -> None:
        """Come up if the robot's description is there now; else say why not, once."""
        self._awaits = self._margins is None
        obstacle = self.own.obstacle()
        if self._awaits and obstacle and obstacle != self.problem:
            self.problem = obstacle
            self.get_logger().warning(obstacle)
        if self._awaits and self.own.untried():
            self._awaits = not self._brought_up()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read the robot's files, declare its parameters, create the margin topics."""
        return self._transition(self._configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start a new evaluation and subscribe to the inputs."""
        return self._transition(self._activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Unsubscribe; the verdict is STALE from now on."""
        return self._transition(self._deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Discard the robot's configuration, its parameters and topics."""
        return self._transition(self._clean_up)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Unsubscribe for good."""
        return self._transition(self._deactivate)

    def _transition(self, step: Callable[[], None]) -> TransitionCallbackReturn:
        # rclpy swallows exceptions of a transition, so they are logged here.
        self.problem = ''
        try:
            step()
        except Exception as error:  # noqa: BLE001 - whatever it is, the node lives on and says it
            self.problem = str(error) if isinstance(error, AcceptanceError) else repr(error)
            self.get_logger().error(self.problem)
        self.say()
        success, failure = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
        return failure if self.problem else success

    def _files(self) -> tuple[Path, Path | None]:
        urdf = self.parameter_desk.value('urdf')
        return Path(self.parameter_desk.value('config')), Path(urdf) if urdf else None

    def _configure(self) -> None:
        self._adopt(self.own.complete(*self._files(), wait=not self._awaits))

    def _adopt(self, config: Config) -> None:
        self.config, self._sources = config, sources_from(config)
        for warning in config.warnings:
            self.get_logger().warning(warning)
        settings = self.parameter_desk.adopt(config.settings)
        self.parameter_desk.only_operators = config.operators is not None
        if config.operators and not self.parameter_desk.value('lock_parameters'):
            self.get_logger().warning(UNLOCKED)
        self.output.hardware_id = config.serial or config.name
        self._margins = MarginOutput(self, settings, lambda: self.session)

    def _activate(self) -> None:
        if self.parameter_desk.settings is None or self.config is None:
            raise BadConfig('expected a configured monitor')
        if self.own.is_newer(self.config):
            told = self.own.complete(*self._files(), wait=False)
            self._clean_up()
            self._adopt(told)
        self._start()

    def _start(self) -> None:
        if self.parameter_desk.settings is None or self.config is None:
            raise BadConfig('expected a configured monitor')
        self.session = self._new_session(self.parameter_desk.settings)
        self._box = black_box_of(self, self.config, self.session)
        self._lamps = Lamps(self.session, self._box, self.session.clock.now(), self.ok)
        self._inputs = Inputs(
            self, self.config.topics, self.session, self.parameter_desk.value('depth')
        )
        self.parameter_desk.take_rates()
        tick = self.session.settings.delays.tick
        self._tick = self.create_timer(tick, guarded(self, self._on_tick), clock=self.steady)
        for data in list(self.own.heard):
            self._on_description(data)

    def _on_description(self, data: bytes) -> None:
        """Keep a description that is new, and hold the URDF in force against it at once."""
        if self.session is None or self._box is None or self.config is None:
            return
        try:
            self._box.describe(self.session.clock.now(), data)
            self.own.compare(self.config, self.session)
            self.session.tick()
        except Exception as error:  # noqa: BLE001 - a fault in our code must not end the watch
            self.session.fail('robot_description', error)

    def _new_session(self, settings: Settings) -> Session:
        return Session(
            settings,
            self._margins.publish if self._margins else lambda _stamp, _margins: None,
            self._on_change,
            lambda text: self.get_logger().warning(text, throttle_duration_sec=5.0),
            stamps=StampShift(bool(self.parameter_desk.value('use_sim_time'))),
            sources=self._sources,
        )

    def _deactivate(self) -> None:
        if self.session is not None:
            self._tell(all_reset(self.session))
            self.session.advisory.close()
        if self._box is not None:
            self._box.close()
        if self._inputs is not None:
            self._inputs.destroy()
        if self._tick is not None:
            self.destroy_timer(self._tick)
        self._inputs = self._tick = self.session = self._box = None

    def _clean_up(self) -> None:
        self.parameter_desk.forget()
        if self._margins is not None:
            self._margins.destroy()
        self._margins = self.config = None

    # Time

    def _on_tick(self) -> None:
        if (session := self.session) is None:
            return
        if session.stamps.simulated:
            session.stamps.follow(session.clock.now(), self.get_clock().now().nanoseconds)
        session.tick()
        self.parameter_desk.tell_load()
        self._tell(session.alarm_tracker.alarms.advance(now := session.clock.now()))
        if self._box is not None:
            self._box.advance(now)
        session.advisory.renew(now, session.active)
        if session.advisory.arrived() or session.advisory.urgent(now):
            self.say()
        self.ok.fall()

    def _every_second(self) -> None:
        self.own.look()
        if self._awaits:
            self._try_again()
        if self.session is not None and self._inputs is not None:
            self._inputs.look_around(self.parameter_desk.value('allowed_publishers'))
            self.desk.look()
            self.session.measure_rates()
            self.session.feel()
            if self.config is not None:
                self.own.compare(self.config, self.session)
            self.session.tick()
        if self._margins is not None:
            self._margins.look_for_listeners()
        self.say()

    # Published messages

    def verdict(self) -> Status:
        """Return the present verdict: STALE in every state but active."""
        if self.session is None or self._lamps is None:
            return unavailable(self.problem)
        return self._lamps.on(verdict_of(self.session))

    def say(self) -> None:
        """Publish the verdict and the diagnostics; before them that `~/ok` is false, if it is."""
        self.ok.fall()
        status = self.verdict()
        self.output.verdict(status)
        self.output.diagnostics(
            diagnostics_of(status, self.config, self.session, self._inputs, self._transport)
        )
        self.listener('verdict', status)

    def _on_change(self) -> None:
        if self.session is not None:
            self._tell(self.session.alarm_tracker.take())
            self.say()

    def _tell(self, changes: list[Change]) -> None:
        """Publish changes of alerts, and pass newly raised ones to the black box."""
        session = self.session
        if session is None or not changes:
            return
        statuses = [alert_status(change, session) for change in changes]
        message = self.output.alerts(statuses)
        for status in statuses:
            self.listener('alert', status)
        raised = [change.alert for change in changes if change.how == 'raised']
        if self._box is not None:
            self._box.alerts(session.clock.now(), raised, serialize_message(message))

    # Services

    def _operators(self) -> tuple[str, ...] | None:
        return self.config.operators if self.config is not None else None

    def _acknowledge(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        refusal = service_refusal(self._operators(), 'use `ugv-acceptance tell acknowledge`')
        response.success, response.message = False, refusal or INACTIVE
        if self.session is not None and not refusal:
            response.success = True
            seen = by_service(self.session)
            self._tell(seen)
            response.message = f'acknowledged {len(seen)} alerts'
            self.say()
        return response

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        refusal = service_refusal(self._operators(), 'use `ugv-acceptance tell reset`')
        response.success, response.message = False, refusal or INACTIVE
        if self.session is not None and not refusal:
            response.success = True
            self._deactivate()
            self._start()
            response.message = 'started a new evaluation: filters, alerts and clock are fresh'
            self.say()
        return response


def build(config: str | None, urdf: str | None, listener: Listener) -> Monitor:
    """Return a monitor of a robot; None: as the ROS arguments say."""
    given = {'config': config, 'urdf': urdf}
    overrides = [Parameter(name, value=value) for name, value in given.items() if value]
    return Monitor(listener, parameter_overrides=overrides)


def main(args: list[str] | None = None) -> None:
    """Run the monitor until it is interrupted; exit code 2 where the configuration is bad."""
    sys.exit(run(Monitor, args))
