"""Work that takes longer than a message may wait: in a thread, or at once.

`Snapshot` is what such work rests on; as long as the robot has hardly moved since, what was found
still holds and need not be computed again.
"""

from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload, Vector


def one_thread() -> Executor:
    """Return an executor with one thread of its own."""
    return ThreadPoolExecutor(1, thread_name_prefix='advice')


class AtOnce(Executor):
    """Does what it is given at once, so that in simulated time it is there at once."""

    def submit(
        self,
        fn: Callable[..., Any],
        /,
        *args: Any,  # noqa: ANN401 - as Executor has it
        **kwargs: Any,  # noqa: ANN401
    ) -> 'Future[Any]':
        """Return the future of a call that is done."""
        done: Future[Any] = Future()
        try:
            done.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - the future holds it, as that of a thread would
            done.set_exception(error)
        return done


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Settings, joint positions `q` (rad, m), `gravity` (m/s2) and payload at one moment."""

    settings: Settings
    q: tuple[float, ...]
    gravity: Vector
    payload: Payload

    def holds(self, now: 'Snapshot', moved: float, turned: float) -> bool:
        """Return whether what was found for this one is right for `now`.

        Joints are within `moved` (rad, m), gravity within `turned` (m/s2), all else is the same.
        """
        return (
            now.settings is self.settings
            and now.payload == self.payload
            and all(abs(x - y) <= moved for x, y in zip(self.q, now.q, strict=True))
            and all(abs(x - y) <= turned for x, y in zip(self.gravity, now.gravity, strict=True))
        )


def snapshot_of(settings: Settings, margins: Margins, payload: Payload) -> Snapshot:
    """Return the snapshot that margins belong to."""
    return Snapshot(settings, margins.q, margins.gravity, payload)
