"""A robot as data: links, joints and contact points of a URDF tree, and what it carries."""

import math
from dataclasses import dataclass, field

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

ZERO: Vector = (0.0, 0.0, 0.0)
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NO_INERTIA: Matrix = (ZERO, ZERO, ZERO)


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid body: mass (kg), centre of gravity (m) and inertia about it (kg m2), in link axes."""

    name: str
    mass: float = 0.0
    cog: Vector = ZERO
    inertia: Matrix = NO_INERTIA


@dataclass(frozen=True, slots=True)
class JointUnits:
    """The units of a joint's numbers, as people write them."""

    position: str
    rate: str
    effort: str


TURNING, SLIDING = JointUnits('rad', 'rad/s', 'N m'), JointUnits('m', 'm/s', 'N')


@dataclass(frozen=True, slots=True)
class Joint:
    """A URDF joint: `xyz` (m) and `rotation` place it in the parent link, `axis` is a unit vector.

    `kind` is revolute, continuous, prismatic or fixed. `effort` (N m, or N where prismatic),
    `velocity` (rad/s or m/s) and the position limits are infinite where the URDF gives none.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz: Vector = ZERO
    rotation: Matrix = IDENTITY
    axis: Vector = (1.0, 0.0, 0.0)
    lower: float = float('-inf')
    upper: float = float('inf')
    effort: float = float('inf')
    velocity: float = float('inf')

    @property
    def slides(self) -> bool:
        """Whether it moves along its axis: its numbers are then of lengths and forces."""
        return self.kind == 'prismatic'

    @property
    def units(self) -> JointUnits:
        """The units of its position, rate and effort."""
        return SLIDING if self.slides else TURNING

    def travel(self, half_slide: float = 0.0) -> tuple[float, float]:
        """Return the first and last position of its travel (rad, m): its limits.

        Where it has none it is one turn, half a turn to each side; `half_slide` (m) if it slides.
        """
        half = half_slide if self.slides else math.pi
        low = self.lower if math.isfinite(self.lower) else 0.0 - half
        high = self.upper if math.isfinite(self.upper) else half
        return low, high

    def nearest(self, position: float) -> float:
        """Return the position (rad, m) of its range that is nearest to `position`."""
        return min(max(position, self.lower), self.upper)


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint that moves with a measured one: its position is multiplier * that one's + offset.

    `offset` in rad (m where `joint` is prismatic).
    """

    joint: str
    follows: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Law:
    """What a spring or a constant force puts on a joint beside its motor, positive along its axis.

    `constant` - `stiffness` * (position - `rest`): N m, N m/rad, rad (N, N/m, m if prismatic).
    """

    joint: str
    constant: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0


@dataclass(frozen=True, slots=True)
class Contact:
    """A point (m, in the axes of `link`) with which the robot can stand on the ground."""

    name: str
    link: str
    position: Vector


@dataclass(frozen=True, slots=True)
class Shape:
    """One collision geometry of a link: `size` is its half extent (m) along its own axes.

    `kind` is box, cylinder, sphere, or that of a geometry that is not read (`size` None). Of a mesh
    `mesh` is the name of its file as the URDF gives it, `scale` the factors along its own axes.
    """

    link: str
    kind: str
    xyz: Vector
    rotation: Matrix
    size: Vector | None
    mesh: str | None = None
    scale: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Payload:
    """A load carried by the payload link: mass (kg) and centre of gravity in its axes (m)."""

    mass: float = 0.0
    cog: Vector = ZERO


@dataclass(frozen=True, slots=True)
class Pose:
    """A named posture: measured joints with their positions (rad, m); it may leave some out."""

    name: str
    positions: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Robot:
    """The physical model of a robot; the root link's frame is `base_link`.

    `joint_names` are the joints whose positions are given, in the order of every `q[..., j]`;
    movable joints that are not among them follow one of them (`mimics`), or are held at the value
    `held` pairs with their name, else at 0. `laws` are of joints among them.
    `ground` (m) is the height of the tracks' ground plane in `base_link`, `contact_tolerance` (m)
    how far from it a point still stands on the ground. `shapes` is the collision geometry of what
    is held above the ground (clearance.py), `drawn` that of all else, which only pictures need.
    `poses` are postures that people call by a name.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    joint_names: tuple[str, ...]
    contacts: tuple[Contact, ...] = ()
    held: tuple[tuple[str, float], ...] = ()
    payload_link: str | None = None
    payload: Payload = Payload()
    gravity: float = 9.81
    ground: float = 0.0
    contact_tolerance: float = 0.001
    mimics: tuple[Mimic, ...] = ()
    laws: tuple[Law, ...] = ()
    shapes: tuple[Shape, ...] = ()
    poses: tuple[Pose, ...] = ()
    drawn: tuple[Shape, ...] = field(default=(), compare=False)  # no margin hangs on it

    @property
    def root(self) -> str:
        """Name of the link no joint has as its child."""
        children = {joint.child for joint in self.joints}
        return next(link.name for link in self.links if link.name not in children)

    @property
    def mass(self) -> float:
        """Mass of all links (kg), without a payload."""
        return sum(link.mass for link in self.links)

    def joint(self, name: str) -> Joint:
        """Return the joint of that name; StopIteration if there is none."""
        return next(joint for joint in self.joints if joint.name == name)

    def link(self, name: str) -> Link:
        """Return the link of that name; StopIteration if there is none."""
        return next(link for link in self.links if link.name == name)
