"""What is asked: a motion of joints, and the conditions under which it would begin."""

from dataclasses import dataclass

from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.type_aliases import Floats

# Time (s) in which a drive takes up another rate: 2.5 / w of a position servo of w = 50 rad/s.
CORNER = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """A planned motion, as trajectory_msgs/JointTrajectory has it.

    `names` (m) are those of the messages' topics, `times` (n,) s since the motion begins,
    `positions` (n, m) rad (m if prismatic) in the messages' sense: signs and offsets of the
    configuration are not applied yet. `velocities` and `accelerations` (n, m) are None where no
    point has any; a row of NaN is a point without.
    """

    names: tuple[str, ...]
    times: Floats
    positions: Floats
    velocities: Floats | None = None
    accelerations: Floats | None = None


@dataclass(frozen=True, slots=True)
class Conditions:
    """The conditions under which a motion would begin.

    `gravity` (m/s2) in base axes, None where the attitude is not known; (0, 0, -9.81) on level
    ground. `payload` is what the gripper carries during the motion, None where it is not known.
    `ground` is a kind of evaluation/ground.py, None: as the settings have it. `posture` (j) are
    the positions of all joints at the start (rad, m) in the robot's own sense, as `LiveMargins`'
    q; NaN where a joint's is not known, () where none is. `at_rest` says whether base and arm
    stand still. With `from_first_point` the joints of the trajectory are taken to stand at its
    first point already, whatever `posture` says of them: only where a person asks, never live.
    `corner` (s) is how long the drives take for a change of rate that the points ask for at once.
    """

    gravity: Vector | None
    payload: Payload | None
    ground: str | None = None
    posture: tuple[float, ...] = ()
    at_rest: bool = True
    from_first_point: bool = False
    corner: float = CORNER
