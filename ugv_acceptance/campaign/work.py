"""One run of a campaign judged, wherever the work is done: in this process, another, a cluster."""

import hashlib
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from ugv_acceptance import AcceptanceError, __version__
from ugv_acceptance.bag.judge import RESULT_VERSION, Terms, judge
from ugv_acceptance.bag.reader import Bag, choose_topics, open_bag
from ugv_acceptance.campaign.sources import Source, local_paths
from ugv_acceptance.config import Config
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.evaluation.criteria import CriteriaSet

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Brief:
    """What every worker needs: the robot, the criteria (None: its limits), keys already known."""

    config: Config
    criteria: CriteriaSet | None = None
    known: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Done:
    """A run that was looked at: its source, size (bytes), and one of three outcomes.

    `result` is a new result, `key` alone says that it is known, `error` that it could not be read.
    """

    source: Source
    key: str = ''
    size: int = 0
    result: Json | None = None
    error: str = ''


def key_of(bag_sha256: str, config_sha256: str, criteria_sha256: str) -> str:
    """Return the name of a result: the same inputs and software give the same."""
    parts = (bag_sha256, config_sha256, criteria_sha256, __version__, str(RESULT_VERSION))
    return hashlib.sha256('\n'.join(parts).encode()).hexdigest()


def judge_source(source: Source, brief: Brief) -> Done:
    """Return what came of one run; whatever is wrong with it is said in `error`, never raised."""
    try:
        with local_paths(source) as paths:
            return _renamed(_tried(source, paths, brief), paths)
    except AcceptanceError as error:
        return Done(source, error=str(error))


def _tried(source: Source, paths: Path | list[Path], brief: Brief) -> Done:
    try:
        return _judged(source, open_bag(paths), brief)
    except AcceptanceError as error:
        return Done(source, error=str(error))
    except Exception as error:  # noqa: BLE001 - one broken bag never ends a campaign
        return Done(source, error=f'{type(error).__name__}: {error}')


def _judged(source: Source, bag: Bag, brief: Brief) -> Done:
    config, criteria = brief.config, brief.criteria
    said = criteria.sha256 if criteria else None
    key = key_of(bag.sha256(), config.sha256, said or 'limits')
    size = sum(path.stat().st_size for path in bag.paths)
    if key in brief.known:
        return Done(source, key, size)
    wanted = config.topics
    topics = choose_topics(bag, wanted.joint_states.name, wanted.imu.name, wanted.payload.name)
    terms = Terms(criteria, sources_from(config))
    result = judge(bag, topics, config.settings, terms=terms).result
    result['robot'] = {
        'name': config.name,
        'serial': config.serial,
        'config': str(config.path),
        'urdf': str(config.urdf_path),
        'sha256': config.sha256,
        'warnings': list(config.warnings),
    }
    result['software'] = {'version': __version__}
    result['identity'] = {}
    began = datetime.fromtimestamp(bag.start_ns // 10**9, timezone.utc)
    result['recorded'] = began.strftime('%Y-%m-%d %H:%M:%S UTC') if bag.start_ns else None
    result['start_ns'] = bag.start_ns
    return Done(source, key, size, result)


def _renamed(done: Done, paths: Path | list[Path]) -> Done:
    """Return an outcome in which a fetched copy goes by the name of what it was fetched from."""
    if not done.source.remote:
        return done
    copied = str(paths if isinstance(paths, Path) else paths[0].parent)
    origin = done.source.files[0].rpartition('/')[0]
    result, error = (_replaced(said, copied, origin) for said in (done.result, done.error))
    return replace(done, result=result, error=error)


def _replaced(value: Any, old: str, new: str) -> Any:  # noqa: ANN401 - JSON
    if isinstance(value, dict):
        return {key: _replaced(item, old, new) for key, item in value.items()}
    if isinstance(value, list):
        return [_replaced(item, old, new) for item in value]
    return value.replace(old, new) if isinstance(value, str) else value
