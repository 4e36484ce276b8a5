"""Where a console's snapshots come from, and what every source must offer."""

from typing import Any, Protocol

from ugv_acceptance.console.snapshot import Snapshot
from ugv_acceptance.evaluation.settings import Settings


class Feed(Protocol):
    """A live robot or a recording; its methods are called from one thread, 20 times a second."""

    settings: Settings

    def describe(self) -> dict[str, Any]:
        """Return what a page must know once beside the robot: `source` and its `title`."""

    def snapshot(self) -> Snapshot:
        """Return the newest snapshot; never waits."""

    def extra(self) -> dict[str, Any]:
        """Return what this source adds to each frame, such as where a recording is played."""

    def command(self, do: str, values: dict[str, Any]) -> str:
        """Do what an operator asks; return what was done. Raises BadSample where it cannot be."""
