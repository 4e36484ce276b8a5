"""Keeps a fault of our own code in a timer from ending the monitor."""

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
