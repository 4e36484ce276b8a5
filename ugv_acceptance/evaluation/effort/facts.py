"""What a joint's `effort` can mean, as one table: the sentence to tell, what to do, what it is for.

Evaluation, report, doctor and the live monitor all speak from this table, and none of them may use
an effort for more than its meaning allows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

TORQUE, OTHER_SIGN, SCALED, WITHOUT = 'torque', 'other sign', 'scaled', 'without gravity'
NONE, CONSTANT, SATURATED, UNKNOWN = 'none', 'constant', 'saturated', 'unknown'
# Kinds of NONE, an effort that is always 0 without and with a load; of UNKNOWN, a joint too lightly
# loaded to tell.
ZERO_EFFORT, IDLE, UNLOADED = 'zero', 'zero under load', 'unloaded'

# An effort within this share of minus the static torque has the opposite sign.
ALIKE = 0.5


@dataclass(frozen=True, slots=True)
class Fact:
    """A meaning of effort: `sentence` with {joint}, {unit} and {ratio}, and what to `do` about it.

    `sign` is what makes the effort the joint's torque (1 or -1); None: it is no torque, so nothing
    about loads, contacts or limits follows from it. `why` is the reason to give where an effort
    could not be used, '' if it can be.
    """

    sentence: str
    do: str = ''
    sign: float | None = None
    why: str = ''


FACTS = {
    TORQUE: Fact('the effort of {joint} is its torque in {unit}', sign=1.0),
    OTHER_SIGN: Fact(
        'the effort of {joint} is its torque in {unit}, but with the opposite sign',
        'set effort_sign: -1 for {joint} in the configuration',
        sign=-1.0,
    ),
    SCALED: Fact(
        'the effort of {joint} is {ratio} of its torque: a current, a percentage or another unit',
        'set effort_scale for {joint} in the configuration',
        why='its effort is in another unit than {unit}',
    ),
    WITHOUT: Fact(
        'the effort of {joint} leaves gravity out: the arm is held by gravity compensation, or the '
        'driver subtracts it',
        why='its effort leaves gravity out',
    ),
    NONE: Fact('no effort of {joint} is measured', why='no effort is recorded'),
    ZERO_EFFORT: Fact(
        'the effort of {joint} is always 0', why='its effort is always 0, and it is hardly loaded'
    ),
    IDLE: Fact(
        'the effort of {joint} is always 0 although its posture needs torque: gravity is '
        'compensated or left out, or nothing is measured',
        why='its effort is 0 under load: gravity is compensated or left out, or it is not measured',
    ),
    CONSTANT: Fact(
        'the effort of {joint} never changes although its load does: it is no measurement',
        'check the driver of {joint}',
        why='its effort never changes',
    ),
    SATURATED: Fact(
        'the effort of {joint} is cut off at {level} {unit}: beyond it, it says nothing',
        'check the limit of the motor or of the message',
        why='its effort is cut off at one value',
    ),
    UNLOADED: Fact(
        '{joint} is too lightly loaded to tell what its effort means',
        why='it is too lightly loaded to tell what its effort means',
    ),
    UNKNOWN: Fact(
        'what the effort of {joint} means is not known',
        'let the robot rest in several postures that load {joint} differently',
        why='what its effort means is not known',
    ),
}


def signs_of(meanings: Sequence[str]) -> list[float | None]:
    """Return what makes the effort of each joint a torque; None where nothing can be weighed by it.

    Where most of an arm's efforts are in another unit, one that seems to be a torque is no proof.
    """
    signs = [FACTS[meaning].sign for meaning in meanings]
    torques = sum(sign is not None for sign in signs)
    return [None] * len(signs) if meanings.count(SCALED) > torques else signs


@dataclass(frozen=True, slots=True)
class Ratio:
    """Effort over static torque with the declared load, and its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def text(self) -> str:
        """The ratio with its interval, as text."""
        return f'{self.value:.3g} ({self.low:.3g} to {self.high:.3g})'

    @property
    def spread(self) -> float:
        """How many times apart the ends of the interval are; infinite if it holds 0."""
        least, most = sorted((abs(self.low), abs(self.high)))
        return most / least if self.low * self.high > 0.0 else float('inf')


@dataclass(frozen=True, slots=True)
class JointMeaning:
    """What the effort of one joint means, and with what probability of the meanings considered.

    `ratio` is None where the joint was not loaded enough, or the effort is no measurement.
    `below` is the meaning of a saturated effort below the value `level` at which it is cut off; of
    one that is always 0 it is ZERO_EFFORT or IDLE, of an unknown one UNLOADED or ''.
    """

    joint: str
    unit: str
    meaning: str
    probability: float = 0.0
    ratio: Ratio | None = None
    level: float = 0.0
    below: str = ''

    @property
    def fact(self) -> Fact:
        """The row of FACTS."""
        kind = self.below if self.meaning in {NONE, UNKNOWN} else ''
        return FACTS[kind or self.meaning]

    @property
    def sign(self) -> float | None:
        """What makes the effort a torque (1, -1); None: it is none."""
        return self.fact.sign if self.meaning != SATURATED else FACTS[self.below or UNKNOWN].sign

    @property
    def weighs(self) -> bool:
        """Whether the effort may say something of loads: torque of known sign, not cut off."""
        return self.fact.sign is not None

    def _filled(self, text: str) -> str:
        ratio = 'an unknown part' if self.ratio is None else self.ratio.text
        return text.format(joint=self.joint, unit=self.unit, ratio=ratio, level=f'{self.level:.4g}')

    @property
    def sentence(self) -> str:
        """What the effort means, with the ratio where only that is known."""
        told = self._filled(self.fact.sentence)
        if self.meaning == UNKNOWN and self.ratio is not None:
            told += f'; it is {self.ratio.text} of the static torque with the declared load'
        return told

    @property
    def do(self) -> str:
        """What to do about it; '': nothing."""
        return self._filled(FACTS[OTHER_SIGN].do if self.opposed else self.fact.do)

    @property
    def why(self) -> str:
        """Why nothing follows from the effort; '' where something does."""
        told = self._filled(self.fact.why)
        if self.meaning == UNKNOWN and self.odd and self.ratio is not None:
            told += f'; it is {self.ratio.text} of the static torque with the declared load'
        return told

    @property
    def opposed(self) -> bool:
        """Whether the effort is about minus the torque, though its scale may not be certain."""
        if self.meaning == UNKNOWN and self.ratio is not None:
            return self.ratio.high < 0.0 and abs(self.ratio.value + 1.0) <= ALIKE
        return self.sign == -1.0

    @property
    def odd(self) -> bool:
        """Whether the effort is surely not the static torque with the declared load."""
        return self.ratio is not None and not self.ratio.low <= 1.0 <= self.ratio.high
