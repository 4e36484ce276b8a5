"""Converts a snapshot to one frame of JSON for page and terminal, live or recorded.

Angles become degrees here, in names ending `_deg`. What is not a finite number is null: a page must
say that it does not know. `describe_robot` gives what does not change from frame to frame.
"""

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import chain
from typing import Any

from ugv_acceptance.console.snapshot import AlertRow, InputRow, Snapshot
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.evaluation.alerts.rules import urgency
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, LEVELS, OK, STALE, WARN
from ugv_acceptance.evaluation.criteria.not_judged import kept_words, unknown_words
from ugv_acceptance.evaluation.ground import CARRIED, bound_words
from ugv_acceptance.evaluation.inputs.low_pass import NOWHERE
from ugv_acceptance.evaluation.least_margins import least_tilt, tilt_not_checked, with_most_used
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.attitude import roll_pitch
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.solids import moving_bodies, solids_of
from ugv_acceptance.model.stability import SIDES, STATES
from ugv_acceptance.model.tree import tree_of
from ugv_acceptance.monitoring.drawing import Figure, Skeleton, plumb_of, skeleton_of

# What the page says where nothing is known.
UNKNOWN = 'margins are not known'
ANSWER = 'enter it in the configuration, then start the monitor again'
WAIT = 'do not move the robot on these numbers; check the inputs'

Plain = dict[str, Any]


def describe_robot(settings: Settings) -> Plain:
    """Return what a page needs once: names of joints and sides, units, limits."""
    robot, limits = settings.robot, settings.limits
    return {
        'robot': robot.name,
        'sides': list(SIDES),
        'tip_warn_deg': math.degrees(limits.tip_warn),
        'tip_error_deg': math.degrees(limits.tip_error),
        'torque_warn': limits.torque_warn,
        'torque_error': limits.torque_error,
        'payload_link': robot.payload_link,
        'joints': [
            {
                'name': name,
                'kind': robot.joint(name).kind,
                'unit': robot.joint(name).units.effort,
                'limit': number(limit),
            }
            for name, limit in zip(robot.joint_names, limits.torque, strict=True)
        ],
        'solids': _solids(settings),
    }


def _solids(settings: Settings) -> list[Plain]:
    """Return the shapes to draw: `place` is a number in a posture's `places`, null on the base."""
    tree, solids = tree_of(settings.robot), solids_of(settings.robot)
    bodies = moving_bodies(solids)
    return [
        {
            'joint': tree.bodies[solid.body].joint,
            'place': bodies.index(solid.body) if solid.body else None,
            'radius_m': solid.radius,
            'points': [_point(point) for point in solid.points],
        }
        for solid in solids
    ]


def frame_of(snapshot: Snapshot, settings: Settings, figure: Figure) -> Plain:
    """Return the frame of a snapshot; `figure` is the drawing of the settings' robot."""
    level = snapshot.level if snapshot.known else max(snapshot.level, STALE)
    unanswered = bool(settings.unknown) and snapshot.known and level != ERROR
    level = STALE if unanswered else level
    cause, advice = _cause(snapshot, level)
    if unanswered and cause == UNKNOWN:
        cause, advice = unknown_words(settings), ANSWER
    cause = cause or kept_words(settings, rough=snapshot.rough)
    return {
        'time_s': snapshot.time / 1e9,
        'stamp_s': None if snapshot.stamp is None else snapshot.stamp / 1e9,
        'level': LEVELS[level],
        'word': level_words(level),
        'cause': cause,
        'advice': advice,
        'left': '' if level == STALE and not unanswered else _left(snapshot, settings),
        'alerts': [_alert(row, snapshot.time) for row in _by_urgency(snapshot.alerts)],
        'q': numbers(snapshot.q),
        'posture': _posture(snapshot, figure),
        'attitude': _attitude(snapshot),
        'tilt': _tilt(snapshot),
        'state': STATES[snapshot.state],
        'ground': {
            'words': snapshot.ground,
            'rough': snapshot.rough,
            'cautious_deg': number(math.degrees(snapshot.cautious)),
        },
        'torque': _torque(snapshot, settings),
        'inputs': [_input(row) for row in snapshot.inputs],
        'payload': {
            'mass_kg': snapshot.payload.mass,
            'cog_m': list(snapshot.payload.cog),
        },
    }


def number(value: float) -> float | None:
    """Return a number rounded to six decimals; None where it is not finite."""
    return round(float(value), 6) if math.isfinite(value) else None


def numbers(values: Iterable[float]) -> list[float | None]:
    """Return a list of `number` of each value."""
    return [number(value) for value in values]


def _left(snapshot: Snapshot, settings: Settings) -> str:
    """Return the smallest margins in a few words; '' where they are not known."""
    if not snapshot.known:
        return ''
    side, angle = least_tilt(snapshot.angle)
    degrees = math.degrees(angle)
    if side:
        ways = (
            f'{degrees:.1f} degrees of tilt left',
            f'{-degrees:.1f} degrees past the tipping point',
        )
        tilt = f'{ways[degrees < 0]} to the {side}'
        if snapshot.rough:
            tilt = bound_words(side, angle, snapshot.cautious)
        elif snapshot.carried:
            tilt = f'{tilt}; {CARRIED}'
    elif not settings.judges_tilt:
        tilt = tilt_not_checked(settings)
    else:
        tilt = f'no tilt margin ({STATES[snapshot.state].replace("_", " ")})'
    return '; '.join([with_most_used(tilt, snapshot.torque, settings), *snapshot.hints])


def _by_urgency(rows: Sequence[AlertRow]) -> list[AlertRow]:
    """Return rows by urgency: active, severe, unseen and new first.

    A contradiction of the IMU comes before tip-over, and tip-over before motors.

    A caution is left out while the danger of the same code and subject is active.
    """
    worse = {(row.code, row.subject) for row in rows if row.level == ERROR and row.end is None}
    rows = [row for row in rows if row.level != WARN or (row.code, row.subject) not in worse]

    def key(row: AlertRow) -> tuple[object, ...]:
        first = -urgency(row.code, row.level)
        return (row.end is not None, -row.level, first, not row.unseen, -row.start, row.key)

    return sorted(rows, key=key)


def _cause(snapshot: Snapshot, level: int) -> tuple[str, str]:
    """Return what the level comes from, and what to do; '' where nothing is wrong."""
    active = [row for row in _by_urgency(snapshot.alerts) if row.end is None]
    over = [row for row in _by_urgency(snapshot.alerts) if row.end is not None]
    if active and not (level == STALE and snapshot.problem):
        more = f' (and {len(active) - 1} more)' if len(active) > 1 else ''
        return active[0].text + more, active[0].advice
    if level == STALE:
        return snapshot.problem or UNKNOWN, WAIT
    if over and level != OK:
        do = 'reset it' if 'reset' in over[0].offers else 'acknowledge it'
        return f'{over[0].state}: {over[0].text}', f'{do} when the robot stands well again'
    return '', ''


def _alert(row: AlertRow, now: int) -> Plain:
    return {
        'key': row.key,
        'code': row.code,
        'subject': row.subject,
        'level': LEVELS[row.level],
        'word': level_words(row.level),
        'state': row.state,
        'active': row.end is None,
        'unseen': row.unseen,
        'text': row.text,
        'advice': row.advice,
        'age_s': round((now - row.start) / 1e9, 1),
        'offers': list(row.offers),
        'note': row.note,
    }


def _posture(snapshot: Snapshot, figure: Figure) -> Plain | None:
    drawn = _drawn(figure, snapshot.q, snapshot.payload)
    if drawn is None:
        return None
    skeleton, plain = drawn
    plumb = plumb_of(skeleton.cog, snapshot.gravity, skeleton.polygon)
    return {**plain, 'plumb': None if plumb is None else _point(plumb)}


# A robot that stands still is drawn once.
@lru_cache(maxsize=2)
def _drawn(figure: Figure, q: tuple[float, ...], payload: Payload) -> tuple[Skeleton, Plain] | None:
    skeleton = skeleton_of(figure, q, NOWHERE, payload)
    if skeleton is None:
        return None
    return skeleton, {
        'limbs': [
            {
                'joint': limb.joint,
                'from': _point(limb.start),
                'to': _point(limb.end),
                'bare': not figure.shape_of(limb.joint),
            }
            for limb in skeleton.limbs
        ],
        'body': [_point(corner) for corner in skeleton.body],
        'contacts': [_point(contact) for contact in skeleton.contacts],
        'polygon': [_point(corner) for corner in skeleton.polygon],
        'cog': _point(skeleton.cog),
        'load': None if skeleton.load is None else _point(skeleton.load),
        # Rotation by rows, then origin.
        'places': [[*chain(*map(_point, turn)), *_point(at)] for turn, at in skeleton.places],
    }


def _point(p: Sequence[float]) -> list[float]:
    x, y, z = p
    return [round(x, 4), round(y, 4), round(z, 4)]


def _attitude(snapshot: Snapshot) -> Plain | None:
    x, y, z = gravity = snapshot.gravity
    # Known and not near zero, so that it shows where down is.
    if not 1e-6 < math.hypot(x, y, z) < 1e6:
        return None
    roll, pitch = roll_pitch((-x, -y, -z))
    return {
        'roll_deg': number(math.degrees(roll)),
        'pitch_deg': number(math.degrees(pitch)),
        'slope_deg': number(math.degrees(math.atan2(math.hypot(x, y), -z))),
        'gravity': numbers(gravity),
    }


def _tilt(snapshot: Snapshot) -> list[Plain]:
    return [
        {'side': side, 'left_deg': number(math.degrees(angle))}
        for side, angle in zip(SIDES, snapshot.angle, strict=True)
    ]


def _torque(snapshot: Snapshot, settings: Settings) -> list[Plain]:
    nothing = (math.nan,) * len(settings.robot.joint_names)
    rows = zip(
        settings.robot.joint_names,
        snapshot.torque or nothing,
        snapshot.effort or nothing,
        settings.limits.torque,
        strict=True,
    )
    return [
        {
            'joint': name,
            'torque': number(tau),
            'measured': number(effort),
            'limit': number(limit),
            'use': number(abs(tau) / limit),
        }
        for name, tau, effort, limit in rows
    ]


def _input(row: InputRow) -> Plain:
    return {
        'name': row.name,
        'topic': row.topic,
        'level': LEVELS[row.level],
        'rate_hz': number(row.rate),
        'age_s': number(row.age),
        'publishers': list(row.publishers),
        'text': row.text,
    }
