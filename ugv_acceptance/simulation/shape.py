"""What of a robot touches the ground: contact spheres, wheels, and its bulk after a tip-over."""

from collections.abc import Iterable, Mapping
from xml.etree import ElementTree as ET

import numpy as np

from ugv_acceptance.model.robot import Contact, Robot

# Radius (m) of the sphere about a contact point: small, so that it stands where the point is.
CONTACT_RADIUS = 1e-4
# Half the width (m) of a wheel at its axle.
WHEEL_WIDTH = 0.02
# Radius (m) of the spheres at the joints and the payload, ground clearance (m) of the hull.
BULK_RADIUS, CLEARANCE = 0.03, 0.03


def numbers(values: Iterable[float]) -> str:
    """Return numbers as MJCF wants them, to the last digit."""
    return ' '.join(repr(float(x)) for x in values)


def lowest_contact(robot: Robot) -> float:
    """Return the height (m, `base_link`) of the root link's lowest contact, or the ground's."""
    heights = [c.position[2] for c in robot.contacts if c.link == robot.root]
    return min(heights, default=robot.ground)


def wheel_contacts(robot: Robot) -> tuple[Contact, ...]:
    """Return the contacts that become wheels: those of the root link on the ground plane."""
    return tuple(
        c
        for c in robot.contacts
        if c.link == robot.root and c.position[2] <= robot.ground + robot.contact_tolerance
    )


def add_contacts(
    bodies: Mapping[str, ET.Element], robot: Robot, wheel_radius: float | None
) -> None:
    """Add a sphere at every contact, or a wheel at those of `wheel_contacts` if it has a radius."""
    wheels = () if wheel_radius is None else wheel_contacts(robot)
    for contact in robot.contacts:
        if contact not in wheels:
            ET.SubElement(
                bodies[contact.link],
                'geom',
                name=f'contact:{contact.name}',
                type='sphere',
                size=repr(CONTACT_RADIUS),
                pos=numbers(contact.position),
            )
    for contact in wheels:
        _add_wheel(bodies[contact.link], contact, wheel_radius or 0.0)


def _add_wheel(body: ET.Element, contact: Contact, radius: float) -> None:
    """Add a wheel that stands on `contact`; it carries next to no mass: the link has it already."""
    x, y, z = contact.position
    name = f'wheel:{contact.name}'
    axle = numbers((x, y, z - CONTACT_RADIUS + radius))
    wheel = ET.SubElement(body, 'body', name=name, pos=axle)
    ET.SubElement(wheel, 'joint', name=name, type='hinge', axis='0 1 0', armature='0.02')
    ET.SubElement(wheel, 'inertial', pos='0 0 0', mass='1e-6', diaginertia='1e-6 1e-6 1e-6')
    size = numbers((radius, WHEEL_WIDTH, radius))
    ET.SubElement(wheel, 'geom', name=name, type='ellipsoid', size=size)


def add_bulk(bodies: Mapping[str, ET.Element], robot: Robot) -> None:
    """Add a hull over the root link's contacts and spheres at the joints and the payload."""
    on_root = [c.position for c in robot.contacts if c.link == robot.root]
    decks = [j.xyz[2] for j in robot.joints if j.parent == robot.root]
    if on_root and decks:
        low, high = np.min(on_root, axis=0), np.max(on_root, axis=0)
        low[2], high[2] = low[2] + CLEARANCE, max(*decks, low[2] + 2 * CLEARANCE)
        half, middle = numbers((high - low) / 2), numbers((high + low) / 2)
        ET.SubElement(bodies[robot.root], 'geom', name='hull', type='box', size=half, pos=middle)
    places = [(j.parent, j.xyz) for j in robot.joints if j.parent != robot.root]
    if robot.payload_link is not None:
        places.append((robot.payload_link, robot.payload.cog))
    for link, place in places:
        ET.SubElement(
            bodies[link], 'geom', type='sphere', size=repr(BULK_RADIUS), pos=numbers(place)
        )
