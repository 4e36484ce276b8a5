"""Judges a situation by what the simulated robot did: facts first, then rules, with numbers."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.drill.acts import Scene
from ugv_acceptance.drill.robot import LOOK, Truth
from ugv_acceptance.drill.situation import Case
from ugv_acceptance.evaluation.advice.tipped import TIPPED
from ugv_acceptance.evaluation.margin_words import degrees_words, tipping_words

# A robot has tipped that leans by this much (rad) on its ground, and is past tipping by TIPPED. An
# arm that stands on the ground takes the margin away as well, but does not make the robot lean.
LEANT = math.radians(8.0)
# A joint has given in that yields for so long (s).
GIVES_IN = 0.3
# What counts as motion: of the base (m), of a joint (rad).
MOVED, TURNED = 0.15, math.radians(8.0)
# Seconds that an operator has to react before motion without known margins counts.
REACTION = 8.0
# Motion (m) of a robot that has fallen and is left alone, at most.
LIES = 0.1


@dataclass(slots=True)
class Facts:
    """What the robot did since the question was asked; times (s) count from there.

    `blind` and `blind_turn` are how far (m, rad) it moved while nobody knew its margins, after an
    answer or REACTION; `moved` how far at all, `beside` how far with somebody near. `strain` is for
    how long (s) each motor gave all it had.
    """

    least: float = math.inf
    least_side: str = ''
    tipped: float = math.nan
    tipped_side: str = ''
    gave_in: tuple[str, float] = ('', math.nan)
    blind: float = 0.0
    blind_turn: float = 0.0
    moved: float = 0.0
    beside: float = 0.0
    near_on: bool = False
    silenced: bool = False
    strain: dict[str, float] = field(default_factory=dict)
    _before: Truth | None = None

    def take(self, truth: Truth, scene: Scene, since: float, *, answered: bool) -> None:
        """Take what the robot did in the last look, `since` (s) after the question."""
        before, self._before = self._before, truth
        if truth.least < self.least:
            self.least, self.least_side = truth.least, truth.side
        if math.isnan(self.tipped) and has_tipped(truth):
            self.tipped, self.tipped_side = since, truth.side
        for name in {*self.strain, *truth.yielding}:
            on = name in truth.yielding
            self.strain[name] = self.strain.get(name, 0.0) + LOOK if on else 0.0
            if self.strain[name] >= GIVES_IN and not self.gave_in[0]:
                self.gave_in = name, since
        self.near_on = self.near_on or (scene.near and not scene.off)
        self.silenced = self.silenced or scene.silenced
        if before is None:
            return
        step = float(np.linalg.norm(truth.place - before.place))
        self.moved += step
        self.beside += step if scene.near else 0.0
        if not truth.known and (answered or since > REACTION):
            self.blind += step
            self.blind_turn += float(np.abs(truth.q - before.q).max(initial=0.0))


def has_tipped(truth: Truth) -> bool:
    """Return whether the robot has really tipped over."""
    return truth.lean > LEANT and (math.isnan(truth.least) or truth.least <= -TIPPED)


@dataclass(frozen=True, slots=True)
class End:
    """How a situation ends: the `truth`, the scene, and whether the first alerts are `over`.

    `fell` says that the robot had fallen before the question.
    """

    truth: Truth
    scene: Scene
    over: bool
    fell: bool


# Name of a need -> the sentence that says it is not met; '': it is.
Need = Callable[[Facts, End], str]


def _ended(_: Facts, end: End) -> str:
    now = tipping_words(end.truth.side, end.truth.least) if end.truth.side else 'no margin'
    return '' if end.over else f'the alert never ended: it stands at {now}'


def _known(_: Facts, end: End) -> str:
    return '' if end.truth.known else 'to the end nobody knew its margins'


def _not_blind(facts: Facts, _: End) -> str:
    if facts.blind > MOVED:
        return f'it drove {facts.blind:.1f} m while nobody knew its margins'
    if facts.blind_turn > TURNED:
        return f'its arm moved {degrees_words(facts.blind_turn)} while nobody knew its margins'
    return ''


def _true_ground(_: Facts, end: End) -> str:
    told, now = end.scene.robot.setup.ground, end.scene.robot.session.settings.ground.kind
    return '' if told == now else f'the monitor was told that the ground is {now}, so it is quiet'


def _heard(facts: Facts, _: End) -> str:
    return 'nobody listened to the monitor any more' if facts.silenced else ''


def _off(_: Facts, end: End) -> str:
    return '' if end.scene.off else 'it lay there with its motors on to the end'


def _nobody_near(facts: Facts, _: End) -> str:
    if not facts.near_on:
        return ''
    return f'with somebody beside it and its motors on it moved {facts.beside:.1f} m'


def _lay_still(facts: Facts, _: End) -> str:
    return f'lying on its side it moved {facts.moved:.1f} m' if facts.moved > LIES else ''


NEEDS: dict[str, Need] = {
    'nobody_near': _nobody_near,
    'lay_still': _lay_still,
    'not_blind': _not_blind,
    'heard': _heard,
    'known': _known,
    'off': _off,
    'true_ground': _true_ground,
    'ended': _ended,
}


def fault_of(case: Case, facts: Facts, end: End) -> str:
    """Return in one sentence what went wrong on the robot; '' where nothing did."""
    if not end.fell and not math.isnan(facts.tipped):
        return f'it tipped over to the {facts.tipped_side}, {facts.tipped:.0f} s after the question'
    name, at = facts.gave_in
    if not end.fell and name:
        joint = name.removesuffix('_joint').replace('_', ' ')
        return f'{at:.0f} s after the question the {joint} gave in, its motor at its limit'
    found = (NEEDS[need](facts, end) for need in NEEDS if need in case.needs)
    return next((sentence for sentence in found if sentence), '')


def success_of(facts: Facts, end: End) -> str:
    """Return in one sentence what the robot did where nothing went wrong."""
    if end.fell:
        return 'it lay still, nobody was near, and it is switched off'
    least = tipping_words(facts.least_side, facts.least)
    over = 'the alert has ended' if end.over else 'its margins are known again'
    return f'it did not tip and nothing gave in ({least} at the least); {over}'
