"""An arm at rest in several postures: measured efforts beside what the model says of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.effort.evidence import (
    Joint,
)
from ugv_acceptance.type_aliases import Floats

# Numbers of loads tried.
LOADS = 49


@dataclass(frozen=True, slots=True)
class Arm:
    """Rest postures in order of time: `effort`, `torque`, `lever` (P, j), `declared` kg (P,).

    `errors` (s, P, j) are the model's, `sizes` (j,) the joints' largest torques, `most` (kg) the
    largest load. N m, N where prismatic; NaN: no effort.
    """

    effort: Floats
    torque: Floats
    lever: Floats
    declared: Floats
    errors: Floats
    sizes: Floats
    most: float

    def joint(self, j: int, rows: NDArray[np.bool_]) -> Joint:
        """Return one joint in the given postures (P,)."""
        return Joint(
            self.effort[rows, j], self.torque[rows, j], self.lever[rows, j], self.declared[rows],
            self.errors[:, rows, j], float(self.sizes[j]),
        )  # fmt: skip

    def rows(self, rows: Sequence[int]) -> 'Arm':
        """Return the given postures."""
        at = list(rows)
        return Arm(
            self.effort[at], self.torque[at], self.lever[at], self.declared[at],
            self.errors[:, at], self.sizes, self.most,
        )  # fmt: skip

    def loads(self) -> Floats:
        """Return the loads (kg) beyond the declared one that are tried; 0 is one of them."""
        if not self.lever.any():
            return np.zeros(1)
        least, most = -float(self.declared.max(initial=0.0)), max(self.most, 1e-3)
        steps = round(-least / (most - least) * LOADS) if least < 0.0 else 0
        less = np.linspace(least, 0.0, steps, endpoint=False)
        return np.concatenate((less, np.linspace(0.0, most, LOADS - steps)))
