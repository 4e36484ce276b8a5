"""What is answered: permitted, refused or not known, with the least margins and where they are."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

# May it? Refused where a limit is passed that the live monitor calls DANGER, or one of the joint's
# own. Not known where something is missing without which nobody can say; never permitted then.
PERMITTED, REFUSED, NOT_KNOWN = 'PERMITTED', 'REFUSED', 'NOT_KNOWN'
# From the best to the worst.
_ORDER = (PERMITTED, NOT_KNOWN, REFUSED)


@dataclass(frozen=True, slots=True)
class TiltLeft:
    """The least tilt left (rad) before the robot tips: over which side, and when.

    `time` (s) since the motion begins; `point` is the number of the trajectory's point, counted
    from 1, that the joints are on their way to, or stand at.
    """

    angle: float
    side: str
    time: float
    point: int


@dataclass(frozen=True, slots=True)
class JointUse:
    """The largest torque (N m; N if `slides`) of a joint during a motion, its limit, and when.

    `joint` is its name in the robot's description. `time` and `point` as of TiltLeft.
    """

    joint: str
    torque: float
    limit: float
    time: float
    point: int
    slides: bool = False

    @property
    def share(self) -> float:
        """Share of the limit that is used: from 1 on the joint gives in."""
        return self.torque / self.limit


@dataclass(frozen=True, slots=True)
class CheckedMotion:
    """The answer: `verdict` is PERMITTED, REFUSED or NOT_KNOWN.

    `reasons` are sentences: why not permitted, () if it is. `cautions` are sentences on what the
    monitor would call CAUTION, and on what to mind. `tilt` is None where no tilt is known;
    `cautious` is that of shortened tracks, on ground that is not flat only. `joints` are the joints
    with a limit, most used first; empty where no torque is known. `not_checked` are sentences on
    what no answer covers. `duration` (s) is when the motion ends, `samples` how many moments were
    computed.
    """

    verdict: str
    reasons: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()
    tilt: TiltLeft | None = None
    cautious: TiltLeft | None = None
    joints: tuple[JointUse, ...] = ()
    not_checked: tuple[str, ...] = ()
    duration: float = 0.0
    samples: int = 0

    @property
    def joint(self) -> JointUse | None:
        """The joint that uses most of its limit; None where no torque is known."""
        return self.joints[0] if self.joints else None


def worst_of(answers: Sequence[CheckedMotion]) -> CheckedMotion:
    """Return one answer for a motion that may go several ways: the worst, and the least margins."""
    if len(answers) == 1:
        return answers[0]
    uses: dict[str, JointUse] = {}
    for use in (use for answer in answers for use in answer.joints):
        uses[use.joint] = max(uses.get(use.joint, use), use, key=lambda of: of.share)
    worst = max(answers, key=lambda of: _ORDER.index(of.verdict))
    return replace(
        worst,
        cautions=_together([answer.cautions for answer in answers]),
        tilt=_least([answer.tilt for answer in answers]),
        cautious=_least([answer.cautious for answer in answers]),
        joints=tuple(sorted(uses.values(), key=lambda use: -use.share)),
        not_checked=_together([answer.not_checked for answer in answers]),
        samples=sum(answer.samples for answer in answers),
    )


def _together(told: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(sentence for some in told for sentence in some))


def _least(tilts: Sequence[TiltLeft | None]) -> TiltLeft | None:
    return min((tilt for tilt in tilts if tilt), key=lambda tilt: tilt.angle, default=None)
