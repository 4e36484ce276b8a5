"""Kinds of faults of whoever sets the software up: limits, contact points, criteria."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from error_rate.draw import Draw, Made, calm, leaning, mass_for, reaching, window
from error_rate.sensing import both_silent, tipped
from made.scene import Scene, sensed, told
from made.truth import Load

REASON = {'unsafe_limits': 'a test of limits that are too wide'}
# What must be told of contact points beyond the robot's own shapes.
OUTSIDE = r'contact[^"\n]*(outside|beyond|too wide)|place of [^"\n]*not compared'
# Criteria that no run can fail.
VACUOUS: dict[str, dict[str, Any]] = {
    'above -180': {'value': 'tip_angle', 'above_deg': -180},
    'share 1': {'value': 'torque_utilisation', 'below': 0.9, 'share_in_violation': 1},
    'time': {'value': 'tip_angle', 'above_deg': 10, 'time_in_violation_s': 1000},
    'rear alone': {'value': 'tip_angle', 'of': 'rear', 'above_deg': -120},
    'duration': {'data': 'duration', 'at_least': 1},
    'outside': {'value': 'tip_angle', 'above_deg': 5, 'between_s': [400, 500]},
}


def _goes_wrong(draw: Draw) -> Scene:
    """Return a run that tips or overloads its arm for a while, as every sensor says."""
    start, hold = draw('start_s'), draw('hold_s')
    config = draw.config()
    if draw.subject.weak is not None and draw.pick('goes') == 'overload':
        scene = calm(draw, Load(mass_for(draw, config, draw('share'))))
        return reaching(scene, window(scene.joint_time, start, 9.0, hold))
    scene = calm(draw)
    shape = window(scene.imu_time, start, 4.0, hold)
    return leaning(draw, scene, shape, math.radians(draw('past_deg')))


def limits_wide(draw: Draw) -> Made:
    """The limits are so wide, with a reason, that they forbid nothing; the run goes wrong."""
    scene = _goes_wrong(draw)
    changes = REASON | {'limits.tip_error_deg': -89, 'limits.torque_error': 10}
    parts = [*told(scene, scene.load.mass), *sensed(scene, draw.rng)]
    return Made(parts, tipped(scene), draw.config(changes))


def limit_null(draw: Draw) -> Made:
    """The joint that is overloaded has no limit in the configuration; it must be named."""
    config = draw.config()
    scene = calm(draw, Load(mass_for(draw, config, draw('share'))))
    scene = reaching(scene, window(scene.joint_time, draw('start_s'), 9.0, draw('hold_s')))
    weak = draw.subject.weak
    assert weak is not None
    name = scene.config.settings.robot.joint_names[weak]
    parts = [*told(scene, scene.load.mass), *sensed(scene, draw.rng)]
    changed = draw.config({f'joints.{name}.limit_nm': None})
    unjudged = rf'{name}[^"\n]*(not judged|not checked|no limit)'
    return Made(parts, tipped(scene), changed, pardon=unjudged)


def contacts_wide(draw: Draw) -> Made:
    """The contact points are too far apart, which the URDF's shapes show; the robot tips."""
    scene = calm(draw)
    shape = window(scene.imu_time, draw('start_s'), 4.0, draw('hold_s'))
    scene = leaning(draw, scene, shape, math.radians(draw('past_deg')))
    wide, contacts = draw('wide_m'), dict(draw.subject.document['contacts'])
    changed = {}
    for name, contact in contacts.items():
        x, y, z = contact['position_m']
        place = [float(x + np.sign(x) * wide), float(y + np.sign(y) * wide), float(z)]
        changed[name] = dict(contact) | {'position_m': place}
    parts = [*told(scene, scene.load.mass), *sensed(scene, draw.rng)]
    return Made(parts, tipped(scene), draw.config({'contacts': changed}), pardon=OUTSIDE)


def criteria_vacuous(draw: Draw) -> Made:
    """The criteria cannot fail; the run tips, overloads its arm, or is not seen for a while."""
    word = draw.pick('criteria')
    criteria = {'version': 1, 'name': 'vacuous', 'criteria': {'one': VACUOUS[word]}}
    if draw.pick('hides') == 'silence':
        return replace(both_silent(draw), criteria=criteria | {'coverage': 0})
    scene = _goes_wrong(draw)
    parts = [*told(scene, scene.load.mass), *sensed(scene, draw.rng)]
    more = {'coverage': 0} if draw.pick('coverage') == 'none needed' else {}
    return Made(parts, tipped(scene), scene.config, criteria=criteria | more)
