"""A configuration being derived: every value with its source and with how sure it is."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.evidence import Evidence
from ugv_acceptance.model.robot import Contact, Matrix, Vector

T = TypeVar('T')
# How sure a derived value is: nothing to do; look whether it is so; nothing tells it.
CERTAIN, CHECK, ASK = 'certain', 'check', 'ask'


@dataclass(frozen=True, slots=True)
class Derived(Generic[T]):
    """A derived value; `grade` is CERTAIN, CHECK or ASK, `source` says where it comes from.

    With ASK the value is the best guess, or None where there is none.
    """

    value: T | None
    grade: str
    source: str


@dataclass(frozen=True, slots=True)
class DerivedContact:
    """A contact point; `on` is what carries there, for people: 'wheel front_left_wheel_link'."""

    contact: Contact
    grade: str
    source: str
    on: str


@dataclass(frozen=True, slots=True)
class Contacts:
    """How the robot stands: contact points, the height (m) of the ground in the root link's axes.

    `tilt` (rad, towards `heading`) is how far the plane of the points is off the root link's
    xy-plane. `question` is empty, or what a person has to say before these points can be used.
    `swivels` pairs joints of casters with how far (m) they move a point at most.
    """

    points: tuple[DerivedContact, ...]
    ground: Derived[float]
    tilt: float
    heading: float
    question: str = ''
    remarks: tuple[str, ...] = ()
    swivels: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class DerivedJoint:
    """A joint that messages tell: its name there and its limit (N m, N; None: not known).

    `effort_sign` and `effort_scale` make a torque of its effort, where that is known to need them.
    """

    name: str
    topic_name: str
    limit: Derived[float]
    passive: bool = False
    effort_sign: Derived[float] | None = None
    effort_scale: Derived[float] | None = None


@dataclass(frozen=True, slots=True)
class Joints:
    """The measured joints, and those held at a position (rad, m), each with its source.

    `question` is empty, or what a person has to say before names and topic can be used.
    """

    measured: tuple[DerivedJoint, ...]
    held: tuple[tuple[str, Derived[float]], ...]
    topic: Derived[str]
    prefix: str = ''
    remarks: tuple[str, ...] = ()
    question: str = ''


@dataclass(frozen=True, slots=True)
class Mounting:
    """The IMU's topic, frame, place (m, root link) and how its axes are turned into the root's.

    `joints` move the link it is on: place and rotation hold in the posture at rest alone.
    """

    topic: Derived[str]
    frame: str
    position: Derived[Vector]
    rotation: Derived[Matrix]
    question: str = ''
    remarks: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Draft:
    """All that was derived for one robot, before and after questions were answered.

    `scales` (kg) is what the robot weighs on scales; None: nobody weighed it. `open` are the
    questions (keys of questions.py) that nobody answered: what hangs on them is written `unknown`.
    """

    name: str
    urdf: Urdf
    urdf_path: str
    evidence: Evidence | None
    home: dict[str, Derived[float]]
    contacts: Contacts
    joints: Joints
    mounting: Mounting
    payload_link: Derived[str]
    mass: Derived[float]
    scales: float | None = None
    open: frozenset[str] = frozenset()
