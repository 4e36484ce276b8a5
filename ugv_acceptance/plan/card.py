"""The operator's card: a printable page for each group of steps, with alerts and the safe map."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from ugv_acceptance import __version__
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.level_words import MEANS, pattern_words
from ugv_acceptance.evaluation.alerts.messages import ALERTS, advice
from ugv_acceptance.evaluation.alerts.robot_words import of_robot
from ugv_acceptance.evaluation.ground import FLAT, ground_words
from ugv_acceptance.evaluation.margin_words import degrees_words, excess_words, share_words
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.plan.derive import notes_of
from ugv_acceptance.plan.maps import safe_maps, standing_words
from ugv_acceptance.plan.order import duration
from ugv_acceptance.plan.plan import Plan, Posture, Step, vector_of
from ugv_acceptance.plan.search import Arm
from ugv_acceptance.plan.sketch import sketch
from ugv_acceptance.report.format import time_text
from ugv_acceptance.studies.orientations import ORIENTATIONS

# The order in which the card tells what alerts mean: robot, inputs, what was set.
SHOWN = (
    'TIP_OVER',
    'TIP_TREND',
    'TORQUE_LIMIT',
    'TIP_MOVING',
    'TIP_AHEAD',
    'TRACK_LIFT',
    'ACCELERATION',
    'TORQUE_AHEAD',
    'EFFORT_LIMIT',
    'MOTOR_WEAK',
    'SLIDE',
    'NO_SUPPORT',
    'ARM_ON_GROUND',
    'STATIC_MODEL',
    'INPUT_STALE',
    'INPUT_SLOW',
    'JOINTS_REPEATED',
    'INPUT_INCOMPLETE',
    'INPUT_INVALID',
    'ENCODER_FROZEN',
    'POSITION_LEAP',
    'IMU_FRAME',
    'IMU_ORIENTATION',
    'IMU_GRAVITY',
    'IMU_INCONSISTENT',
    'IMU_NO_GRAVITY',
    'IMU_FROZEN',
    'IMU_CONTRADICTION',
    'IMU_RATES',
    'IMU_ROTATION',
    'IMU_MOUNTING',
    'IMU_MOUNTING_UNKNOWN',
    'IMU_UNIT',
    'IMU_TWO_SOURCES',
    'PAYLOAD_INVALID',
    'LIMITS_RELAXED',
    'CLOCK',
)
# What the card adds to what a level says to do, where a step asks for it.
_EXPECTED_HERE = {
    'CAUTION': ', unless this step must show it',
    'DANGER': ', unless this step must show it',
}
# Lines of a step's preparation that say ground and load, which stand in their own rows.
GROUND_AND_LOAD = 2


@dataclass(frozen=True, slots=True)
class Row:
    """A step as texts for the card; what its whole group has in common is left out."""

    step: Step
    number: str
    posture: str
    expected: str
    ground: str
    load: str
    before: tuple[str, ...]
    sketch: str
    must_not: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Group:
    """One page of the card: the steps of a group, and the texts that hold for all of them."""

    name: str
    where: str
    rows: list[Row]
    preparation: list[str]
    must_not: list[str]
    stop: str


def card_of(plan: Plan, config: Config) -> str:
    """Return the operator's card as one self-contained HTML page."""
    environment = Environment(
        loader=PackageLoader('ugv_acceptance.plan'), autoescape=True, undefined=StrictUndefined
    )
    environment.filters['pattern'] = pattern_words
    template = environment.get_template('card.html')
    arm = Arm(config.settings)
    order = sorted(plan.steps, key=lambda s: (s.where, _first(plan, s.group)))
    groups = [
        group_of(arm, plan, list(steps))
        for _, steps in groupby(order, key=lambda s: (s.where, s.group))
    ]
    return template.render(
        plan=plan,
        config=config,
        version=__version__,
        groups=groups,
        levels=_levels(),
        meanings=[
            (code, of_robot(ALERTS[code].meaning, arm.robot), advice(code, arm.robot))
            for code in SHOWN
        ],
        maps=safe_maps(arm, plan),
        ground=ground_words(config.settings.ground.kind),
        length=time_text(duration(plan), digits=2),
        home=_text(arm.robot, plan.home_deg),
        arm=bool(arm.varied),
        standing=standing_words(arm),
        notes=notes_of(config),
    )


def _levels() -> list[tuple[str, str, str]]:
    """Return each level with what it means and what to do, and what to do after a fall."""
    found = [(word, text, do + _EXPECTED_HERE.get(word, '')) for word, (text, do) in MEANS.items()]
    what, _, do = STAND_CLEAR.partition(': ')
    return [*found, ('after a fall', what, do)]


def _first(plan: Plan, group: str) -> int:
    return next(k for k, step in enumerate(plan.steps) if step.group == group)


def group_of(arm: Arm, plan: Plan, steps: list[Step]) -> Group:
    """Return the page of a group's steps."""
    common = [text for text in steps[0].preparation if all(text in s.preparation for s in steps)]
    never = [p for p in steps[0].alerts.must_not if all(p in s.alerts.must_not for s in steps)]
    rows = [row_of(arm, plan, step, common, never) for step in steps]
    return Group(steps[0].group, steps[0].where, rows, common, never, steps[0].stop)


def row_of(arm: Arm, plan: Plan, step: Step, common: Sequence[str], never: Sequence[str]) -> Row:
    """Return a step's texts; joints at home, and what the group has in common, are left out."""
    moved = {n: a for n, a in step.posture_deg.items() if a != plan.home_deg.get(n)}
    expected = [_EXPECTED[key](x) for key, x in step.expected.items() if key in _EXPECTED]
    q = np.array(vector_of(arm.robot, plan.home_deg, step.posture_deg))
    return Row(
        step,
        step.id.partition('-')[0],
        _text(arm.robot, moved) or 'home',
        ', '.join(expected),
        _ground(step),
        f'{step.payload_kg:g} kg' if step.payload_kg else 'none',
        tuple(p for p in step.preparation[GROUND_AND_LOAD:] if p not in common),
        sketch(arm, q, step),
        tuple(p for p in step.alerts.must_not if p not in never),
    )


# What the model expects of a step, by the keys of a plan.
_EXPECTED: dict[str, Callable[[float], str]] = {
    'tilt_left_deg': lambda x: (
        f'{degrees_words(math.radians(x))} to tipping'
        if x >= 0.0
        else f'{excess_words(math.radians(-x))} past tipping'
    ),
    'use': lambda x: f'{share_words(x)} of the torque limit',
}


def _ground(step: Step) -> str:
    """Return what a step's ground is, and what that means for the tilt left."""
    ground = step.ground
    words = ORIENTATIONS[ground.orientation].words
    text = f'ramp of {ground.tilt_deg:g}°, {words}' if ground.tilt_deg else words
    if ground.kind in (None, FLAT):
        return text
    judged = 'by the trend' if ground.accept else 'not judged as passed'
    return f'{ground.kind}; {text} (tilt left is an upper bound; tip-over {judged})'


def _text(robot: Robot, posture: Posture) -> str:
    slides = {joint.name for joint in robot.joints if joint.slides}
    return ', '.join(
        f'{n.removesuffix("_joint")} {a:g}{" m" if n in slides else "°"}'
        for n, a in posture.items()
    )
