"""A test plan as data: steps that people read and edit in YAML, and its hash.

Angles are in degrees here, as in the file, and positions of joints that slide in m; `radians_of`
converts the angles to radians.
"""

import hashlib
import json
import math
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from ugv_acceptance import BadConfig
from ugv_acceptance.config.build import checked
from ugv_acceptance.config.document import read_document
from ugv_acceptance.config.files import text as text_of
from ugv_acceptance.config.poses import pose_named
from ugv_acceptance.config.seal import sealed
from ugv_acceptance.evaluation.alerts.messages import RECORDED
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS
from ugv_acceptance.model.robot import Robot, Vector
from ugv_acceptance.studies.orientations import ORIENTATIONS, gravity_of

ROBOT: Literal['robot'] = 'robot'
SIMULATION: Literal['simulation'] = 'simulation'


def _alert(text: str) -> str:
    parts = text.split()
    level, code = parts[0] if parts else '', parts[1] if len(parts) > 1 else None
    if level not in LEVELS[1:] or (code is not None and code not in RECORDED) or len(parts) > 3:
        raise ValueError(f'expected LEVEL [CODE [SUBJECT]], such as ERROR TIP_OVER, got {text!r}')
    return text


def _orientation(text: str) -> str:
    if text not in ORIENTATIONS:
        raise ValueError(f'expected one of {", ".join(ORIENTATIONS)}, got {text!r}')
    return text


AlertPattern = Annotated[str, AfterValidator(_alert)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0)]
Posture = dict[str, Finite]


class _Part(BaseModel):
    model_config = ConfigDict(extra='forbid', frozen=True)


class Ground(_Part):
    """The ground of a step: one of the orientations of the paper's Figure 6, and its tilt (deg).

    `kind` is flat, uneven or stairs; None: as the robot's configuration says. Where it is not flat
    a step passes only if it says which rule it accepts for tip-over (`accept`), and the `reason`.
    """

    orientation: Annotated[str, AfterValidator(_orientation)] = 'level'
    tilt_deg: Annotated[Finite, Field(ge=0, le=60)] = 0.0
    kind: Literal['flat', 'uneven', 'stairs'] | None = None
    accept: Literal['trend'] | None = None
    reason: Annotated[str, Field(min_length=1)] | None = None

    @model_validator(mode='after')
    def _reasoned(self) -> 'Ground':
        if (self.accept is None) != (self.reason is None):
            raise ValueError('expected accept and reason together, or neither')
        return self


class Alerts(_Part):
    """Alerts a step must raise and those it must not, written LEVEL, LEVEL CODE or with SUBJECT."""

    must: tuple[AlertPattern, ...] = ()
    must_not: tuple[AlertPattern, ...] = ('ERROR', 'STALE')


class Step(_Part):
    """One step of a plan, with all that the operator needs to know before it.

    `action` is hold: go to the posture and hold it. tip: the same, and the robot is expected to
    tip over. sweep: move on from `via_deg` at `speed_degps`. drive: m/s and deg/s for `hold_s`.
    pull: a person pulls with `force_n`. cycle: the postures of `via_deg` again and again for
    `hold_s`. `expected` are the model's margins, for the reader. With `hand_may_touch` the arm may
    touch the ground, to pick something up: torques are not judged while it does. `posture` names a
    pose of the robot's configuration; `posture_deg` then only has what differs from it, until
    `read_plan` fills in the pose's own angles.
    """

    id: Annotated[str, Field(min_length=1, pattern=r'^[A-Za-z0-9_-]+$')]
    group: str
    title: str
    purpose: str
    where: Literal['robot', 'simulation'] = ROBOT
    action: Literal['hold', 'tip', 'sweep', 'drive', 'pull', 'cycle'] = 'hold'
    preparation: tuple[str, ...] = ()
    ground: Ground = Ground()
    payload_kg: Annotated[Finite, Field(ge=0)] = 0.0
    posture: str = ''
    posture_deg: Posture = {}
    via_deg: tuple[Posture, ...] = ()
    speed_degps: Positive = 20.0
    hold_s: Positive = 3.0
    drive: tuple[Finite, Finite] | None = None
    force_n: Positive | None = None
    hand_may_touch: bool = False
    limits: dict[str, Finite] = {}
    expected: dict[str, Finite] = {}
    alerts: Alerts = Alerts()
    stop: str = 'stop at any DANGER or NO DATA alert that is not expected'

    @model_validator(mode='after')
    def _whole(self) -> 'Step':
        if not self.posture and 'posture_deg' not in self.model_fields_set:
            raise ValueError(
                'expected posture_deg, or posture with the name of a pose, got neither'
            )
        if self.action == 'drive' and self.drive is None:
            raise ValueError('expected drive: [m/s, deg/s] in a step of action drive, got none')
        if self.action == 'pull' and self.force_n is None:
            raise ValueError('expected force_n in a step of action pull, got none')
        if self.action in {'cycle', 'sweep'} and not self.via_deg:
            raise ValueError(f'expected postures in via_deg for action {self.action}, got none')
        return self

    def gravity(self, size: float) -> Vector:
        """Return gravity (m/s2) in `base_link` on this step's ground."""
        return gravity_of(self.ground.orientation, math.radians(self.ground.tilt_deg), size)


class Plan(_Part):
    """A plan: the robot it is for, the configuration it comes from, and its steps in order."""

    plan: str
    robot: str
    config_sha256: str
    tolerance_deg: Positive = 2.0
    home_deg: Posture
    steps: Annotated[tuple[Step, ...], Field(min_length=1)]

    @model_validator(mode='after')
    def _distinct(self) -> 'Plan':
        ids = [step.id for step in self.steps]
        twice = sorted({i for i in ids if ids.count(i) > 1})
        if twice:
            raise ValueError(f'expected a different id for every step, got {twice[0]} twice')
        return self

    @property
    def sha256(self) -> str:
        """SHA-256 of the plan's content; comments and the order of keys do not change it."""
        plain = self.model_dump(mode='json')
        for step in plain['steps']:  # keys that a plan may leave out; old plans keep their hash
            if not step['posture']:
                del step['posture']
            for key in ('kind', 'accept', 'reason'):
                if step['ground'][key] is None:
                    del step['ground'][key]
        text = json.dumps(plain, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def radians_of(robot: Robot, posture: Posture) -> dict[str, float]:
    """Return a posture in radians; of joints that slide in m, as the plan has them."""
    slides = {joint.name for joint in robot.joints if joint.slides}
    return {n: angle if n in slides else math.radians(angle) for n, angle in posture.items()}


def vector_of(robot: Robot, home: Posture, posture: Posture) -> list[float]:
    """Return the positions (j,) in rad (m) of a posture; joints it does not name are at home."""
    known = radians_of(robot, {**home, **posture})
    return [known.get(name, 0.0) for name in robot.joint_names]


def matches(pattern: str, level: str, code: str, subject: str) -> bool:
    """Return whether an alert fits a pattern: LEVEL, LEVEL CODE or LEVEL CODE SUBJECT."""
    return all(a == b for a, b in zip(pattern.split(), (level, code, subject), strict=False))


def read_plan(path: Path, robot: Robot | None = None) -> Plan:
    """Return the plan in a YAML file. Raises BadConfig with file, line and field.

    With `robot`, every joint named in a posture must be one of this robot's, and so must be every
    pose, whose angles the steps that name it then have.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadConfig(f'{path}: expected a plan, got: {error.strerror}') from None
    document = read_document(text_of(content, path), str(path))
    plan = checked(document, Plan)
    if robot is None:
        return plan
    posed = [
        _posed(step, robot, document.where(('steps', k, 'posture')))
        for k, step in enumerate(plan.steps)
    ]
    for k, step in enumerate(posed):
        for posture in (step.posture_deg, *step.via_deg, plan.home_deg):
            unknown = sorted(set(posture) - set(robot.joint_names))
            if unknown:
                where = document.where(('steps', k, 'posture_deg'))
                raise BadConfig(f'{where}: expected joints of {plan.robot}, got {unknown[0]}')
    return plan.model_copy(update={'steps': tuple(posed)})


def _posed(step: Step, robot: Robot, where: str) -> Step:
    """Return a step with the angles of the pose that it names, if any, beside its own."""
    if not step.posture:
        return step
    pose = pose_named(robot, step.posture, where)
    angles = {name: math.degrees(at) for name, at in pose.items()}
    return step.model_copy(update={'posture_deg': {**angles, **step.posture_deg}})


def plan_text(plan: Plan) -> str:
    """Return a plan as YAML: a header that explains it, a last line with a hash to detect edits."""
    data = plan.model_dump(mode='json', exclude_defaults=True)
    for step, whole in zip(data['steps'], plan.steps, strict=True):
        step['alerts'] = whole.alerts.model_dump(mode='json')
        step['where'] = whole.where
        step.setdefault('posture_deg', {})
    body = yaml.safe_dump(data, sort_keys=False, width=100, allow_unicode=True)
    return sealed(f'{HEAD}\n{body}')


HEAD = """\
# A test plan made by `ugv-acceptance plan`; edit it as you like. Every run notes the plan's hash.
# where: robot = run on the robot and in simulation; simulation = would fail, so only simulated.
# alerts.must: have to be raised; alerts.must_not: must not be active while the posture is held.
# A pattern is LEVEL, LEVEL CODE or LEVEL CODE SUBJECT, such as: ERROR TIP_OVER left
# LEVEL is WARN, ERROR or STALE; people read it as CAUTION, DANGER or NO DATA."""
