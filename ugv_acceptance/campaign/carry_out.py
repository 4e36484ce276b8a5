"""Carries out a campaign: judges the runs that have no result yet, collects runs and failures."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.atomic_files import naming, write_text
from ugv_acceptance.campaign.cluster import WAIT_S
from ugv_acceptance.campaign.failure_log import Entry
from ugv_acceptance.campaign.failures import Failure, with_log
from ugv_acceptance.campaign.hash_memory import HashMemory, read_memory
from ugv_acceptance.campaign.pool import judge_all
from ugv_acceptance.campaign.run_table import (
    NOT_JUDGED,
    Row,
    broken_row,
    in_order,
    row_of,
    unjudged_row,
)
from ugv_acceptance.campaign.sources import Source
from ugv_acceptance.campaign.work import Brief, Done, judge_source, key_of
from ugv_acceptance.type_aliases import Json

RUNS = 'runs'
# Hexadecimal digits of a key.
_KEY = 64


def prepare_folder(folder: Path) -> None:
    """Make the folder. AcceptanceError where that cannot be."""
    with naming(folder):
        (folder / RUNS).mkdir(parents=True, exist_ok=True)


def known_keys(folder: Path) -> frozenset[str]:
    """Return the keys of the results in the folder."""
    return frozenset(p.stem for p in (folder / RUNS).glob('*.json') if len(p.stem) == _KEY)


def keep_result(folder: Path, key: str, text: str) -> None:
    """Write the JSON of a run's result, complete or not at all."""
    write_text(folder / RUNS / f'{key}.json', text)


def read_result(folder: Path, key: str) -> Json:
    """Return a run's result. Raises AcceptanceError where it is not as it was written."""
    path = folder / RUNS / f'{key}.json'
    try:
        result = json.loads(path.read_text('utf-8'))
        if not all(field in result for field in ('verdict', 'coverage', 'alerts', 'start_ns')):
            raise AcceptanceError(f'{path}: expected a result of a run; remove that file')
    except (OSError, ValueError, TypeError, RecursionError) as error:
        raise AcceptanceError(
            f'{path}: expected a result of a run, got: {error}; remove that file'
        ) from None
    found: Json = result
    return found


@dataclass(frozen=True, slots=True)
class Place:
    """Where a campaign is computed: processes of this machine, or a dask scheduler's address.

    `wait_s` is how long to wait for a scheduler or workers that went away.
    """

    folder: Path
    workers: int
    scheduler: str | None = None
    wait_s: float = WAIT_S


@dataclass(slots=True)
class Effort:
    """The cost of a campaign: runs judged anew, bytes of their recordings, CPU time (s).

    `unchanged` is how many runs were not read, since none of their files looked changed; `since` is
    when the first of these was last read (UTC, ISO 8601). `odd` is a sentence where the memory of
    hashes could not be used as it is, else ''.
    """

    judged: int = 0
    size: int = 0
    cpu: float = 0.0
    unchanged: int = 0
    since: str = ''
    odd: str = ''


def carry_out(
    sources: Sequence[Source],
    brief: Brief,
    place: Place,
    progress: Callable[[Done], None] = lambda _: None,
    *,
    rehash: bool = False,
) -> tuple[list[Row], Effort]:
    """Judge every source, keep its result in the folder, and return the runs in order.

    A run with a result in the folder is not judged again; it is not even read if its files look as
    they did when it was, unless `rehash`. A run that could not be judged is tried again. `progress`
    is called with every run as it is ready.
    """
    prepare_folder(place.folder)
    brief = replace(brief, known=known_keys(place.folder))
    memory = read_memory(place.folder)
    effort = Effort(odd=memory.said)
    unread = {} if rehash else _unchanged(sources, brief, memory, place.folder, effort)
    for source in unread:
        progress(Done(source))
    rows, rest = list(unread.values()), [s for s in sources if s not in unread]
    judged = judge_all(rest, brief, place.workers, place.scheduler, place.wait_s) if rest else ()
    for done in judged:
        rows.append(_row(done, brief, place.folder))
        if done.sha256:
            memory.add(done.source, done.sha256)
        effort.cpu += done.cpu
        if done.row is not None:
            effort.judged += 1
            effort.size += done.size
        progress(done)
    return in_order(rows), effort


def _unchanged(
    sources: Sequence[Source], brief: Brief, memory: HashMemory, folder: Path, effort: Effort
) -> dict[Source, Row]:
    """Return the rows of the runs whose result is known without reading them, and count them."""
    found = {}
    for source in sources:
        remembered = memory.of(source)
        if remembered is None or (key := key_of(remembered.sha256, brief)) not in brief.known:
            continue
        row = _stored_row(source.name, key, folder)
        if row is not None:
            found[source] = row
            effort.since = min(effort.since or remembered.hashed, remembered.hashed)
    effort.unchanged = len(found)
    return found


def _row(done: Done, brief: Brief, folder: Path) -> Row:
    name = done.source.name
    if done.lost:
        return unjudged_row(name, done.lost)
    if done.error:
        return broken_row(name, done.error)
    if done.row is not None:
        keep_result(folder, done.key, done.text)
        return done.row
    row = _stored_row(name, done.key, folder)
    if row is not None:
        return row
    again = judge_source(done.source, replace(brief, known=frozenset()))
    return _row(again, brief, folder)


def _stored_row(name: str, key: str, folder: Path) -> Row | None:
    """Return the row of a stored result; None if it is damaged, which counts as missing."""
    try:
        return row_of(name, key, read_result(folder, key))
    except (AcceptanceError, LookupError, TypeError, ValueError, AttributeError):
        return None


def all_failures(rows: Sequence[Row], entries: Sequence[Entry]) -> list[Failure]:
    """Return the failures of all runs with those of a failure log, in the order of the runs.

    A log entry about an alert of a run that is not yet judged is left out: the alert is not known.
    """
    names = {name: row.name for row in rows for name in (row.name, *row.also)}
    open_runs = {row.name for row in rows if row.verdict == NOT_JUDGED}
    said = [e for e in entries if e.alert is None or e.run_of(names) not in open_runs]
    found = with_log([f for row in rows for f in row.failures], said, names)
    place = {row.name: k for k, row in enumerate(rows)}
    return sorted(found, key=lambda f: (place[f.run], f.at_s))
