"""The margins of a part of a recording as columns, which summary, criteria and files work on."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.inputs.imu import ImuRows
from ugv_acceptance.evaluation.inputs.joint_rows import JointRows
from ugv_acceptance.type_aliases import Floats, Times


@dataclass(frozen=True, slots=True)
class Pairs:
    """Which joint row and which IMU row were the newest at every row of margins.

    `of_joints` and `of_imu` (n,) are row numbers in `joints` and `imu`.
    """

    joints: JointRows
    imu: ImuRows
    of_joints: NDArray[np.intp]
    of_imu: NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class ChassisRows:
    """What stands out of a part's IMU messages: the chassis turns or is pushed hard.

    `rows` (m,) are rows of the part's margins. `moving` (m, 4) rad is the tilt left to each of
    SIDES with the energy of the turn, `effective` (m, 4) rad that under effective gravity felt at
    the edge, infinite where it was not judged; `lifted` (m, 4) says where an end lifts, `denied`
    (m, 4) where one sensor of the IMU shows it past tipping and another that it does not turn.
    Seconds of the part with margins; of these judged, and with an accelerometer that shows gravity;
    without a gyro; with an IMU below 50 Hz.
    """

    rows: NDArray[np.intp]
    moving: Floats
    effective: Floats
    lifted: NDArray[np.bool_]
    denied: NDArray[np.bool_]
    known_s: float = 0.0
    judged_s: float = 0.0
    believed_s: float = 0.0
    no_gyro_s: float = 0.0
    slow_s: float = 0.0


_NONE = np.zeros((0, 4))
NO_CHASSIS_ROWS = ChassisRows(np.zeros(0, np.intp), _NONE, _NONE, _NONE > 0.0, _NONE > 0.0)


@dataclass(frozen=True, slots=True)
class GroundRows:
    """What the ground of a part's rows is taken for; both empty where it is flat all the time.

    `kind` (n,) is a number in ground.KINDS, `cautious` (n, 4) rad the tilt left to each of SIDES
    with shortened tracks, NaN on flat ground and where margins are not known.
    """

    kind: NDArray[np.int8]
    cautious: Floats


NO_GROUND_ROWS = GroundRows(np.zeros(0, np.int8), _NONE)


@dataclass(frozen=True, slots=True)
class MarginRows:
    """Margins of a part of a recording, one row a message of either input, in order of receipt.

    `time` of receipt, `stamp` of the header (ns). `until` (ns) is how long a row holds: to the next
    message or until an input is stale. `known` says which rows have margins; the others are NaN and
    their `state` is UNKNOWN. Torques (n, j) in N m (N), angles (n, 4) rad to SIDES. Moments (n, 4)
    N m, energies (n, 4) J and ZMP distance (n,) m are empty unless the evaluator computes them.
    `clearance` (n,) m is how high the arm is above the ground, also where it stands on it and
    nothing else is known; `touches` (n,) says where it does so with permission: torques are NaN.
    """

    time: Times
    stamp: Times
    until: Times
    known: NDArray[np.bool_]
    torque: Floats
    angle: Floats
    state: NDArray[np.int8]
    moment: Floats
    energy: Floats
    zmp: Floats
    pairs: Pairs
    chassis: ChassisRows = NO_CHASSIS_ROWS
    ground: GroundRows = NO_GROUND_ROWS
    clearance: Floats = field(default_factory=lambda: np.zeros(0))
    touches: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))

    @property
    def weighed(self) -> NDArray[np.bool_]:
        """Which rows have torques (n,): all that are known but where the hand may stand."""
        return self.known & ~self.touches if self.touches.any() else self.known

    @property
    def q(self) -> Floats:
        """Joint positions (n, j), rad or m."""
        return self.pairs.joints.q[self.pairs.of_joints]

    @property
    def qd(self) -> Floats:
        """Joint rates (n, j), rad/s or m/s, NaN where not reported."""
        return self.pairs.joints.qd[self.pairs.of_joints]

    @property
    def effort(self) -> Floats:
        """Measured efforts (n, j), N m or N, NaN where not reported."""
        return self.pairs.joints.effort[self.pairs.of_joints]

    @property
    def gravity(self) -> Floats:
        """Effective gravity (n, 3), m/s2 in `base_link`."""
        return self.pairs.imu.gravity[self.pairs.of_imu]
