"""A drill on the console's page: the same frames as of a robot, and in the end its record."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.atomic_files import write_json
from ugv_acceptance.console.hub import Hub
from ugv_acceptance.console.server import serve
from ugv_acceptance.console.snapshot import Snapshot
from ugv_acceptance.drill.feed import DrillFeed
from ugv_acceptance.drill.outcome import Drill
from ugv_acceptance.drill.record import record_json
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Json


def serve_drill(  # noqa: PLR0913 - as `serve`
    feed: DrillFeed,
    drill: Callable[[], Drill],
    out: Path | None = None,
    *,
    host: str = '127.0.0.1',
    port: int = 0,
    token: str | None = None,
    ready: Callable[[str], None] = lambda _: None,
    asked: Callable[[], bool] = lambda: False,
) -> None:
    """Serve a drill on the console's page until SIGINT, SIGTERM or `asked`.

    The first situation begins when the page is first opened. `drill` returns what came of it so
    far; it is written to `out` whenever a situation has been judged, so that a drill which is
    interrupted leaves what was done. The rest is as in `serve`.
    """
    serve(Hub(Recorded(feed, drill, out)), host, port, token, ready, asked)


@dataclass(slots=True)
class Recorded:
    """A drill's feed that adds the `record` to its last frames, and says where it is `written`."""

    feed: DrillFeed
    drill: Callable[[], Drill]
    out: Path | None = None
    settings: Settings = field(init=False)
    _first: Snapshot | None = None
    _record: Json | None = None
    _written: str = ''

    def __post_init__(self) -> None:
        self.settings = self.feed.settings
        self._first = self.feed.snapshot()

    def describe(self) -> dict[str, Any]:
        """Return the description of the drill's feed; the drill begins with the first one."""
        if self._first is not None:
            self._first = None
            self.feed.restart()
        return self.feed.describe()

    def snapshot(self) -> Snapshot:
        """Return the robot as it is now; keep the record of what was judged meanwhile."""
        if self._first is not None:
            return self._first
        snapshot = self.feed.snapshot()
        self._keep()
        return snapshot

    def _keep(self) -> None:
        drill = self.drill()
        if not drill.outcomes or len(drill.outcomes) == self._kept():
            return
        self._record = record_json(drill)
        if self.out is None:
            return
        try:
            write_json(self.out, self._record)
        except AcceptanceError as error:
            self._written = f'NOT WRITTEN: {error}. Save it here.'
        else:
            self._written = f'Written to {self.out} where the drill runs.'

    def _kept(self) -> int:
        return len(self._record['situations']) if self._record else 0

    def extra(self) -> dict[str, Any]:
        """Return the drill's part of a frame; at its end with `record` and `written`."""
        found = self.feed.extra()
        if found.get('drill', {}).get('phase') != 'ended':
            return found
        return {
            **found,
            'drill': {**found['drill'], 'record': self._record, 'written': self._written},
        }

    def command(self, do: str, values: dict[str, Any]) -> str:
        """Carry out an operator's command."""
        return self.feed.command(do, values)
