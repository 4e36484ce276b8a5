"""What the motors say is in the hand: the payload that explains measured efforts at rest."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.evaluation.effort import REST
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque

# An estimate needs joints that feel at least this (N m a kg, all together); a load that differs by
# less (kg) is not told; and it must explain this share of what the model leaves unexplained.
FELT, DIFFERS, EXPLAINED = 1.0, 0.5, 0.75


@dataclass(frozen=True, slots=True)
class PayloadEstimate:
    """The `mass` (kg) that explains the efforts, and the one that is declared."""

    mass: float
    declared: float

    @property
    def differs(self) -> bool:
        """Whether it is another load than the declared one."""
        return abs(self.mass - self.declared) >= DIFFERS

    @property
    def sentence(self) -> str:
        """What to tell the operator."""
        return (
            f'the motors work as if {max(self.mass, 0.0):.1f} kg were in the hand, '
            f'{self.declared:.1f} kg are declared'
        )


def payload_estimate(
    settings: Settings,
    q: Sequence[float],
    qd: Sequence[float],
    effort: Sequence[float],
    gravity: Sequence[float],
    payload: Payload,
) -> PayloadEstimate | None:
    """Return the payload that explains `effort` (j,), be it the declared one or another.

    None while a joint moves, where no effort is known, where the posture does not tell, or where no
    payload would explain it. rad, rad/s, N m (N), m/s2.
    """
    measured, rates = np.array(effort, dtype=np.float64), np.nan_to_num(np.array(qd))
    # Many drivers that measure no effort send zeros.
    known = np.isfinite(measured) & (measured != 0.0)
    known &= np.isfinite(np.array(settings.limits.torque))
    if not known.any() or (np.abs(rates) > REST).any():
        return None
    loads = [Payload(mass, payload.cog) for mass in (payload.mass, payload.mass + 1.0)]
    model, heavier = (static_torque(settings.robot, q, gravity, load)[known] for load in loads)
    felt, open_ = heavier - model, measured[known] - model
    if not felt @ felt >= FELT**2:
        return None
    more = float(felt @ open_ / (felt @ felt))
    rest = open_ - more * felt
    # A difference that no load explains tells nothing of the load.
    if rest @ rest > max((1.0 - EXPLAINED) * (open_ @ open_), DIFFERS**2 * (felt @ felt)):
        return None
    # Nothing that hangs in a hand pulls it up: the arm leans on something, or a sign is wrong.
    return (
        None
        if payload.mass + more < -DIFFERS
        else PayloadEstimate(payload.mass + more, payload.mass)
    )
