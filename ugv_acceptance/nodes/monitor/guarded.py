"""Keeps a fault in a timer or a service from ending the monitor."""

from collections.abc import Callable
from typing import Any, Protocol

from ugv_acceptance.monitoring.session import Session


class Watcher(Protocol):
    """What `guarded` needs of a monitor node."""

    session: Session | None

    def get_logger(self) -> Any:  # noqa: ANN401 - rclpy's logger
        """Return the node's logger."""


def guarded(watcher: Watcher, work: Callable[[], None]) -> Callable[[], None]:
    """Wrap a timer's work so that an exception in it is reported and the monitor goes on."""

    def run() -> None:
        try:
            work()
        except Exception as error:  # noqa: BLE001 - a fault in our code must not end the watch
            text = f'{work.__name__}: fault of the monitor: {error!r}'
            watcher.get_logger().error(text, throttle_duration_sec=5.0)
            if watcher.session is not None:
                watcher.session.fail(work.__name__, error)

    return run


def answering(watcher: Watcher, name: str, answer: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap what answers a service, so that an exception is logged and the answer stays as it began.

    That is no success, where an answer says so. rclpy raises where a lifecycle manager asks for a
    transition that its state does not have, and ends the node.
    """

    def call(request: Any, response: Any) -> Any:  # noqa: ANN401 - of any service
        try:
            return answer(request, response)
        except Exception as error:  # noqa: BLE001 - no request may end the watch
            text = f'{name}: refused: {error}'
            watcher.get_logger().warning(text, throttle_duration_sec=5.0)
            return type(response)()

    return call
