"""Measured saturation, and differences from the model larger than the margin left, by joint.

What efforts mean is known only when all was read, so spells are gathered for every meaning that
makes them count.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.criteria.statement import Objection
from ugv_acceptance.evaluation.effort.facts import CONSTANT, NONE, SCALED, JointMeaning
from ugv_acceptance.evaluation.effort.lasting import Lasting, Spell
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Floats

# An effort at this share of the limit has reached it.
REACHED = 0.999
# Sums up to this share of a limit are below it, whatever is rounded.
CERTAIN = 1.0 - 1e-9
# A difference from the model must last this long (ns): shorter ones are of motion.
LASTS = 500_000_000
# Spells named as evidence.
NAMED = 5
_SIGNS = (1.0, -1.0)


@dataclass(slots=True)
class MeasuredLimits:
    """Gathers when each joint's effort reached its limit, or left the model by its margin.

    Differences are gathered for both signs of the effort. For an effort in another unit the
    largest of each stretch is kept with its static torque, in `_largest`. `most` (j,) is the
    largest effort that two messages in a row had.
    """

    settings: Settings
    _over: list[Lasting] = field(init=False)
    _apart: dict[float, list[Lasting]] = field(init=False)
    most: Floats = field(init=False)
    _limit: Floats = field(init=False)

    def __post_init__(self) -> None:
        self._limit = np.array(self.settings.limits.torque)
        n, delay = len(self._limit), int(self.settings.delays.torque_on * 1e9)
        self._over = [Lasting(delay) for _ in range(n)]
        self._apart = {sign: [Lasting(LASTS) for _ in range(n)] for sign in _SIGNS}
        self.most = np.zeros(n)

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording; unknown ones and efforts are none."""
        if not len(rows.time):
            return
        with np.errstate(invalid='ignore'):
            largest = np.fmax.reduce(np.abs(rows.pairs.joints.effort), axis=0, initial=0.0)
            for j, most in enumerate(largest.tolist()):
                self._take_sizes(rows, j, most)
                self._take_differences(rows, j, most)

    def _take_sizes(self, rows: MarginRows, j: int, most: float) -> None:
        """Take how large a joint's efforts are; `most` is the largest of them, or more."""
        reached, lasting = REACHED * self._limit[j], self._over[j]
        if most < reached and most <= self.most[j] and not lasting.open:
            return
        size = np.abs(rows.pairs.joints.effort[rows.pairs.of_joints, j])
        lasting.add(rows.time, rows.until, size >= reached, size)
        # Twice in a row, so that one wild number is none.
        twice = np.fmin(size[1:], size[:-1])
        largest = np.nan_to_num(np.fmax.reduce(twice, initial=0.0))
        self.most[j] = max(self.most[j], float(largest))

    def _take_differences(self, rows: MarginRows, j: int, most: float) -> None:
        """Take how far a joint's efforts are from the model; `most` is the largest, or more."""
        torque, limit = rows.torque[:, j], self._limit[j]
        load = np.abs(torque)
        # None can be further away than the margin left.
        little = most + 2.0 * np.fmax.reduce(load, initial=0.0) <= CERTAIN * limit
        spells = {sign: lasting[j] for sign, lasting in self._apart.items()}
        if little and not any(lasting.open for lasting in spells.values()):
            return
        left = limit - load
        judged = (left > 0.0) & np.isfinite(left) & rows.weighed
        judged &= ~(rows.angle.min(axis=1) <= 0.0)
        effort = rows.pairs.joints.effort[rows.pairs.of_joints, j]
        for sign, lasting in spells.items():
            apart = np.abs(sign * effort - torque)
            lasting.add(rows.time, rows.until, (apart > left) & judged, apart)

    def objections(
        self, joints: Sequence[JointMeaning], start: int, carrying: Collection[int] = ()
    ) -> Iterator[Objection]:
        """Yield what speaks against a PASS, given what the efforts mean; times since `start`.

        Joints that carried the robot (numbers) may differ from the model: it does not know how
        the weight is spread, nor friction on the ground.
        """
        for j, joint in enumerate(joints):
            if joint.sign is not None:
                yield from self._saturated(j, joint, start)
                yield from () if j in carrying else self._differing(j, joint, start)
            elif in_another_unit(joint, joints):
                yield from self._scaled(j, joint)
            elif joint.meaning not in {NONE, CONSTANT}:
                yield from self._unclear(j, joint, start)

    def _saturated(self, j: int, joint: JointMeaning, start: int) -> Iterator[Objection]:
        def words(x: Spell) -> str:
            return (
                f'the measured torque of {joint.joint} is {x.peak:.1f} {joint.unit}; its limit is '
                f'{self._limit[j]:.1f} {joint.unit}'
            )

        return _told('measured_effort', 'FAIL', self._over[j].spells(), start, words)

    def _differing(self, j: int, joint: JointMeaning, start: int) -> Iterator[Objection]:
        def words(x: Spell) -> str:
            return (
                f'the measured torque of {joint.joint} differs from the model by up to '
                f'{x.peak:.1f} {joint.unit}, more than the margin left'
            )

        spells = self._apart[joint.sign or 1.0][j].spells()
        return _told('residual', 'INCONCLUSIVE', spells, start, words)

    def _scaled(self, j: int, joint: JointMeaning) -> Iterator[Objection]:
        """Object to an effort in another unit that is beyond the limit whatever its scale is."""
        ratio, limit = joint.ratio, float(self._limit[j])
        if ratio is None or not np.isfinite(limit):
            return
        scale = max(abs(ratio.low), abs(ratio.high))
        if self.most[j] >= limit * scale:
            yield Objection(
                'measured_effort',
                'INCONCLUSIVE',
                f'the effort of {joint.joint} reaches {self.most[j]:.3g}, which at '
                f'{ratio.text} of its torque is beyond its limit of {limit:.1f} {joint.unit}',
            )

    def _unclear(self, j: int, joint: JointMeaning, start: int) -> Iterator[Objection]:
        why = joint.why
        if joint.meaning == SCALED:
            why = f'that it is {joint.ratio.text if joint.ratio else "a part"} of its torque is '
            why += 'not sure: no other joint has such a unit'

        def words(x: Spell) -> str:
            return (
                f'the effort of {joint.joint} is {x.peak:.4g}, beyond its limit of '
                f'{self._limit[j]:.1f} {joint.unit}, and {why}'
            )

        return _told('measured_effort', 'INCONCLUSIVE', self._over[j].spells(), start, words)


def _told(
    safeguard: str,
    verdict: str,
    spells: Sequence[Spell],
    start: int,
    words: Callable[[Spell], str],
) -> Iterator[Objection]:
    """Yield the objection that spells make, if there are any: the first one, others as evidence."""
    lines = [f'{_when(x, start)}: {words(x)}' for x in spells[:NAMED]]
    if lines:
        yield Objection(safeguard, verdict, lines[0], tuple(lines[1:]))


def in_another_unit(joint: JointMeaning, joints: Sequence[JointMeaning]) -> bool:
    """Return whether the efforts of a joint and of another one have one other unit.

    One alone may be a fault.
    """
    mine = joint.ratio if joint.meaning == SCALED else None
    ratios = [x.ratio for x in joints if x is not joint and x.meaning == SCALED]
    return any(
        mine is not None and r is not None and r.low <= mine.high and mine.low <= r.high
        for r in ratios
    )


def _when(spell: Spell, start: int) -> str:
    return f'{(spell.start - start) / 1e9:.2f} to {(spell.end - start) / 1e9:.2f} s'
