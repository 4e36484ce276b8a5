"""The plan of a measurement: kinds, bounds and seed from kinds.yaml, and the run of each number."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from error_rate import good, loads, motion, sensing, setup
from error_rate.draw import Draw, Made
from made.judged import PASS, Expected
from made.subjects import PACKBOT, ROOT, subjects

FILE = Path(__file__).with_name('kinds.yaml')
ROOMS = (sensing, loads, motion, setup, good)
FAULTED, GOOD = 'faulted', 'good'
# What is not a bound.
OWN = ('row', 'robots', 'must')
# Draws until a run is what its kind says; beyond them the bounds do not fit the robot.
TRIES = 3000


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of run: its half, the row of the table it is of, robots, right verdicts, bounds."""

    name: str
    half: str
    row: str
    robots: str | list[str]
    expected: Expected
    bounds: Mapping[str, Any]
    make: Callable[[Draw], Made]


@dataclass(frozen=True, slots=True)
class Drawn:
    """A run that was made: of which kind and robot, with which random numbers."""

    kind: Kind
    robot: str
    numbers: Mapping[str, Any]
    made: Made


@dataclass(frozen=True)
class Plan:
    """All of kinds.yaml, its hash, and which run has which number."""

    path: Path = FILE

    @cached_property
    def content(self) -> dict[str, Any]:
        """The file as data."""
        read: dict[str, Any] = yaml.safe_load(self.path.read_text(encoding='utf-8'))
        return read

    @cached_property
    def sha256(self) -> str:
        """The hash of the file."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest()

    @cached_property
    def kinds(self) -> dict[str, Kind]:
        """Every kind by its name, in the order of the file."""
        found = {}
        for half in (FAULTED, GOOD):
            for name, given in self.content[half].items():
                make = next(getattr(room, name) for room in ROOMS if hasattr(room, name))
                bounds = {k: v for k, v in given.items() if k not in OWN}
                expected = Expected(tuple(given.get('must', (PASS,))))
                found[name] = Kind(
                    name,
                    half,
                    str(given['row']),
                    given['robots'],
                    expected,
                    self.content['every'] | bounds,
                    make,
                )
        return found

    def robots_of(self, kind: Kind) -> list[str]:
        """Return the robots that are here and can do what this kind asks."""
        here = subjects()
        if kind.robots == 'all':
            return list(here)
        return [n for n, s in here.items() if s.weak is not None and _asked(n, kind.robots)]

    def kind_of(self, number: int) -> Kind:
        """Return the kind of a run: even numbers are faulted, odd ones good, kinds in turn."""
        half = GOOD if number % 2 else FAULTED
        names = [name for name, kind in self.kinds.items() if kind.half == half]
        return self.kinds[names[number // 2 % len(names)]]

    def run(self, number: int, folder: Path) -> Drawn:
        """Make the run of a number: the same whenever and wherever it is made."""
        return self.draw(self.kind_of(number), number, folder)

    def draw(self, kind: Kind, number: int, folder: Path, robot: str = '', **pinned: Any) -> Drawn:
        """Make a run of a kind; `pinned` bounds replace those of the plan, `robot` the drawn one.

        Configurations are written in `folder`.
        """
        rng = np.random.default_rng([self.content['seed'], number])
        able = self.robots_of(kind)
        others = [name for name in able if name != PACKBOT] or [PACKBOT]
        drawn = PACKBOT if rng.random() < self.content['packbot'] else str(rng.choice(others))
        chosen = subjects()[robot or drawn]
        for _ in range(TRIES):
            draw = Draw(rng, {**kind.bounds, **pinned}, chosen, folder)
            try:
                made = kind.make(draw)
            except ValueError as error:  # these numbers do not give what the kind says
                why = error
                continue
            return Drawn(kind, chosen.name, draw.drawn, made)
        msg = f'{kind.name} of {chosen.name}: no run in {TRIES} tries; the last: {why}'
        raise RuntimeError(msg)


def _asked(name: str, robots: str | list[str]) -> bool:
    return robots == 'arms' or name in robots


def short_of(plan: Plan, each: int) -> list[int]:
    """Return the numbers of the first `each` runs of every kind."""
    halves = [sum(k.half == half for k in plan.kinds.values()) for half in (FAULTED, GOOD)]
    return sorted(2 * k + odd for odd, count in enumerate(halves) for k in range(count * each))


def code_hash(*folders: str) -> str:
    """Return a hash of the sources in folders of this checkout.

    Results of another program, or of runs that were made otherwise, are not mixed with these.
    """
    whole = hashlib.sha256()
    for folder in folders:
        for path in sorted((ROOT / folder).rglob('*.py')):
            whole.update(path.read_bytes())
    return whole.hexdigest()
