"""Robots of other makes for tests: a rover, an arm of six joints on wheels, a walking one."""

from math import pi

from robots import box

from ugv_acceptance.model.robot import IDENTITY, Contact, Joint, Link, Matrix, Payload, Robot

# Axles across the robot as makers write them: along y, or along z of a link rolled by -90 deg.
ACROSS = (0.0, 1.0, 0.0)
ROLLED: Matrix = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
UP = (0.0, 0.0, 1.0)
# Of the rover: half the wheelbase and track, radius of the wheels, width of a tyre (m).
HALF_BASE, HALF_TRACK, RADIUS, TYRE = 0.26, 0.28, 0.16, 0.1
# Height (m) of the axles above the root link.
AXLE = 0.03
CORNERS = {
    f'{end}_{side}': (x, y)
    for end, x in (('front', HALF_BASE), ('rear', -HALF_BASE))
    for side, y in (('left', HALF_TRACK), ('right', -HALF_TRACK))
}


def disc(mass: float, radius: float) -> Matrix:
    """Return the inertia of a thin disc that turns about y."""
    half = mass * radius**2 / 4.0
    return ((half, 0.0, 0.0), (0.0, 2.0 * half, 0.0), (0.0, 0.0, half))


def rover(*, measured: bool = True, payload_link: str | None = None) -> Robot:
    """Return a rover on four wheels, each with two contact points across its tyre.

    The wheels' joints are measured, or held at 0.
    """
    links = [Link('chassis', 30.0, (0.0, 0.0, 0.1), box(30.0, 0.8, 0.5, 0.3)), Link('imu')]
    joints = [Joint('imu_fixed', 'fixed', 'chassis', 'imu', (0.1, 0.0, 0.2))]
    contacts = []
    for name, (x, y) in CORNERS.items():
        links.append(Link(f'{name}_tyre', 2.5, inertia=disc(2.5, RADIUS)))
        axle = Joint(
            f'{name}_axle', 'continuous', 'chassis', f'{name}_tyre', (x, y, AXLE), axis=ACROSS
        )
        joints.append(axle)
        contacts += [
            Contact(f'{name}_{edge}', 'chassis', (x, y + off, AXLE - RADIUS))
            for edge, off in (('in', -TYRE / 2.0), ('out', TYRE / 2.0))
        ]
    axles = tuple(f'{name}_axle' for name in CORNERS)
    return Robot(
        'rover',
        tuple(links),
        tuple(joints),
        axles if measured else (),
        tuple(contacts),
        () if measured else tuple((name, 0.0) for name in axles),
        payload_link,
        ground=AXLE - RADIUS,
        contact_tolerance=0.003,
    )


def arm_on_wheels(load: float = 2.0) -> Robot:
    """Return the rover, wheels held, with an arm of six joints that no other robot's are named as.

    At zero it points ahead: j1 turns about the vertical, j2, j3 and j5 lift, j4 and j6 roll.
    """
    base = rover(measured=False)
    along = (1.0, 0.0, 0.0)
    # Parent, child, its mass, length of the child (m), where on the parent, axis, torque limit.
    parts = (
        ('chassis', 'pillar', 3.0, 0.0, (0.2, 0.0, 0.25), UP, 120.0),
        ('pillar', 'upper', 4.0, 0.4, (0.0, 0.0, 0.1), ACROSS, 120.0),
        ('upper', 'fore', 2.5, 0.3, (0.4, 0.0, 0.0), ACROSS, 80.0),
        ('fore', 'hand', 0.8, 0.05, (0.3, 0.0, 0.0), along, 20.0),
        ('hand', 'palm', 0.4, 0.05, (0.05, 0.0, 0.0), ACROSS, 20.0),
        ('palm', 'flange', 0.2, 0.02, (0.05, 0.0, 0.0), along, 10.0),
    )
    links = list(base.links)
    joints = list(base.joints)
    for k, (parent, child, mass, length, at, axis, effort) in enumerate(parts, 1):
        inertia = box(mass, length + 0.05, 0.08, 0.08)
        links.append(Link(child, mass, (length / 2.0, 0.0, 0.0), inertia))
        joints.append(
            Joint(f'j{k}', 'revolute', parent, child, at, IDENTITY, axis, -3.0, 3.0, effort, 2.0)
        )
    return Robot(
        'arm_on_wheels',
        tuple(links),
        tuple(joints),
        tuple(f'j{k}' for k in range(1, 7)),
        base.contacts,
        base.held,
        'flange',
        Payload(load, (0.05, 0.0, 0.0)),
        ground=base.ground,
        contact_tolerance=base.contact_tolerance,
    )


def walker() -> Robot:
    """Return a body on four legs of three joints, a foot at the end of each."""
    links = [Link('trunk', 12.0, inertia=box(12.0, 0.4, 0.2, 0.1))]
    joints, contacts = [], []
    for name, (x, y) in CORNERS.items():
        # The segment, what carries it, where on that, its axis.
        parts = (
            ('hip', 'trunk', (x, y / 2.0, 0.0), (1.0, 0.0, 0.0)),
            ('thigh', f'{name}_hip', (0.0, 0.05, 0.0), ACROSS),
            ('shin', f'{name}_thigh', (0.0, 0.0, -0.2), ACROSS),
        )
        for part, parent, at, axis in parts:
            child = f'{name}_{part}'
            links.append(Link(child, 0.5, (0.0, 0.0, -0.1), box(0.5, 0.03, 0.03, 0.2)))
            joints.append(
                Joint(f'{child}_joint', 'revolute', parent, child, at, axis=axis, lower=-pi)
            )
        contacts.append(Contact(name, f'{name}_shin', (0.0, 0.0, -0.2)))
    return Robot(
        'walker',
        tuple(links),
        tuple(joints),
        tuple(j.name for j in joints),
        tuple(contacts),
        ground=-0.4,
    )
