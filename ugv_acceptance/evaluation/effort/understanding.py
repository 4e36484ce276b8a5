"""Understands the efforts of a run or of a running robot: their meaning, loads and contacts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance.evaluation.criteria.uncertainty import Source
from ugv_acceptance.evaluation.effort.facts import UNKNOWN, JointMeaning, signs_of
from ugv_acceptance.evaluation.effort.loads import Contact, Load, weigh
from ugv_acceptance.evaluation.effort.meaning import name_meanings
from ugv_acceptance.evaluation.effort.rests import Rests, arm_of, distinct, reaches
from ugv_acceptance.evaluation.settings import Settings

# So many rests are weighed at most, the longest.
WEIGHED = 60
# An effort this close to a limit (as a share of it) is clipped there.
CLIPPED = 1e-3


@dataclass(frozen=True, slots=True)
class Understanding:
    """What the efforts of a robot mean and say: by joint, by stretch of constant load, by contact.

    Rows of loads and contacts are those of `rests`. `link` is where the load hangs; `guessed` that
    no payload link is configured, so that the end of the arm is taken.
    """

    joints: tuple[JointMeaning, ...]
    rests: Rests
    loads: tuple[Load, ...] = ()
    contacts: tuple[Contact, ...] = ()
    link: str | None = None
    guessed: bool = False

    def span(self, load: Load) -> tuple[int, int]:
        """Return from when to when (ns) a load was carried, as far as rests tell."""
        return int(self.rests.start[load.first]), int(self.rests.end[load.last])

    def load_words(self, load: Load) -> str:
        """Return what was carried, and what is declared, as a clause."""
        mass = f'{max(load.mass, 0.0):.2f} +/- {load.half:.2f} kg'
        if self.guessed:
            extra = load.mass - load.declared
            return (
                f'measured efforts show {extra:.2f} +/- {load.half:.2f} kg at {self.link} '
                'that the model does not know: set payload.link and the payload'
            )
        return (
            f'measured efforts show a payload of {mass}, but {load.declared:.2f} kg '
            f'{"is" if load.differs else "is also"} declared'
        )

    def contact_words(self, contact: Contact) -> str:
        """Return what a joint holds that no load explains, as a clause."""
        joint = self.joints[contact.joint]
        return (
            f'{joint.joint} holds {contact.extra:+.1f} {joint.unit} that no load and no error of '
            'the model explains: it pushes against something, or something pulls on it'
        )


def understand(settings: Settings, sources: Sequence[Source], rests: Rests) -> Understanding:
    """Return what the efforts in `rests` mean and say; `sources` are the model's uncertainty."""
    units = [settings.robot.joint(name).units.effort for name in settings.robot.joint_names]
    names = settings.robot.joint_names
    if not len(rests.start):
        unknown = (JointMeaning(n, u, UNKNOWN) for n, u in zip(names, units, strict=True))
        return Understanding(tuple(unknown), rests)
    rests = _without_clipped(settings, rests)
    arm, sizes = arm_of(settings, sources, distinct(rests, reaches(settings)))
    joints = tuple(
        JointMeaning(n, u, m.meaning, m.probability, m.ratio, m.level, m.below)
        for n, u, m in zip(names, units, name_meanings(arm), strict=True)
    )
    kept = longest(rests)
    signs = signs_of([joint.meaning for joint in joints])
    weighed = weigh(arm_of(settings, sources, kept)[0], signs)
    return Understanding(joints, kept, weighed.loads, weighed.contacts, sizes.link, sizes.guessed)


def _without_clipped(settings: Settings, rests: Rests) -> Rests:
    """Return rests without the efforts that stand exactly at a limit: they say nothing of loads."""
    robot, effort = settings.robot, rests.effort.copy()
    motors = [robot.joint(name).effort for name in robot.joint_names]
    for limits in (np.array(settings.limits.torque), np.array(motors)):
        known = np.where(np.isfinite(limits) & (limits > 0.0), limits, np.nan)
        with np.errstate(invalid='ignore'):
            effort[np.abs(np.abs(effort) - known) <= CLIPPED * known] = np.nan
    return replace(rests, effort=effort)


def longest(rests: Rests) -> Rests:
    """Return the longest rests in order of time, WEIGHED at most."""
    order = np.argsort(rests.start - rests.end, kind='stable')[:WEIGHED]
    return rests.rows(np.sort(order))
