"""The paper's planar two-link arm: equations (1)-(8), Table 1 and the two-link inverse dynamics.

These closed forms check the general code for any tree; `paper_arm` is the same arm as a Robot.
Angles in rad, theta1 from the horizontal, theta2 from link 1, both positive upwards.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance.model.robot import Joint, Link, Matrix, Payload, Robot
from ugv_acceptance.studies.intervals import Intervals, where_cosine_between
from ugv_acceptance.type_aliases import Floats

TURN = 2.0 * math.pi
# A cosine below this counts as zero: that of pi/2 as a float is 6e-17.
_ZERO = 1e-12


@dataclass(frozen=True, slots=True)
class PlanarArm:
    """Lengths (m), masses (kg) and load (kg) of the two links, as in the paper.

    `offset1` and `offset2` (m) move each link's centre of gravity from its middle towards its end.
    """

    length1: float = 0.55
    length2: float = 0.64
    mass1: float = 2.5
    mass2: float = 2.5
    load: float = 4.0
    offset1: float = 0.0
    offset2: float = 0.0
    gravity: float = 9.81

    @property
    def centre1(self) -> float:
        """Distance of link 1's centre of gravity from joint 1 (m)."""
        return self.length1 / 2.0 + self.offset1

    @property
    def centre2(self) -> float:
        """Distance of link 2's centre of gravity from joint 2 (m)."""
        return self.length2 / 2.0 + self.offset2

    @property
    def moment1(self) -> float:
        """Factor of cos(theta1) in equation (1), N m."""
        first = self.mass1 * self.centre1 + (self.mass2 + self.load) * self.length1
        return first * self.gravity

    @property
    def moment2(self) -> float:
        """Factor of cos(theta1 + theta2) in equations (1) and (2), N m."""
        return (self.mass2 * self.centre2 + self.load * self.length2) * self.gravity

    @property
    def inertia1(self) -> float:
        """Inertia of link 1 as a slender rod about its centre of gravity (kg m2)."""
        return self.mass1 * self.length1**2 / 12.0

    @property
    def inertia2(self) -> float:
        """Inertia of link 2 as a slender rod about its centre of gravity (kg m2)."""
        return self.mass2 * self.length2**2 / 12.0


PAPER = PlanarArm()


def planar_torque(arm: PlanarArm, theta1: ArrayLike, theta2: ArrayLike) -> tuple[Floats, Floats]:
    """Return tau_1 and tau_2 (N m) at rest: equations (1) and (2)."""
    theta1 = np.asarray(theta1, dtype=np.float64)
    tau2: Floats = arm.moment2 * np.cos(theta1 + theta2)
    tau1: Floats = arm.moment1 * np.cos(theta1) + tau2
    return tau1, tau2


def planar_dynamics(
    arm: PlanarArm, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike
) -> tuple[Floats, Floats]:
    """Return tau_1 and tau_2 (N m) of the moving arm: inverse dynamics of two rods and the load.

    `q` (rad), `qd` (rad/s) and `qdd` (rad/s2) have shape (..., 2).
    """
    q, qd, qdd = (np.asarray(x, dtype=np.float64) for x in (q, qd, qdd))
    static1, static2 = planar_torque(arm, q[..., 0], q[..., 1])
    l1, c2 = arm.length1, arm.centre2
    coupling = l1 * (arm.mass2 * c2 + arm.load * arm.length2)
    inner = arm.inertia2 + arm.mass2 * c2**2 + arm.load * arm.length2**2
    outer = arm.inertia1 + arm.mass1 * arm.centre1**2 + (arm.mass2 + arm.load) * l1**2
    cosine, sine = coupling * np.cos(q[..., 1]), coupling * np.sin(q[..., 1])
    v1, v2, a1, a2 = qd[..., 0], qd[..., 1], qdd[..., 0], qdd[..., 1]
    tau1 = (outer + inner + 2.0 * cosine) * a1 + (inner + cosine) * a2
    tau1 = tau1 - sine * (2.0 * v1 * v2 + v2 * v2) + static1
    tau2 = (inner + cosine) * a1 + inner * a2 + sine * v1 * v1 + static2
    return tau1, tau2


def worst_theta2(theta1: float) -> tuple[float, ...]:
    """Return the theta2 in [0, 2 pi] at which |tau_1| and |tau_2| are largest: Table 1.

    Equation (3) puts the extrema at sin(theta1 + theta2) = 0; link 2 then lies to the side to which
    link 1 leans, and to both sides when link 1 is upright.
    """
    lean = math.cos(theta1)
    roots: set[float] = set()
    if lean > -_ZERO:
        roots.add(-theta1 % TURN)
    if lean < _ZERO:
        roots.add((math.pi - theta1) % TURN)
    if any(min(root, TURN - root) < _ZERO for root in roots):  # 0 and 2 pi are one posture
        roots = {root for root in roots if min(root, TURN - root) >= _ZERO} | {0.0, TURN}
    return tuple(sorted(roots))


def safe_theta2(
    arm: PlanarArm, theta1: float, limit1: float, limit2: float, *, two_sided: bool = True
) -> Intervals:
    """Return the intervals of theta2 in [0, 2 pi] in which neither joint exceeds its limit (N m).

    One-sided is the paper's reading, equations (4)-(8): only a torque above +limit is a failure.
    Two-sided holds |tau| <= limit, which is what a motor does.
    """
    first = arm.moment1 * math.cos(theta1)
    upper = min(limit1 - first, limit2) / arm.moment2
    lower = max(-limit1 - first, -limit2) / arm.moment2 if two_sided else -math.inf
    return where_cosine_between(lower, upper, -theta1)


def _rod(inertia: float) -> Matrix:
    return ((0.0, 0.0, 0.0), (0.0, inertia, 0.0), (0.0, 0.0, inertia))


def arm_robot(arm: PlanarArm, limit: float = math.inf) -> Robot:
    """Return the arm as a Robot: x forward, z up, joints theta1 and theta2, both turning about -y.

    `limit` (N m) is the effort limit of both joints.
    """
    axis = (0.0, -1.0, 0.0)
    links = (
        Link('base'),
        Link('link1', arm.mass1, (arm.centre1, 0.0, 0.0), _rod(arm.inertia1)),
        Link('link2', arm.mass2, (arm.centre2, 0.0, 0.0), _rod(arm.inertia2)),
    )
    joints = (
        Joint('theta1', 'continuous', 'base', 'link1', axis=axis, effort=limit),
        Joint(
            'theta2',
            'continuous',
            'link1',
            'link2',
            xyz=(arm.length1, 0.0, 0.0),
            axis=axis,
            effort=limit,
        ),
    )
    return Robot(
        'planar arm',
        links,
        joints,
        ('theta1', 'theta2'),
        payload_link='link2',
        payload=Payload(arm.load, (arm.length2, 0.0, 0.0)),
        gravity=arm.gravity,
    )


def paper_arm(offset1: float = 0.0, offset2: float = 0.0) -> Robot:
    """Return the paper's arm as a Robot, its centres of gravity moved from mid-link (m)."""
    return arm_robot(PlanarArm(offset1=offset1, offset2=offset2))
