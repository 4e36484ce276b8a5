"""Converts a snapshot to one frame of JSON for page and terminal, live or recorded.

Angles become degrees here, in names ending `_deg`. What is not a finite number is null: a page must
say that it does not know. `describe_robot` gives what does not change from frame to frame.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from typing import Any

from ugv_acceptance.console.alert_cards import card_of, name_words
from ugv_acceptance.console.headline import View, headline_of, view_of
from ugv_acceptance.console.snapshot import InputRow, Snapshot
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR as STAND_CLEAR_ADVICE
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, LEVELS, OK, WARN
from ugv_acceptance.evaluation.criteria.not_judged import left_open, unlimited
from ugv_acceptance.evaluation.ground import FLAT, ground_words
from ugv_acceptance.evaluation.inputs.low_pass import NOWHERE
from ugv_acceptance.evaluation.margin_words import share_words, tenths_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.attitude import roll_pitch
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.model.solids import moving_bodies, solids_of
from ugv_acceptance.model.stability import SIDES, STATES
from ugv_acceptance.model.tree import tree_of
from ugv_acceptance.monitoring.drawing import Figure, Skeleton, plumb_of, skeleton_of

# What stands where a margin is not known.
_DASH = '-'

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
    view = view_of(snapshot, settings)
    headline = headline_of(view)
    seconds, seconds_to = _countdown(snapshot, view)
    active, past = cards_of(view)
    torque, worst = _torque(snapshot, settings, dead=view.dead)
    return {
        'time_s': snapshot.time / 1e9,
        'stamp_s': None if snapshot.stamp is None else snapshot.stamp / 1e9,
        'level': LEVELS[view.level],
        'word': level_words(view.level),
        'headline': headline.plain(),
        'seconds': seconds,
        'seconds_to': seconds_to,
        'cards': active,
        'past': past,
        'assumed': assumed_words(snapshot, settings),
        'lamps': {
            'black_box': snapshot.black_box,
            'running_s': number(snapshot.running),
            'source': snapshot.source,
        },
        'q': numbers(snapshot.q),
        'posture': _posture(snapshot, figure),
        'attitude': _attitude(snapshot),
        'tilt': _tilt(snapshot, settings, dead=view.dead or not settings.judges_tilt),
        'state': STATES[snapshot.state],
        'ground': {
            'words': snapshot.ground,
            'rough': snapshot.rough,
            'cautious_deg': number(math.degrees(snapshot.cautious)),
        },
        'torque': torque,
        'worst_joint': worst,
        'inputs': [_input(row) for row in snapshot.inputs],
        'payload': {
            'mass_kg': snapshot.payload.mass,
            'cog_m': list(snapshot.payload.cog),
        },
    }


def number(value: float) -> float | None:
    """Return a number rounded to six decimals; None where it is not finite."""
    return round(value, 6) if math.isfinite(value) else None


def numbers(values: Iterable[float]) -> list[float | None]:
    """Return a list of `number` of each value."""
    return [number(value) for value in values]


def cards_of(view: View) -> tuple[list[Plain], list[Plain]]:
    """Return the cards of what is active, and of what is over.

    What is over, and what was advised by numbers that are dead, gives no advice.
    """
    fallen = None if view.fallen is None else STAND_CLEAR_ADVICE
    now = '' if view.dead else fallen
    cards = [
        card_of(group, view.snapshot, view.settings, now if group.active else '')
        for group in view.groups
    ]
    return [card for card in cards if card['active']], [c for c in cards if not c['active']]


def assumed_words(snapshot: Snapshot, settings: Settings) -> str:
    """Return in one line what is taken for granted, and what is not checked; '' if nothing is."""
    taken = f'ground taken as {FLAT}' if snapshot.ground == ground_words(None) else ''
    if snapshot.ground and not taken and snapshot.rough:
        taken = f'ground: {snapshot.ground}'
    return '; '.join(words for words in (taken, _unchecked(_Same(settings))) if words)


@dataclass(frozen=True, slots=True, eq=False)
class _Same:
    """Settings as a key of a cache: the same object, not an equal one, which takes long to see."""

    settings: Settings

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.settings is self.settings

    def __hash__(self) -> int:
        return id(self.settings)


@lru_cache(maxsize=2)
def _unchecked(same: _Same) -> str:
    """Return what no verdict on a robot covers, in one line; '' if all is covered."""
    settings = same.settings
    joints = ', '.join(name_words(name) for name in unlimited(settings))
    found = [one.what for one in left_open(settings).not_checked]
    found = [f'{name_words(what)} (not in the configuration)' for what in found]
    found += ['tip-over (no IMU)'] * (not settings.hears_imu)
    found += ['torques (no joint states)'] * (not settings.hears_joints)
    found += [f'torque of {joints} (no limit known)'] * bool(joints)
    return f'NOT CHECKED: {", ".join(found)}' if found else ''


def _countdown(snapshot: Snapshot, view: View) -> tuple[float | None, str]:
    """Return the seconds until the first margin is used up, and what happens then."""
    soon = snapshot.countdown
    if soon is None or view.dead or view.doubted or view.fallen is not None:
        return None, ''
    if not soon.seconds > 0.0:
        return None, ''
    name = name_words(soon.subject)
    return round(soon.seconds, 1), f'tipping {name.upper()}' if soon.tips else f'{name} limit'


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
        'body': _points(skeleton.body),
        'contacts': _points(skeleton.contacts),
        'polygon': _points(skeleton.polygon),
        'cog': _point(skeleton.cog),
        'load': None if skeleton.load is None else _point(skeleton.load),
        # Rotation by rows, then origin.
        'places': [[*chain(*map(_point, turn)), *_point(at)] for turn, at in skeleton.places],
    }


# The base and what it stands on keep their places while the arm moves.
@lru_cache(maxsize=16)
def _points(found: tuple[Vector, ...]) -> list[list[float]]:
    return [_point(p) for p in found]


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


def _tilt(snapshot: Snapshot, settings: Settings, *, dead: bool) -> list[Plain]:
    """Return the tilt left to each side: in degrees, in words, and its level."""
    rows = []
    for side, angle in zip(SIDES, snapshot.angle, strict=True):
        words, level = _DASH, ''
        if angle == math.inf and not dead:
            words, level = 'no edge', LEVELS[OK]
        elif math.isfinite(angle) and not dead:
            words = '<= ' * snapshot.rough + tenths_words(angle)
            level = _tilt_level(angle, settings, rough=snapshot.rough)
        rows.append(
            {'side': side, 'left_deg': number(math.degrees(angle)), 'words': words, 'level': level}
        )
    return rows


def _tilt_level(angle: float, settings: Settings, *, rough: bool) -> str:
    """Return the level of a tilt left (rad); '' for an upper bound, which never says OK."""
    limits = settings.limits
    if angle <= limits.tip_error:
        return LEVELS[ERROR]
    if angle <= limits.tip_warn:
        return LEVELS[WARN]
    return '' if rough else LEVELS[OK]


def _torque(
    snapshot: Snapshot, settings: Settings, *, dead: bool
) -> tuple[list[Plain], int | None]:
    """Return the torque of each joint: numbers, words and level; and which uses most."""
    nothing = (math.nan,) * len(settings.robot.joint_names)
    rows = zip(
        settings.robot.joint_names,
        snapshot.torque or nothing,
        snapshot.effort or nothing,
        settings.limits.torque,
        strict=True,
    )
    found, worst, most = [], None, -1.0
    for k, (name, tau, effort, limit) in enumerate(rows):
        use = abs(tau) / limit
        judged = not dead and limit < math.inf and math.isfinite(use)
        if judged and use > most:
            worst, most = k, use
        found.append(
            {
                'joint': name,
                'torque': number(tau),
                'measured': number(effort),
                'limit': number(limit),
                'use': number(use),
                'words': share_words(use) if judged else _DASH if limit < math.inf else 'no limit',
                'level': _torque_level(use, settings) if judged else '',
            }
        )
    return found, worst


def _torque_level(use: float, settings: Settings) -> str:
    limits = settings.limits
    if use >= limits.torque_error:
        return LEVELS[ERROR]
    return LEVELS[WARN if use >= limits.torque_warn else OK]


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
