"""Random numbers of a run, within bounds fixed beforehand, and the calm run a fault is put in."""

import math
import tempfile
from ast import literal_eval
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from made.judged import Expected
from made.run import Part
from made.scene import IMU_HZ, JOINTS_HZ, Scene, driving, eased, level, wander
from made.subjects import Subject
from made.truth import NONE, Load, torques

from ugv_acceptance.config import Config, load
from ugv_acceptance.type_aliases import Floats

UP = np.array((0.0, 0.0, 1.0))


@dataclass
class Draw:
    """The generator of a run: `draw('start_s')` is uniform within the bounds of that name.

    `drawn` keeps what came, so that a run can be understood afterwards. `folder` is where
    configurations are written.
    """

    rng: np.random.Generator
    bounds: Mapping[str, Any]
    subject: Subject
    folder: Path
    drawn: dict[str, Any] = field(default_factory=dict)

    def __call__(self, name: str) -> float:
        """Return a number within its bounds."""
        least, most = self.bounds[name]
        value = float(self.rng.uniform(least, most))
        self.drawn[name] = round(value, 4)
        return value

    def pick(self, name: str) -> str:
        """Return one of the words listed under this name."""
        words = self.bounds[name]
        value = str(words[int(self.rng.integers(len(words)))])
        self.drawn[name] = value
        return value

    def config(self, changes: Mapping[str, Any] | None = None) -> Config:
        """Return the robot's configuration with changes."""
        return configured(self.subject, repr(sorted((changes or {}).items())), self.folder)


@dataclass(frozen=True, slots=True)
class Made:
    """A run: its messages, what is true of it, and how it is judged.

    `expected` None: as the plan says of its kind. `pardon`: a PASS is right if what is told matches
    this pattern. `criteria` are those of a file, None the default ones.
    """

    parts: list[Part]
    truth: str
    config: Config
    expected: Expected | None = None
    pardon: str = ''
    criteria: Mapping[str, Any] | None = None


@lru_cache(maxsize=200)
def configured(subject: Subject, changes: str, folder: Path) -> Config:
    """Return a configuration with changes (the repr of pairs), read once a process."""
    own = Path(tempfile.mkdtemp(dir=folder))
    return load(subject.config(own, dict(literal_eval(changes))))


def calm(draw: Draw, load: Load | None = None, config: Config | None = None) -> Scene:
    """Return ordinary work that really keeps the distances the plan asks for.

    On a slope, perhaps driving, the arm slow; `load` None: something that is no strain.
    """
    settings, used = draw.bounds, config or draw.config()
    slope, aim = math.radians(draw('slope_deg')), float(draw.rng.uniform(0.0, 2.0 * math.pi))
    reach, rate = math.radians(draw('reach_deg')), math.radians(draw('rate_degps'))
    drives = draw.pick('drives') == 'yes'
    carried = load if load is not None else Load(mass_for(draw, used, draw('calm_share')))
    for attempt in range(30):
        less = 0.75**attempt
        scene = level(draw.subject, used, settings['seconds'], carried)
        scene = replace(
            wander(scene, draw.rng, reach * less, rate),
            roll=scene.roll + less * slope * math.cos(aim),
            pitch=scene.pitch + less * slope * math.sin(aim),
        )
        scene = driving(scene, draw.rng, 0.8, 0.4) if drives else scene
        if scene.truth().good(settings['least_tip_deg'], settings['most_share']):
            return scene
    msg = f'{draw.subject.name}: expected a calm pose that keeps its distances, found none'
    raise ValueError(msg)


def mass_for(draw: Draw, config: Config, share: float) -> float:
    """Return the mass (kg) with which the arm stretched out loads its weak joint to this share.

    0 where the arm alone is more, or where there is no arm.
    """
    subject, robot = draw.subject, config.settings.robot
    if subject.weak is None or robot.payload_link is None:
        return 0.0
    limit = draw.config().settings.limits.torque[subject.weak]
    pose = np.array(subject.reach)[None]
    none, one = (torques(robot, pose, UP, w)[0, subject.weak] for w in (NONE, Load(1.0)))
    alone, more = abs(float(none)), abs(float(one - none))
    return max(0.0, (share * limit - alone) / more)


def window(time: Floats, start: float, rise: float, hold: float) -> Floats:
    """Return a value that goes smoothly from 0 to 1 at `start` (s), holds, and goes back."""
    top = start + rise
    knots = [(0.0, 0.0), (start, 0.0), (top, 1.0), (top + hold, 1.0), (top + hold + rise, 0.0)]
    return eased(time, [*knots, (1e6, 0.0)])


def leaning(draw: Draw, scene: Scene, shape: Floats, past: float) -> Scene:
    """Return the scene in which the robot leans `past` (rad) over where it tips, if `shape` is 1.

    To a side drawn; `shape` is at the IMU's times.
    """
    row = int(np.argmax(shape)) * JOINTS_HZ // IMU_HZ
    truth = scene.truth()
    side = int(draw.rng.integers(len(truth.outward)))
    x, y, _ = truth.outward[side].tolist()
    still = replace(scene, q=np.tile(scene.q[row], (len(scene.q), 1)))
    left = math.radians(float(still.truth().edges[side]))
    draw.drawn['side'] = [round(x, 2), round(y, 2)]
    tilt, found = left + past, scene
    for _ in range(3):  # the slope it stands on makes it a little more or less
        roll, pitch = scene.roll - tilt * y * shape, scene.pitch + tilt * x * shape
        found = replace(scene, roll=roll, pitch=pitch)
        tilt += past + math.radians(float(found.truth().tip.min()))
    return found


def least_loaded(scene: Scene) -> Floats:
    """Return the pose (joints,) of the stretched arm in which its weak joint has least to hold."""
    subject, robot = scene.subject, scene.config.settings.robot
    assert subject.weak is not None
    poses = np.tile(np.array(subject.reach), (181, 1))
    low, high = robot.joint(robot.joint_names[subject.weak]).travel()
    turned = poses[:, subject.weak] + np.radians(np.arange(-90.0, 91.0))
    poses[:, subject.weak] = np.clip(turned, low + 0.01, high - 0.01)
    held = np.abs(torques(robot, poses, UP, scene.load)[:, subject.weak])
    best: Floats = poses[int(np.argmin(held))]
    return best


def reaching(scene: Scene, shape: Floats) -> Scene:
    """Return the scene with the arm stretched out where `shape` (at the joints' times) is 1."""
    pose = np.array(scene.subject.reach)
    return replace(scene, q=scene.q + shape[:, None] * (pose - scene.q))
