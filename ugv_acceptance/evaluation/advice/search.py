"""Searches for advice: which motion improves the worst margin most (words.py says it).

Each candidate is a path, followed step by step with the compiled model. It ends where another
margin would fall below its warning limit, where a motor would have to lift more than it can, or
where the robot would come to stand on other points. Of the paths that restore the margin the
fastest comes first, then the others by gain; turning, which shakes the robot, comes last.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.evaluation.advice.paths import Path, joint_paths, turn_paths
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR, has_tipped
from ugv_acceptance.evaluation.advice.words import joint_words, load_words, turn_words
from ugv_acceptance.evaluation.margin_words import degrees_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import NO_CONTACT, SIDES, margins
from ugv_acceptance.model.statics import payload_capacity
from ugv_acceptance.type_aliases import Floats

# Codes of alerts whose advice is computed; their subject is the margin.
COMPUTED = frozenset({'TIP_OVER', 'TORQUE_LIMIT'})
# Slack of comparisons; a path must gain at least this share of the way from ERROR to WARN.
SLACK, LEAST_GAIN = 1e-6, 0.1


@dataclass(frozen=True, slots=True)
class Advice:
    """One piece of advice: a motion or action, how long it takes and what a margin gains by it.

    `kind` is joint, turn, payload or, after a fall, stand_clear; `amount` in rad (m if prismatic)
    or kg. After `seconds` the `margin` (a side or a joint) has gained `gain` (rad of tilt; N m or N
    of torque); `enough` says whether that ends the warning. `sentence` is for the operator.
    """

    kind: str
    subject: str
    amount: float
    seconds: float
    margin: str
    gain: float
    enough: bool
    sentence: str


@dataclass(frozen=True, slots=True)
class _Case:
    """The situation for which advice is searched.

    `scores` (m,) of all margins (see `scores_of`), `worst` the number of the margin to improve,
    `enough` the score at which its warning ends. Nothing is searched for a robot that has `tipped`.
    """

    settings: Settings
    q: Floats
    gravity: Floats
    payload: Payload
    scores: Floats
    torque: Floats
    state: int
    worst: int
    enough: float
    tipped: bool = False

    @property
    def subject(self) -> str:
        """Name of the margin to improve: a side or a joint."""
        return margin_names(self.settings)[self.worst]

    @property
    def tips(self) -> bool:
        """Whether the margin to improve is a tip-over margin."""
        return self.worst < len(SIDES)


def margin_names(settings: Settings) -> tuple[str, ...]:
    """Return the names of the margins in order of their scores: the sides, then the joints."""
    return (*SIDES, *settings.robot.joint_names)


def scores_of(settings: Settings, torque: Floats, angle: Floats) -> Floats:
    """Return each margin (..., 4 + j) scaled so that WARN begins at 1 and ERROR at 0.

    Infinite if not judged. `torque` (..., j) in N m (N), `angle` (..., 4) in rad.
    """
    limits = settings.limits
    tip, torque_span = _spans(settings)
    tilt = (angle - limits.tip_error) / tip
    use = np.abs(torque) / np.array(limits.torque)
    found: Floats = np.concatenate((tilt, (limits.torque_error - use) / torque_span), axis=-1)
    found[..., len(SIDES) :][..., ~np.isfinite(limits.torque)] = np.inf
    return found


def _spans(settings: Settings) -> tuple[float, float]:
    """Return the distance from ERROR to WARN: rad of tilt, and as a share of the torque limit."""
    limits = settings.limits
    tip = max(limits.tip_warn - limits.tip_error, math.radians(0.5))
    return tip, max(limits.torque_error - limits.torque_warn, 0.02)


def advise(
    settings: Settings,
    q: Sequence[float],
    gravity: Sequence[float],
    payload: Payload,
    of: str | None = None,
) -> tuple[Advice, ...]:
    """Return advice, the best first; none if the margin is above its warning limit or unknown.

    A robot that has tipped gets one piece, whatever the margin: STAND_CLEAR.
    `q` (j,) rad or m, `gravity` (3,) m/s2 in `base_link`. `of` names the margin to improve (a side
    or a joint); None chooses the most severe one.
    """
    return advise_each(settings, [q], [gravity], payload, [of])[0]


def advise_each(
    settings: Settings,
    q: ArrayLike,
    gravity: ArrayLike,
    payload: Payload,
    of: Sequence[str | None],
) -> list[tuple[Advice, ...]]:
    """Return `advise` for many situations: `q` (n, j), `gravity` (n, 3), `of` (n,).

    The model evaluates all together, so that fifty take little longer than one.
    """
    cases = _cases(settings, q, gravity, payload, of)
    known = [case for case in cases if case is not None]
    warned = [case for case in known if not case.tipped and case.scores[case.worst] < 1.0]
    found: dict[int, list[Advice]] = {id(case): [] for case in warned}
    found |= {id(case): [_stand_clear(case)] for case in known if case.tipped}
    for case, advice in chain(_moves(warned), _loads(warned)):
        found[id(case)].append(advice)
    return [tuple(sorted(found.get(id(case), ()), key=_order)) for case in cases]


def _stand_clear(case: _Case) -> Advice:
    return Advice('stand_clear', 'robot', 0.0, 0.0, case.subject, 0.0, False, STAND_CLEAR)  # noqa: FBT003


def _order(advice: Advice) -> tuple[bool, bool, float]:
    """Return the sort key: advice that is enough first, turns last; then by speed, else by gain."""
    by = advice.seconds if advice.enough else -advice.gain
    return not advice.enough, advice.kind == 'turn', by


def _cases(
    settings: Settings,
    q: ArrayLike,
    gravity: ArrayLike,
    payload: Payload,
    of: Sequence[str | None],
) -> list[_Case | None]:
    """Return the situations; None if no margin is known."""
    at, down = np.array(q, dtype=np.float64), np.array(gravity, dtype=np.float64)
    now = margins(settings.robot, at, down, payload)
    with np.errstate(invalid='ignore'):
        scores = scores_of(settings, now.torque, now.angle)
    known = np.isfinite(at).all(axis=1) & np.isfinite(down).all(axis=1) & (now.state < NO_CONTACT)
    worst = [
        _most_severe(mine) if name is None else margin_names(settings).index(name)
        for mine, name in zip(scores, of, strict=True)
    ]
    tipped = list(map(has_tipped, now.angle))
    rows = zip(at, down, scores, now.torque, now.state.tolist(), worst, tipped, strict=True)
    return [
        _Case(settings, x, g, payload, score, torque, state, k, _enough(settings, k), fell)
        if told
        else None
        for told, (x, g, score, torque, state, k, fell) in zip(known, rows, strict=True)
    ]


def _enough(settings: Settings, worst: int) -> float:
    """Return the score at which a margin's warning ends, its deadband included."""
    limits, (tip, span) = settings.limits, _spans(settings)
    if worst < len(SIDES):
        reserve = limits.tip_deadband / tip
    else:
        reserve = limits.torque_deadband / limits.torque[worst - len(SIDES)] / span
    return 1.0 + reserve + SLACK


def _most_severe(scores: Floats) -> int:
    """Return the number of the most severe margin: by level, then tip-over first, then by score."""
    order = [
        (int(score > 0.0) + int(score >= 1.0), k >= len(SIDES), score)
        for k, score in enumerate(scores.tolist())
    ]
    return min(range(len(order)), key=lambda k: order[k])


def _paths(case: _Case) -> Iterator[tuple[_Case, Path]]:
    for path in joint_paths(case.settings, case.q, case.gravity, case.torque):
        yield case, path
    # Turning helps against tipping on a slope, but shakes a robot that is past its ERROR limit.
    if case.tips and case.scores[case.worst] > 0.0:
        for path in turn_paths(case.settings.robot, case.q, case.gravity, case.payload):
            yield case, path


def _ends(cases: Sequence[_Case]) -> Iterator[tuple[_Case, Path, int, float, bool]]:
    """Yield every path that gains something, with step, score and `enough` as `_end` gives them."""
    paths = [found for case in cases for found in _paths(case)]
    if not paths:
        return
    settings, payload = cases[0].settings, cases[0].payload
    q, down = (np.vstack([getattr(p, name) for _, p in paths]) for name in ('q', 'gravity'))
    found = margins(settings.robot, q, down, payload)
    scores = scores_of(settings, found.torque, found.angle)
    cuts = np.cumsum([len(path.q) for _, path in paths])[:-1]
    parts = np.split(scores, cuts), np.split(found.state, cuts)
    for (case, path), mine, states in zip(paths, *parts, strict=True):
        end = _end(case, mine, path.forbidden | (states != case.state))
        if end is not None:
            yield case, path, *end


def _end(
    case: _Case, scores: Floats, forbidden: NDArray[np.bool_]
) -> tuple[int, float, bool] | None:
    """Return the step at which to stop, the worst margin's score there, and whether it is enough.

    None if the path gains too little. `scores` (n, m) are those of every step.
    """
    floor = np.minimum(case.scores, 1.0)
    floor[case.worst] = case.scores[case.worst]
    bad = ~(scores >= floor - SLACK).all(axis=1) | forbidden
    last = int(np.argmax(bad)) if bad.any() else len(bad)
    mine = scores[:last, case.worst]
    reached = np.flatnonzero(mine >= case.enough)
    if len(reached):
        return int(reached[0]), float(mine[reached[0]]), True
    if not last or not mine.max() > case.scores[case.worst] + LEAST_GAIN:
        return None
    # Stop at 95 % of the possible gain.
    gained = mine - case.scores[case.worst]
    k = int(np.argmax(gained >= 0.95 * gained.max()))
    return k, float(mine[k]), False


def _gain(case: _Case, score: float) -> float:
    """Return the gain of a score over the present one, in rad of tilt, N m or N."""
    tip, span = _spans(case.settings)
    more = score - float(case.scores[case.worst])
    if case.tips:
        return more * tip
    return more * span * case.settings.limits.torque[case.worst - len(SIDES)]


def _moves(cases: Sequence[_Case]) -> Iterator[tuple[_Case, Advice]]:
    for case, path, k, score, enough in _ends(cases):
        gain, seconds, amount = _gain(case, score), float(path.seconds[k]), float(path.amount[k])
        if path.subject == 'robot':
            kind, words = 'turn', turn_words(amount, path.gravity[k])
        else:
            kind, words = 'joint', joint_words(case.settings.robot, path, k, case.payload)
        sentence = f'{words}: {_gain_words(case, gain)}, in {seconds:.1f} s'
        yield (
            case,
            Advice(kind, path.subject, amount, seconds, case.subject, gain, enough, sentence),
        )


def _loads(cases: Sequence[_Case]) -> Iterator[tuple[_Case, Advice]]:
    """Yield the advice to set the load down, with the excess mass and the gain without the load."""
    if not cases or cases[0].payload.mass <= 0.0:
        return
    settings, payload = cases[0].settings, cases[0].payload
    q, down = (np.array([getattr(case, name) for case in cases]) for name in ('q', 'gravity'))
    found = margins(settings.robot, q, down, Payload(0.0, payload.cog))
    scores = scores_of(settings, found.torque, found.angle)
    # The largest mass within every joint's warning limit in this posture.
    torque = settings.limits.torque_warn * np.array(settings.limits.torque)
    holds = np.maximum(payload_capacity(settings.robot, q, down, torque), 0.0).tolist()
    for case, mine, held in zip(cases, scores, holds, strict=True):
        score = float(mine[case.worst])
        if not score > case.scores[case.worst] + LEAST_GAIN:
            continue
        gain, enough = _gain(case, score), score >= 1.0
        words = load_words(payload.mass, None if case.tips else held)
        sentence = f'{words}: {_gain_words(case, gain)}'
        # Setting a load down takes longer than moving a joint, so motions are sorted before it.
        told = Advice(
            'payload', 'payload', -payload.mass, 10.0, case.subject, gain, enough, sentence
        )
        yield case, told


def _gain_words(case: _Case, gain: float) -> str:
    """Return a gain in words: cut like a margin, so that there is never less than was said."""
    if case.tips:
        return f'{degrees_words(gain)} further from tipping to the {case.subject}'
    unit = case.settings.robot.joint(case.subject).units.effort
    fine = 10.0 if gain < 10.0 else 1.0
    less = math.floor(gain * fine + SLACK) / fine
    return f'{less:g} {unit} less on the {case.subject.removesuffix("_joint")}'
