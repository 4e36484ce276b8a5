"""Which joints report rates that contradict their positions.

Rates that are wrong are not used. Where rates that were right tell of a motion of which the
positions know nothing, the positions are wrong.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ugv_acceptance.evaluation.criteria.criteria import INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection, Statement
from ugv_acceptance.evaluation.inputs.joint_rates import CELL, STUCK, JointRate
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.model.robot import Robot

# Seconds of contradiction that are told.
LEAST = 1.0


@dataclass(slots=True)
class ReportedRates:
    """Tells at the end whose reported rates were not used; `rates` returns those of the joints."""

    robot: Robot
    rates: Callable[[], Sequence[JointRate]]

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording: nothing is kept of them."""

    def statement(self, start: int, end: int) -> Statement:
        """Return which reported rates contradicted the positions, and by how much."""
        del end
        every = list(zip(self.robot.joint_names, self.rates(), strict=True))
        told = [
            (name, rate.doubted * CELL / 1e9, rate.factor)
            for name, rate in every
            if rate.doubted * CELL / 1e9 >= LEAST
        ]
        return Statement(
            objections=tuple(
                Objection('joint_positions', INCONCLUSIVE, self._stuck(name, rate, start))
                for name, rate in every
                if rate.stuck >= STUCK
            ),
            not_checked=tuple(
                NotChecked(f'reported velocity of {name}', _why(factor), seconds)
                for name, seconds, factor in told
            ),
        )

    def _stuck(self, name: str, rate: JointRate, start: int) -> str:
        slides = self.robot.joint(name).slides
        by = f'{rate.stuck:.2f} m' if slides else f'{math.degrees(rate.stuck):.0f} deg'
        return (
            f'the position of {name} stands still to the last digit until '
            f'{(rate.stuck_at - start) / 1e9:.2f} s, while its velocity, which agreed with it '
            f'before, shows a motion of {by}'
        )


def _why(factor: float) -> str:
    """Return what is wrong; `factor` is reported rate over that of the positions."""
    much = f'is {factor:.3g} times that of its positions' if math.isfinite(factor) else 'differs'
    return f'it {much}; the velocity of the positions is used instead'
