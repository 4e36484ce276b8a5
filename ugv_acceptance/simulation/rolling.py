"""What a simulated robot rolls on: its own wheels, or a row of wheels below each of its tracks."""

import math
from dataclasses import dataclass

from ugv_acceptance.model.robot import Contact, Joint, Robot
from ugv_acceptance.model.roles import UPRIGHT, Wheel, chain_to, direction_of, roles_of, wheels_of
from ugv_acceptance.simulation import shape

# The most torque (N m) of a wheel below a track; the gain of a wheel's velocity servo (N m s/rad)
# and the inertia of its rotor (kg m2) per N m of torque, below a track and of a real wheel, which
# has to turn on the spot against its own friction. MuJoCo lets a stiffer servo overshoot.
TRACK_TORQUE = 40.0
TRACK_SERVO, WHEEL_SERVO = (0.5, 0.0005), (1.0, 0.001)
# How often all wheels together hold the robot on a wall.
STRONG = 2.0
# A caster's friction, which rolls: what its bearings and its trail take.
CASTER_FRICTION = 0.02
# Radius of a wheel below a track, at most: share of half the length of the contact.
ROUND = 0.4


@dataclass(frozen=True, slots=True)
class Roller:
    """A driven wheel of the simulation.

    `name` is that of its joint and motor in MuJoCo, `joint` that of the URDF (None: below a track),
    `contacts` the points it stands on, `y` (m) its place to the left in `base_link` and `radius`
    (m) its own. It turns by `forward` times what drives the robot ahead: 1, -1 where its axis
    points right, 0 where it stands across. `torque` (N m) is what it gives, `brake` what its brake
    holds, `gain` (N m s/rad) that of its velocity servo, `rotor` (kg m2) its inertia beside that
    of the URDF.
    """

    name: str
    joint: str | None
    contacts: tuple[Contact, ...]
    y: float
    radius: float
    forward: float
    torque: float
    brake: float
    gain: float
    rotor: float


def rollers_of(robot: Robot, radius: float, *, whole: bool) -> tuple[Roller, ...]:
    """Return the driven wheels of a robot: those of its tree, else one at every end of its tracks.

    `radius` (m) is the latter's at most; `whole` puts some between the ends of each track too.
    """
    driven = driven_wheels(robot)
    if not driven:
        return _below_tracks(robot, radius, whole=whole)
    weight = (robot.mass + robot.payload.mass) * robot.gravity
    found = []
    for wheel in driven:
        hold = STRONG * weight * wheel.radius / len(driven)
        across = wheel.axis[1]
        forward = math.copysign(1.0, across) if abs(across) > 0.5 else 0.0
        torque = min(hold, robot.joint(wheel.joint).effort)
        y = wheel.axle[1]
        of = wheel.joint, wheel.joint, wheel.contacts, y, wheel.radius
        servo = (share * hold for share in WHEEL_SERVO)
        found.append(Roller(*of, forward, torque, hold, *servo))
    return tuple(found)


def driven_wheels(robot: Robot) -> tuple[Wheel, ...]:
    """Return the wheels that stand on the ground and do not swivel as casters do."""
    standing = tuple(wheel for wheel in wheels_of(robot) if wheel.contacts)
    fixed = tuple(wheel for wheel in standing if not _swivels(robot, wheel))
    return fixed or standing


def _swivels(robot: Robot, wheel: Wheel) -> bool:
    joints = (robot.joint(name) for name in chain_to(robot, wheel.carrier))
    return any(j.kind == 'continuous' and _is_upright(robot, j) for j in joints)


def _is_upright(robot: Robot, joint: Joint) -> bool:
    return abs(direction_of(robot, joint)[2]) > UPRIGHT


def casters_of(robot: Robot) -> tuple[Contact, ...]:
    """Return the contact points that roll along where the driven wheels take them.

    All that are not below such a wheel, nor on a flipper, a leg or the arm; none without wheels.
    """
    driven = driven_wheels(robot)
    if not driven:
        return ()
    roles = roles_of(robot)
    limbs = {*roles.flippers, *roles.legs, *roles.arm}
    under = {contact.name for wheel in driven for contact in wheel.contacts}
    return tuple(
        c for c in robot.contacts if c.name not in under and not limbs & {*chain_to(robot, c.link)}
    )


def _below_tracks(robot: Robot, radius: float, *, whole: bool) -> tuple[Roller, ...]:
    contacts = shape.track_wheels(robot, whole=whole)
    if not contacts:
        return ()
    along = [contact.position[0] for contact in contacts]
    half = (max(along) - min(along)) / 2.0
    small = min(radius, ROUND * half) if half > 0.0 else radius
    weight = (robot.mass + robot.payload.mass) * robot.gravity
    torque = max(TRACK_TORQUE, STRONG * weight * small / len(contacts))
    rest = 1.0, torque, torque, *(share * torque for share in TRACK_SERVO)
    return tuple(
        Roller(f'wheel:{c.name}', None, (c,), c.position[1], small, *rest) for c in contacts
    )
