"""The operator's card: a printable page a step group, what alerts mean, the safe map."""

import math
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from ugv_acceptance import __version__
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.wording import advice
from ugv_acceptance.plan.order import duration
from ugv_acceptance.plan.plan import Plan, Posture, Step
from ugv_acceptance.plan.search import Arm, look, roles_of
from ugv_acceptance.report.regions import (
    degree_axes,
    draw_regions,
    figure,
    legend,
    svg_of,
)
from ugv_acceptance.studies.maps import Levels

# Code -> what it means to the person at the robot.
MEANINGS = {
    'TIP_OVER': 'Little tilt is left before the robot tips to the side named.',
    'TORQUE_LIMIT': 'The joint named carries nearly, or more than, what its motor can hold.',
    'NO_SUPPORT': 'The robot does not stand on its contact points: it is tipping or hanging.',
    'STATIC_MODEL': 'The joint moves so fast that the margins shown are too good.',
    'INPUT_STALE': 'Messages of a sensor have stopped: no margin is known.',
    'INPUT_INCOMPLETE': 'A joint is missing from the messages: no margin is known.',
    'INPUT_INVALID': 'A sensor sends numbers that cannot be true.',
    'IMU_INCONSISTENT': 'The IMU contradicts itself: tilt cannot be trusted.',
    'PAYLOAD_INVALID': 'The load that was declared cannot be used.',
    'CLOCK': 'Clocks disagree: times of messages cannot be trusted.',
}
LEVELS = (
    ('OK', 'all margins kept', 'go on'),
    ('WARN', 'a margin is small, no limit passed', 'go on slowly, away from the limit'),
    ('ERROR', 'a limit is passed', 'stop, unless this step expects it'),
    ('STALE', 'margins are not known', 'stop: nothing protects the robot now'),
)
# Steps (deg) of the map; a joint's range in it.
MAP_STEP, MAP_RANGE = 3.0, (-180.0, 181.0)


@dataclass(frozen=True, slots=True)
class Row:
    """A step as the card shows it, all texts."""

    step: Step
    posture: str
    expected: str
    ground: str
    load: str


def card_of(plan: Plan, config: Config) -> str:
    """Return the operator's card as one self-contained HTML page."""
    environment = Environment(
        loader=PackageLoader('ugv_acceptance.plan'), autoescape=True, undefined=StrictUndefined
    )
    template = environment.get_template('card.html')
    order = sorted(plan.steps, key=lambda s: (s.where, _first(plan, s.group)))
    groups = [
        {'name': name, 'where': where, 'rows': [row_of(plan, s) for s in steps]}
        for (where, name), steps in groupby(order, key=lambda s: (s.where, s.group))
    ]
    return template.render(
        plan=plan,
        config=config,
        version=__version__,
        groups=groups,
        levels=LEVELS,
        meanings=[(code, text, advice(code)) for code, text in MEANINGS.items()],
        maps=safe_maps(config),
        minutes=round(duration(plan) / 60.0),
        home=_text(plan.home_deg),
    )


def _first(plan: Plan, group: str) -> int:
    return next(k for k, step in enumerate(plan.steps) if step.group == group)


def row_of(plan: Plan, step: Step) -> Row:
    """Return a step's texts; joints at home are left out."""
    moved = {n: a for n, a in step.posture_deg.items() if a != plan.home_deg.get(n)}
    told = {'tilt_left_deg': '{:.1f}° of tilt left', 'use': '{:.0%} of the torque limit'}
    expected = [told[key].format(value) for key, value in step.expected.items() if key in told]
    tilt = step.ground.tilt_deg
    ground = f'{step.ground.orientation} {tilt:g}°' if tilt else 'level'
    return Row(step, _text(moved) or 'home', '; '.join(expected), ground, f'{step.payload_kg:g} kg')


def _text(posture: Posture) -> str:
    return ', '.join(f'{n.removesuffix("_joint")} {a:g}°' for n, a in posture.items())


def safe_maps(config: Config) -> list[dict[str, str]]:
    """Return the maps of tilt left and torque used over both arm joints, empty and fully loaded."""
    arm = Arm(config.settings, roles_of(config.settings))
    limits, full = config.settings.limits, config.settings.robot.payload.mass
    axis = np.radians(np.arange(*MAP_RANGE, MAP_STEP))
    q = np.broadcast_to(arm.folded, (len(axis), len(axis), len(arm.folded))).copy()
    names = arm.robot.joint_names
    q[..., names.index(arm.roles.axes[0])] = axis[:, None]
    q[..., names.index(arm.roles.axes[1])] = axis
    maps = []
    for load in dict.fromkeys((0.0, full)):
        found = look(arm, q.reshape(-1, q.shape[-1]), ('level', 0.0), load)
        tilt = np.degrees(found.tilt).reshape(len(axis), -1)
        use = found.most.reshape(len(axis), -1)
        bounds = Levels(math.degrees(limits.tip_warn), math.degrees(limits.tip_error))
        torque = Levels(1.0 - limits.torque_warn, 1.0 - limits.torque_error)
        maps.append(_drawn(arm, axis, ((tilt, bounds), (1.0 - use, torque)), load))
    return maps


def _drawn(arm: Arm, axis: Any, fields: Any, load: float) -> dict[str, str]:  # noqa: ANN401 - arrays
    made = figure(7.4, 3.7)
    shoulder, elbow = (name.removesuffix('_joint') for name in arm.roles.axes)
    for k, (title, (margin, levels)) in enumerate(
        zip(('tip-over', 'motor torque'), fields, strict=True), 1
    ):
        axes = made.add_subplot(1, 2, k)
        degrees = np.degrees(axis)
        draw_regions(axes, degrees, degrees, margin, levels)
        degree_axes(axes, shoulder, elbow)
        axes.set_title(title)
    legend(made, loc='outside lower center', ncols=3)
    caption = f'{load:g} kg in the gripper, level ground' if load else 'gripper empty, level ground'
    return {'svg': svg_of(made, f'map{load:g}'.replace('.', '_')), 'caption': caption}
