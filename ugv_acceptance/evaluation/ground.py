"""What the ground under a robot is taken for: flat, uneven or stairs, and when in a recording.

Margins in degrees are computed for flat ground. On uneven ground and stairs nobody knows which part
of a track touches, so they are an upper bound there, and what counts is whether the robot has begun
to tip (tipping_trend.py). Without times of its own a kind holds all the time.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.margin_words import degrees_words, tipping_words
from ugv_acceptance.type_aliases import Times

FLAT, UNEVEN, STAIRS = 'flat', 'uneven', 'stairs'
KINDS = (FLAT, UNEVEN, STAIRS)
# Distance (m) between the edges of two steps along the slope: 0.20 m up, 40 degrees.
PITCH = 0.31
# What the numbers in degrees are called where the ground is not flat.
UPPER_BOUND = 'upper bound'
# What is said where contact points below the tracks carry the robot.
CARRIED = 'the flippers carry the body: this holds on flat ground only'


@dataclass(frozen=True, slots=True)
class GroundWindow:
    """A kind of ground (one of KINDS) from `start` to before `end` (s from a recording's start)."""

    kind: str
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Ground:
    """What the ground is taken for: `kind` is one of KINDS, None if nobody said so (then flat).

    `pitch` (m) is the distance of two edges that a track may rest on: half of it is cut from each
    end of the tracks for the cautious margin. In the `windows` of a recording another kind holds;
    of two that overlap, the later in the list.
    """

    kind: str | None = None
    pitch: float = PITCH
    windows: tuple[GroundWindow, ...] = ()

    @property
    def taken(self) -> str:
        """The kind that holds where no window says otherwise."""
        return self.kind or FLAT

    @property
    def rough(self) -> bool:
        """Whether the ground is not flat where no window says otherwise."""
        return self.taken != FLAT

    @property
    def ever_rough(self) -> bool:
        """Whether the ground is not flat at some time of a recording."""
        return self.rough or any(window.kind != FLAT for window in self.windows)

    def rough_within(self, start: float, end: float) -> bool:
        """Return whether the ground is not flat at some time from `start` to `end` (s)."""
        edges = [start, *(t for w in self.windows for t in (w.start, w.end))]
        times = np.array([t for t in edges if start <= t <= end])
        return bool((self.numbers_at(times) != KINDS.index(FLAT)).any())

    def numbers_at(self, seconds: NDArray[np.float64]) -> NDArray[np.int8]:
        """Return the kind, as a number in KINDS, at times (n,) in s since the recording began."""
        found = np.full(len(seconds), KINDS.index(self.taken), np.int8)
        for window in self.windows:
            inside = (seconds >= window.start) & (seconds < window.end)
            found[inside] = KINDS.index(window.kind)
        return found

    def numbers_of(self, times: Times, start: int) -> NDArray[np.int8]:
        """Return the kind, as a number in KINDS, at `times` (n,) in ns; `start` (ns) as above."""
        return self.numbers_at((times - start) / 1e9)


NOT_ENTERED = Ground()


def ground_words(kind: str | None) -> str:
    """Return what the ground is taken for, and whether somebody said so."""
    return kind or f'{FLAT} (not entered)'


def with_ground(
    ground: Ground, kind: str | None = None, windows: tuple[GroundWindow, ...] = ()
) -> Ground:
    """Return the ground with another kind and more windows, where they are given."""
    return replace(ground, kind=kind or ground.kind, windows=(*ground.windows, *windows))


def bound_words(side: str, angle: float, cautious: float) -> str:
    """Return the tilt left on ground that is not flat: an upper bound, and a cautious value.

    `angle` and `cautious` in rad; NaN: not known.
    """
    bound = 'at most' if angle >= 0.0 else 'at least'
    words = f'{bound} {tipping_words(side, angle)} ({UPPER_BOUND})'
    return words if math.isnan(cautious) else f'{words}, {degrees_words(cautious)} taken cautiously'
