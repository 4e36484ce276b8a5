"""Judges one run: in this process, in another, or on a cluster."""

import hashlib
import posixpath
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ugv_acceptance import AcceptanceError, BadBag, __version__
from ugv_acceptance.bag.atomic_files import json_text
from ugv_acceptance.bag.reader import Bag, open_bag
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.campaign.not_judged import is_of_the_machine
from ugv_acceptance.campaign.run_table import Row, row_of
from ugv_acceptance.campaign.sources import Source, is_unchanged, local_paths
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.criteria.criteria import CriteriaSet
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.judge import RESULT_VERSION
from ugv_acceptance.type_aliases import Json


@dataclass(frozen=True, slots=True)
class Brief:
    """The data every worker needs: robot, criteria (None: the robot's limits), known keys."""

    config: Config
    criteria: CriteriaSet | None = None
    known: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Done:
    """The outcome of one run: its source, size (bytes), and one of four results.

    `row` and `text` are a new result's line and JSON, `key` alone says that it is known, `error`
    that it is unreadable (`missing`: a file of it is not there), `lost` that it was not judged for
    a reason that is not its own. `cpu` is the CPU time (s) of its process that it took. `sha256` is
    the identity of its recording (`Bag.identity`), '' where its files may have changed since they
    were listed.
    """

    source: Source
    key: str = ''
    size: int = 0
    row: Row | None = None
    text: str = ''
    error: str = ''
    cpu: float = 0.0
    lost: str = ''
    missing: bool = False
    sha256: str = ''


@dataclass(frozen=True, slots=True)
class _Found:
    """A result, its key, identity and size (bytes) of its recording; None: the result is known."""

    key: str
    sha256: str
    size: int
    result: Json | None


def key_of(identity: str, brief: Brief) -> str:
    """Return the key of a result: a hash of recording, configuration, criteria and software."""
    criteria = brief.criteria.sha256 if brief.criteria else 'limits'
    parts = (identity, brief.config.sha256, criteria, __version__, str(RESULT_VERSION))
    return hashlib.sha256('\n'.join(parts).encode()).hexdigest()


def judge_source(source: Source, brief: Brief) -> Done:
    """Return the outcome of one run; every error is put in `error` or `lost`, none is raised."""
    began = time.process_time()
    try:
        done = _tried(source, brief)
    except MemoryError:
        done = Done(source, lost='MemoryError: no memory for its result')
    return replace(done, cpu=time.process_time() - began)


def _tried(source: Source, brief: Brief) -> Done:
    try:
        with local_paths(source) as paths:
            try:
                bag = open_bag(paths)
                found = _judged(bag, brief)
            except Exception as error:  # noqa: BLE001 - one broken bag never ends a campaign
                return _failed(source, paths, error)
            # metadata.yaml may name a file that was not listed as a recording.
            looked_at = {posixpath.basename(file) for file in source.files}
            seen = looked_at.issuperset(path.name for path in bag.paths) and is_unchanged(source)
            sha256 = found.sha256 if seen else ''
            if found.result is None:
                return Done(source, found.key, found.size, sha256=sha256)
            result = _renamed(found.result, source, paths)
    except BadBag as error:
        return Done(source, error=str(error))
    except (AcceptanceError, OSError) as error:  # not fetched, no room for a copy
        return Done(source, lost=str(error))
    row = row_of(source.name, found.key, result)
    return Done(source, found.key, found.size, row, json_text(result), sha256=sha256)


def _failed(source: Source, paths: Path | list[Path], error: Exception) -> Done:
    """Return the outcome of a run that failed: by its own fault, or by that of the machine."""
    text = str(error) if isinstance(error, AcceptanceError) else f'{type(error).__name__}: {error}'
    text = _renamed(text, source, paths)
    files = [paths] if isinstance(paths, Path) else paths
    if not source.remote:
        files = [Path(file) for file in source.files]
    if is_of_the_machine(error, files):
        return Done(source, lost=text)
    missing = not source.remote and not all(file.exists() for file in files)
    return Done(source, error=text, missing=missing)


def _judged(bag: Bag, brief: Brief) -> _Found:
    config, criteria = brief.config, brief.criteria
    sha256 = bag.identity()
    key = key_of(sha256, brief)
    size = sum(path.stat().st_size for path in bag.paths)
    if key in brief.known:
        return _Found(key, sha256, size, None)
    # One thread: the other cores have runs of their own.
    found = evaluate(Recording(bag), config=config, criteria=criteria)
    result = found.result
    result['start_ns'] = bag.start_ns
    return _Found(key, sha256, size, result)


def _renamed(said: Any, source: Source, paths: Path | list[Path]) -> Any:  # noqa: ANN401 - JSON
    """Return `said` with the paths of a fetched copy replaced by the URL it came from."""
    if not source.remote:
        return said
    copied = str(paths if isinstance(paths, Path) else paths[0].parent)
    return _replaced(said, copied, source.files[0].rpartition('/')[0])


def _replaced(value: Any, old: str, new: str) -> Any:  # noqa: ANN401 - JSON
    if isinstance(value, dict):
        return {key: _replaced(item, old, new) for key, item in value.items()}
    if isinstance(value, list):
        return [_replaced(item, old, new) for item in value]
    return value.replace(old, new) if isinstance(value, str) else value
