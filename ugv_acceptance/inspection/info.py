"""All that `info` says of a recording, as plain values: contents, fit, what could be judged."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from ugv_acceptance.bag.log_times import log_times_of
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.config import Config, load
from ugv_acceptance.evaluation.criteria.criteria import INCONCLUSIVE
from ugv_acceptance.inspection.contents import monitors_in, recording_contents, topic_contents
from ugv_acceptance.inspection.fit import (
    Named,
    config_of,
    fitting,
    named_in,
    robot_contents,
)
from ugv_acceptance.inspection.judgeable import could_be_judged, could_not_be_judged
from ugv_acceptance.inspection.look import Look, chosen, look, until_cheap
from ugv_acceptance.offline.own_robot import robot_of
from ugv_acceptance.type_aliases import Json

# Version of the layout; it changes when programs that read it must change.
INFO_VERSION = 1
# The share of the work that the index is.
INDEX = 0.3
Reached = Callable[[float], None]


def info_of(
    recording: Recording,
    config: Path | None = None,
    *,
    urdf: Path | None = None,
    everything: bool = False,
    reached: Reached = lambda _: None,
) -> Json:
    """Return what is in a recording, whether it fits a configuration, what could be judged.

    docs/info.md says how it is laid out. Of a long recording the index is read, and its beginning
    (`everything`: all of it); `reached` gets the share that is done. Raises BadConfig where the
    configuration given cannot be used.
    """
    bag = recording.bag
    times = log_times_of(bag, lambda share: reached(INDEX * share))
    first = robot_of(recording, config, urdf=urdf) if config or urdf else load()
    named = _named(recording, first, everything=everything)
    taken, problem = config_of(recording, config, urdf, named.joints)
    used = chosen(recording, taken or first)
    if taken is not None and taken.topics.names != first.topics.names:
        named = _named(recording, taken, everything=everything)

    def judged(seconds: float) -> None:
        reached(INDEX + (1.0 - INDEX) * min(seconds / max(bag.duration_s, 1e-9), 1.0))

    told: Json = {
        'version': INFO_VERSION,
        'recording': recording_contents(recording),
        'topics': topic_contents(recording, times, {k: one.topic for k, one in used.items()}),
        'robot': robot_contents(recording, taken or first, named, used) if taken else None,
        'fitting': fitting(named.joints),
        'monitors': monitors_in(bag),
    }
    if taken is None:
        return told | _unjudged(problem)
    return told | _judged(look(recording, taken, everything=everything, reached=judged))


def _named(recording: Recording, config: Config, *, everything: bool) -> Named:
    bag, used = recording.bag, chosen(recording, config)
    part = bag.beginning(bag.end_ns if everything else until_cheap(bag))
    return named_in(part, used['joint_states'].topic, used['imu'].topic)


def _unjudged(why: str) -> Json:
    return {
        'read_until_s': None,
        'could_be_judged': [],
        'could_not': [{'what': '', 'why': why, 'decides': True}],
        'limits_hash': None,
        'can_be_judged': False,
    }


def _judged(seen: Look) -> Json:
    if seen.judged is None:
        paths = seen.whole.paths
        return _unjudged(seen.obstacle.removeprefix(f'{paths[0]}: '))
    result = seen.judged.result
    return {
        'read_until_s': seen.until_s,
        'could_be_judged': [asdict(one) for one in could_be_judged(result)],
        'could_not': [asdict(one) for one in could_not_be_judged(result)],
        'limits_hash': result['limits_hash'],
        'can_be_judged': result['verdict'] != INCONCLUSIVE,
    }
