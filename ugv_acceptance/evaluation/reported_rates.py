"""Which joints report rates that contradict their positions: an examination without objection."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ugv_acceptance.evaluation.criteria.statement import NotChecked, Statement
from ugv_acceptance.evaluation.inputs.joint_rates import CELL, JointRate
from ugv_acceptance.evaluation.margin_table import MarginRows

# Seconds of contradiction that are told.
LEAST = 1.0


@dataclass(slots=True)
class ReportedRates:
    """Tells at the end whose reported rates were not used; `rates` returns those of `names` (j)."""

    names: Sequence[str]
    rates: Callable[[], Sequence[JointRate]]

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording: nothing is kept of them."""

    def statement(self, start: int, end: int) -> Statement:
        """Return which reported rates contradicted the positions, and by how much."""
        del start, end
        told = [
            (name, rate.doubted * CELL / 1e9, rate.factor)
            for name, rate in zip(self.names, self.rates(), strict=True)
            if rate.doubted * CELL / 1e9 >= LEAST
        ]
        return Statement(
            not_checked=tuple(
                NotChecked(f'reported velocity of {name}', _why(factor), seconds)
                for name, seconds, factor in told
            )
        )


def _why(factor: float) -> str:
    """Return what is wrong; `factor` is reported rate over that of the positions."""
    much = f'is {factor:.3g} times that of its positions' if math.isfinite(factor) else 'differs'
    return f'it {much}; the velocity of the positions is used instead'
