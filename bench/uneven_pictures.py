"""Draws the scenes of uneven_scenes.py, each with the robot on it, into docs/images.

MUJOCO_GL=egl python -m bench.uneven_pictures
"""

from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np

from bench.uneven_scenes import BUILD, Belts, drive_step, scene, touching, tracked
from bench.uneven_trial import attitude_of
from ugv_acceptance.config import load
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.vehicle import Vehicle

mpl.use('Agg')
from matplotlib import pyplot as plt

PICTURE = Path(__file__).parent.parent / 'docs/images/uneven_scenes.png'
# Arm (turret, shoulder, elbow; rad) of the pictures.
ARM = {'turret_joint': 0.0, 'shoulder_joint': 2.0, 'elbow_joint': -2.2}
# Scene, start (x, z in m), pitch, flippers (rad), and how long (s) it drives at 0.3 m/s before.
SHOTS = (
    ('stairs_up', (-0.9, 0.0), 0.0, 0.78, 2.8),
    ('stairs_down', (1.2, 1.21), -0.70, 0.0, 0.0),
    ('ramps', (-0.8, 0.0), 0.0, 0.0, 4.0),
    ('stepfield', (-0.8, 0.0), 0.0, 0.6, 5.0),
    ('hurdle', (-1.0, 0.0), 0.0, 0.78, 2.6),
    ('drop', (-0.5, 0.35), 0.0, 0.0, 1.5),
)
# Width and height of a picture, and the colours of ground, hull, belts and arm.
SIZE = (620, 420)
GROUND, HULL, BELT, ARM_RGB, TOUCH = (
    (0.78, 0.76, 0.7, 1.0),
    (0.35, 0.42, 0.3, 1.0),
    (0.15, 0.15, 0.15, 1.0),
    (0.85, 0.45, 0.1, 1.0),
    (0.9, 0.0, 0.0, 1.0),
)


def main() -> None:
    """Draw all scenes into one picture."""
    robot = load().settings.robot
    figure, axes = plt.subplots(2, 3, figsize=(13.5, 6.4))
    for axis, (name, (x, z), pitch, flippers, length) in zip(axes.flat, SHOTS, strict=True):
        vehicle = tracked(robot, scene(name, 4))
        data = mujoco.MjData(vehicle.model)
        posture = [ARM.get(joint, flippers) for joint in robot.joint_names]
        data.qpos[vehicle.position] = data.ctrl[vehicle.motor] = posture
        mujoco.mju_mat2Quat(data.qpos[3:7], attitude_of(0.0, pitch).reshape(9))
        data.qpos[:3] = x, 0.0, z + 0.02
        belts = Belts.of(vehicle.model)
        for k in range(round((length + 0.8) / BUILD.timestep)):
            speed = 0.3 if k * BUILD.timestep > 0.8 else 0.0
            drive_step(vehicle, data, belts, (speed, 0.0))
        axis.imshow(_shot(vehicle, data))
        axis.set_title(name.replace('_', ' '))
        axis.axis('off')
    figure.tight_layout()
    figure.savefig(PICTURE, dpi=80)


def _shot(vehicle: Vehicle, data: mujoco.MjData) -> np.ndarray:
    """Return a picture: arm as sticks, points where the ground is touched as red balls."""
    model = vehicle.model
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.45, 0.7
    for k in range(model.ngeom):
        name = model.geom(k).name
        belt = BELT if name.startswith('belt') else GROUND
        model.geom_rgba[k] = HULL if name == 'hull' else belt
    camera = mujoco.MjvCamera()
    camera.lookat[:] = data.xpos[vehicle.root] + [0.1, 0.0, 0.1]
    camera.distance, camera.azimuth, camera.elevation = 2.4, 65.0, -14.0
    with mujoco.Renderer(model, SIZE[1], SIZE[0]) as renderer:
        renderer.update_scene(data, camera)
        links = ('turret_link', 'arm_link_1', 'arm_link_2', 'gripper_link')
        for first, last in pairwise(links):
            _add(renderer.scene, data.body(first).xpos, data.body(last).xpos)
        for point in touching(data):
            _add(renderer.scene, point, None)
        picture: np.ndarray = renderer.render().copy()
    return picture


def _add(scene: mujoco.MjvScene, start: np.ndarray, end: np.ndarray | None) -> None:
    geom = scene.geoms[scene.ngeom]
    ball = mujoco.mjtGeom.mjGEOM_SPHERE if end is None else mujoco.mjtGeom.mjGEOM_CAPSULE
    colour = np.array(TOUCH if end is None else ARM_RGB, dtype=np.float32)
    mujoco.mjv_initGeom(geom, ball, np.full(3, 0.016), start, np.eye(3).reshape(9), colour)
    if end is not None:
        mujoco.mjv_connector(geom, ball, 0.02, start, end)
    scene.ngeom += 1


if __name__ == '__main__':
    main()
