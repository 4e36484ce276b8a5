"""The motion desk: takes planned motions on `~/check` and answers them on `~/check_result`.

It commands nothing. An answer is a DiagnosticStatus, as monitoring/motion_answers.py says. Whoever
hears none knows nothing.
"""

from collections.abc import Callable, Iterable

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.timer import Timer
from trajectory_msgs.msg import JointTrajectory

from ugv_acceptance.monitoring.diagnostics import Status
from ugv_acceptance.monitoring.motion_questions import MotionQuestions, Question
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.publishers import StatusOutput, status_message
from ugv_acceptance.nodes.monitor.subscriptions import Inputs

# Seconds between two looks at questions and permissions; there are none while there is neither.
PERIOD = 0.05
# Questions that wait in the middleware, the newest; answers that wait for a client.
QUESTIONS, ANSWERS = 10, 50
# The parameter that tells a payload.
MASS = 'payload.mass_kg'


class MotionDesk:
    """Answers planned motions by a monitor's session; None: the monitor is not active.

    `output` names the monitor and the robot; `clock` is steady.
    """

    def __init__(
        self,
        node: Node,
        session: Callable[[], Session | None],
        inputs: Callable[[], Inputs | None],
        output: StatusOutput,
        clock: Clock,
    ) -> None:
        self._node, self._session, self._inputs = node, session, inputs
        self._output, self._clock = output, clock
        self._payload_by, self._heard = '', 0
        self._of: Session | None = None
        self._declares = False
        self.questions = MotionQuestions(session, self.load_by, self._warn)
        self._out = node.create_publisher(DiagnosticStatus, '~/check_result', ANSWERS)
        node.create_subscription(JointTrajectory, '~/check', self._take, QUESTIONS, raw=True)
        node.add_on_set_parameters_callback(self._before)
        node.add_post_set_parameters_callback(self._after)
        self._timer: Timer = node.create_timer(PERIOD, self._look, clock=clock)
        self._timer.cancel()

    def load_by(self) -> str:
        """Return who told the payload in force; '' if nobody did, so that it is only assumed."""
        session = self._session()
        if session is None:
            return ''
        if session is not self._of:
            self._of, self._heard = session, 0
        if session.counts['payload'].taken > self._heard:
            self._heard, inputs = session.counts['payload'].taken, self._inputs()
            nodes = [] if inputs is None else inputs.publishers.get('payload', [])
            self._payload_by = ', '.join(nodes) or 'operator'
        known = 'configuration' if session.settings.payload_known else ''
        return self._payload_by or known

    def _before(self, _: list[Parameter]) -> SetParametersResult:
        """Note whether the payload's parameter is being declared, with the value of the file."""
        self._declares = not self._node.has_parameter(MASS)
        return SetParametersResult(successful=True)

    def _after(self, parameters: list[Parameter]) -> None:
        """Note that a parameter tells the payload: not one that follows a message."""
        if all(parameter.name != MASS for parameter in parameters):
            return
        given = MASS in self._node._parameter_overrides  # noqa: SLF001 - rclpy has no public way
        session = self._session()
        heard = session is not None and session.counts['payload'].taken > self._heard
        if self._declares and not given:
            self._payload_by = ''
        elif not heard:
            self._payload_by = f'parameter {MASS}'

    def _take(self, data: bytes) -> None:
        """Take a question, whatever is in it."""
        now, ros = self._clock.now().nanoseconds, self._node.get_clock().now().nanoseconds
        self._do(lambda: self.questions.ask(Question(data, now, ros)))
        self._timer.reset()

    def _look(self) -> None:
        now = self._clock.now().nanoseconds
        self._do(lambda: self.questions.look(now))
        if not self.questions.busy:
            self._timer.cancel()

    def _do(self, work: Callable[[], Iterable[Status]]) -> None:
        """Publish what `work` has to say; a fault in it ends every permission, and nothing else."""
        try:
            for status in work():
                self._say(status)
        except Exception as error:  # noqa: BLE001 - no question may end the watch
            self._warn(f'planned motion: fault of the monitor: {error!r}')
            for status in self.questions.give_up(repr(error)):
                self._say(status)

    def _say(self, status: Status) -> None:
        output = self._output
        values = {'time_ns': self._node.get_clock().now().nanoseconds, **status.values}
        said = Status(status.level, status.name, status.message, values)
        self._out.publish(status_message(said, output.name, output.hardware_id))

    def _warn(self, text: str) -> None:
        self._node.get_logger().warning(text, throttle_duration_sec=5.0)
