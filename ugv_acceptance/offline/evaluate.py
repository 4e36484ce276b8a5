"""Evaluates a recording: reads it once into margins, alerts and a verdict.

The command line, campaigns, maps, the console and Python programs all use `evaluate`.
"""

import platform
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

import numpy as np

from ugv_acceptance import BadConfig, __version__
from ugv_acceptance.bag.recording import Paths, Recording, open_recording
from ugv_acceptance.config import Config
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.evaluation.criteria.assumptions import unknown_load
from ugv_acceptance.evaluation.criteria.criteria import (
    INCONCLUSIVE,
    CriteriaSet,
)
from ugv_acceptance.evaluation.criteria.safeguards import with_objection
from ugv_acceptance.evaluation.criteria.statement import Objection, Statement
from ugv_acceptance.evaluation.criteria.uncertainty import Source
from ugv_acceptance.evaluation.criteria.verdict import not_checked_json
from ugv_acceptance.evaluation.effort.plateaus import EffortComparison
from ugv_acceptance.evaluation.ground import Ground, with_ground
from ugv_acceptance.evaluation.inputs.payload import payload_from
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.offline.acknowledgements import add_acknowledgements
from ugv_acceptance.offline.circumstances import assumed_of, load_of, origin_of
from ugv_acceptance.offline.evaluation import Evaluation, Judgement
from ugv_acceptance.offline.judge import DEFAULTS, Options, judge
from ugv_acceptance.offline.not_read import not_read
from ugv_acceptance.offline.own_robot import check_default, description_statement, robot_of
from ugv_acceptance.offline.told_parameters import told_parameters
from ugv_acceptance.offline.training import with_training
from ugv_acceptance.type_aliases import Json


def evaluate(
    recording: Recording | Paths,
    *,
    config: Config | Path | str | None = None,
    criteria: CriteriaSet | Path | str | None = None,
    payload: Payload | float | None = None,
    ground: Ground | None = None,
    identity: Mapping[str, str] | None = None,
    options: Options = DEFAULTS,
) -> Evaluation:
    """Evaluate a recording: margins, alerts and a verdict with its reasons.

    Parameters
    ----------
    recording
        An opened recording, or its path: a rosbag2 folder, MCAP, SQLite or ROS 1 file; a list of
        paths are the parts of one recording.
    config
        The robot: a configuration, its YAML file, or the name of one that ships (packbot, the
        default, for a recording that has its joints). One that names no URDF is completed by the
        recorded /robot_description.
    criteria
        The acceptance criteria or their YAML file; by default the limits of `config`.
    payload
        The payload carried until a message declares another: kg at the origin of the payload link,
        or a Payload; by default that of `config`.
    ground
        What the ground was, all the time or in windows, beyond what `config` and `criteria` say.
    identity
        What a person enters for the report: operator, robot_serial, place, ...
    options
        How the recording is read, what else is done with its margins, records of drills.

    Raises
    ------
    BadBag, BadConfig
        If the recording, the configuration or the criteria cannot be used.

    Examples
    --------
    >>> import ugv_acceptance as ugv
    >>> result = ugv.evaluate('bags/packbot_fail')
    >>> result.verdict
    'FAIL'
    >>> sorted({alert.code for alert in result.alerts if alert.level == 'ERROR'})
    ['ARM_ON_GROUND', 'TIP_OVER', 'TORQUE_LIMIT']
    >>> result.margins.sides
    ('front', 'left', 'rear', 'right')
    """
    opened = recording if isinstance(recording, Recording) else open_recording(recording)
    robot = config if isinstance(config, Config) else robot_of(opened, config)
    opened = replace(opened, names=opened.names or robot.topics.names)
    check_default(opened, robot)
    settings = _carrying(robot, payload)
    demanded = _criteria(criteria, settings)
    settings = _on_ground(settings, demanded, ground)
    if demanded is not None and demanded.hand_may_touch:
        settings = replace(settings, hand_may_touch=demanded.hand_may_touch)
    effort = EffortComparison(settings)
    if options.compare_effort:
        options = replace(options, takers=(effort.add, *options.takers))
    sources = sources_from(robot)
    told = (description_statement(opened, robot),)
    result, judgement = judge(opened, settings, demanded, sources, options, told)
    result |= _both_loads(opened, judgement, demanded, sources, result, told)
    result |= _circumstances(opened, robot, identity)
    required = demanded.operator_training if demanded is not None else None
    result |= with_training(result, options.training, required, opened.start_ns)
    unread = [not_checked_json(one) for one in not_read(opened, robot)]
    result['not_checked'] = [*result['not_checked'], *unread]
    result |= told_parameters(opened, judgement, result, declared=payload is not None)
    result['load'] = load_of(judgement.measurement.payloads, opened.start_ns)
    if payload is not None:
        carried = settings.robot.payload
        result['declared_payload'] = {'mass_kg': carried.mass, 'cog_m': list(carried.cog)}
    if ground is not None:
        result['declared_ground'] = _declared(ground)
    add_acknowledgements(result, opened.bag)
    if options.compare_effort:
        result['effort'] = effort.result(opened.start_ns)
    return Evaluation(opened, robot, result, judgement)


def _both_loads(
    opened: Recording,
    judged: Judgement,
    criteria: CriteriaSet | None,
    sources: tuple[Source, ...],
    result: Json,
    told: tuple[Statement, ...],
) -> Json:
    """Return the changes to a result if the verdict depends on a load told only later.

    The run is judged again as if the first payload that was declared had been carried all along.
    """
    first, settings = judged.evaluator.first_payload, judged.settings
    if first is None or settings.payload_known or first[1] == settings.robot.payload:
        return {}
    if unknown_load(settings, first, judged.measurement) or first[0] <= judged.measurement.start:
        return {}
    carried = replace(settings, robot=replace(settings.robot, payload=first[1]))
    other, _ = judge(opened, carried, criteria, sources, statements=told)
    if other['verdict'] == result['verdict']:
        return {}
    seconds = (first[0] - judged.measurement.start) / 1e9
    reason = (
        f'the load was told only after {seconds:.2f} s: with {settings.robot.payload.mass:g} kg '
        f'until then (the configuration) {result["verdict"]}, with {first[1].mass:g} kg (told '
        f'first) {other["verdict"]}; declare it from the start, or set payload.known'
    )
    return with_objection(result, Objection('payload', INCONCLUSIVE, reason))


def _carrying(config: Config, payload: Payload | float | None) -> Settings:
    """Return the settings with another payload (kg or Payload), unchanged if None."""
    settings = config.settings
    if payload is None:
        return settings
    carried = payload if isinstance(payload, Payload) else Payload(float(payload))
    link = settings.robot.payload_link or ''
    known = payload_from(settings.robot, carried.mass, carried.cog, link)
    if known is None:
        raise BadConfig(
            f'payload: expected kg from 0 on, for a robot with a payload link, got {payload!r}'
        )
    robot = replace(settings.robot, payload=known)
    return replace(settings, robot=robot, payload_known=True)


def _on_ground(settings: Settings, criteria: CriteriaSet | None, given: Ground | None) -> Settings:
    """Return settings with what is known of the ground: the criteria's, and what is `given`."""
    ground = settings.ground
    if criteria is not None:
        ground = with_ground(ground, criteria.ground_kind, criteria.ground_windows)
    if given is not None:
        ground = with_ground(ground, given.kind, given.windows)
    return replace(settings, ground=ground)


def _declared(ground: Ground) -> Json:
    windows = [{'kind': w.kind, 'start_s': w.start, 'end_s': w.end} for w in ground.windows]
    return {'kind': ground.kind, 'windows': windows}


def _criteria(criteria: CriteriaSet | Path | str | None, settings: Settings) -> CriteriaSet | None:
    if criteria is None or isinstance(criteria, CriteriaSet):
        return criteria
    # Most runs are judged by the limits of the configuration.
    from ugv_acceptance.config.criteria import load_criteria  # noqa: PLC0415

    return load_criteria(Path(criteria), settings)


def _circumstances(
    recording: Recording, config: Config, identity: Mapping[str, str] | None
) -> Json:
    """Return the part of a result about its origin: robot, software, identity, recording time."""
    start = recording.start_ns
    began = datetime.fromtimestamp(start // 10**9, timezone.utc)
    return {
        'identity': dict(identity or {}),
        'origin': origin_of(recording.bag),
        'robot': {
            'name': config.name,
            'serial': config.serial,
            'config': str(config.path),
            'urdf': str(config.urdf_path),
            'sha256': config.sha256,
            'urdf_sha256': config.urdf_sha256,
            'description': 'file' if config.description == 'file' else 'recorded',
            'warnings': list(config.warnings),
            'assumed': assumed_of(config),
        },
        'software': {
            'version': __version__,
            'numpy': np.__version__,
            'python': platform.python_version(),
        },
        'recorded': began.strftime('%Y-%m-%d %H:%M:%S UTC') if start else None,
    }
