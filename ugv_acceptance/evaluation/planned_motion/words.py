"""The sentences of an answer: why a motion is refused, and what to mind."""

import math

from ugv_acceptance.evaluation.margin_words import (
    degrees_words,
    number_beside,
    percent_words,
    rate_beside,
    share_words,
    tipping_words,
)
from ugv_acceptance.evaluation.planned_motion.answer import JointUse, TiltLeft
from ugv_acceptance.model.robot import Joint

# What no answer covers, whatever is asked.
NEVER_CHECKED = (
    'obstacles, and whether the arm meets the robot itself',
    'a stop on the way, and a base that drives or is pushed meanwhile',
    'whether the tracks slip or the ground gives way',
)


def when(time: float, point: int, points: int) -> str:
    """Return when in a motion of so many points: "at 1.20 s, on the way to point 3 of 8"."""
    return f'at {time:.2f} s, on the way to point {point} of {points}'


def too_long_words(moments: int, most: int) -> str:
    """Return that a motion would take too many moments to look at."""
    return (
        f'the motion is too long, or goes to and fro too far: {moments:,} moments would have to be '
        f'looked at, at most {most:,} are; check it in parts'
    )


def too_many_ways_words() -> str:
    """Return that too many joints may go either way round to the first point."""
    return (
        'too many joints stand half a turn or more from their first point, and each may go either '
        'way round: begin the trajectory nearer to where they stand'
    )


def round_words(names: str) -> str:
    """Return that some joints may go either way round to the first point."""
    return (
        f'{names}: half a turn or more from the first point; a controller may go either way round, '
        'so all are judged; a point on the way, less than half a turn from each, settles it'
    )


def tilt_words(tilt: TiltLeft, limit: float, points: int) -> str:
    """Return that a tilt left is at its limit (rad) or past it."""
    told = tipping_words(tilt.side, tilt.angle)
    place = when(tilt.time, tilt.point, points)
    return f'{told} {place}; must stay above {degrees_words(limit)}'


def use_words(use: JointUse, limit: float, points: int) -> str:
    """Return that a joint is at its limit (a share of its torque) or past it."""
    unit = 'N' if use.slides else 'N m'
    need = number_beside(use.torque, use.limit)
    return (
        f'{use.joint} {share_words(use.share)} of its limit {when(use.time, use.point, points)}: '
        f'it needs {need} of {use.limit:.1f} {unit}; must stay below {percent_words(limit)}'
    )


def range_words(joint: Joint, position: float, place: str) -> str:
    """Return that a planned position (rad, m) is outside of the range of its joint."""
    return (
        f'{joint.name} is to go to {_position(joint, position)} {place}: its range is '
        f'{_position(joint, joint.lower)} to {_position(joint, joint.upper)}'
    )


def rate_words_of(joint: Joint, rate: float, place: str) -> str:
    """Return that a planned rate (rad/s, m/s) is above the speed of its joint."""
    told = rate_beside(rate, joint.velocity, joint.units.rate)
    limit = rate_beside(joint.velocity, rate, joint.units.rate)
    return f'{joint.name} is to move at {told} {place}: it can move at {limit}'


def corner_words(count: int, corner: float) -> str:
    """Return how corners of a path were judged, by a time (s)."""
    return (
        f'{count} changes of rate at once, as between points without velocities: each is taken '
        f'to last {corner:g} s; a stiffer drive needs more torque'
    )


def _position(joint: Joint, position: float) -> str:
    if not math.isfinite(position):
        return 'any'
    return f'{position:.3f} m' if joint.slides else f'{math.degrees(position):.1f} deg'
