"""Judges a step of a plan by its recording: the alerts it raised, and whether it tipped or held."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts.messages import pattern_words
from ugv_acceptance.evaluation.ground import Ground
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.margin_words import degrees_words, share_words
from ugv_acceptance.evaluation.settings import ALWAYS
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.judge import Options
from ugv_acceptance.plan.plan import Step, matches
from ugv_acceptance.report.format import is_bound
from ugv_acceptance.type_aliases import Floats

PASS, FAIL, INCONCLUSIVE, SKIPPED = 'PASS', 'FAIL', 'INCONCLUSIVE', 'SKIPPED'
VERDICTS = (FAIL, INCONCLUSIVE, SKIPPED, PASS)
# Less than this share of the hold evaluated: nothing was shown.
LEAST = 0.95
# A robot past its tipping point by more than this (deg) has tipped over.
FALLEN = 10.0


@dataclass(frozen=True, slots=True)
class Done:
    """The runner's record of a step it did; times are ns of the recording's clock.

    `begin` is when the motion began, `hold` and `end` bound the time in which nothing unwanted may
    be active. `wrong` says how the posture was not reached or held, `stopped` why the motion was
    frozen, `fault` what was missing, so that nothing was shown; empty: nothing.
    """

    begin: int
    hold: int
    end: int
    wrong: str = ''
    stopped: str = ''
    fault: str = ''


@dataclass(slots=True)
class Seen:
    """The margins of a recording, collected part by part.

    Times (n,) in ns, positions `q` (n, j), shares `use` (n, j) of the torque limits, tilt left
    (n, 4) in rad towards each of SIDES.
    """

    limits: Floats
    time: list[NDArray[np.int64]] = field(default_factory=list)
    q: list[Floats] = field(default_factory=list)
    use: list[Floats] = field(default_factory=list)
    tilt: list[Floats] = field(default_factory=list)

    def add(self, rows: MarginRows) -> None:
        """Add the margins of the next part; rows without margins are left out."""
        known = rows.known
        self.time.append(rows.time[known])
        self.q.append(rows.q[known])
        self.use.append(np.abs(rows.torque[known]) / self.limits)
        self.tilt.append(rows.angle[known])

    def joined(self) -> tuple[NDArray[np.int64], Floats, Floats, Floats]:
        """Return time, q, use and tilt of the whole recording."""
        none = np.empty((0, len(self.limits)))
        if not self.time:
            return np.empty(0, np.int64), none, none, np.empty((0, len(SIDES)))
        q, use, tilt = (np.concatenate(c) for c in (self.q, self.use, self.tilt))
        return np.concatenate(self.time), q, use, tilt


def judge_step(step: Step, folder: Path, config: Config, done: Done) -> dict[str, Any]:
    """Return a step's result for JSON. Raises BadBag where its recording cannot be read."""
    if step.hand_may_touch:
        config = replace(config, settings=replace(config.settings, hand_may_touch=ALWAYS))
    start, result, seen = _judged(folder, config, step)
    window = tuple((t - start) / 1e9 for t in (done.begin, done.hold, done.end))
    found = {
        'id': step.id,
        'title': step.title,
        'expected': dict(step.expected),
        'measured': measured(seen, done),
        'window_s': window,
        'alerts': result['alerts'],
        'bag': result['bag'],
        'covered': covered(seen, done),
    }
    if step.action == 'tip' and not done.wrong:
        done = replace(done, wrong=stood(seen, done))
    verdict, reasons = decide(step, found['alerts'], window, done, found['covered'])
    if verdict == PASS and is_bound(result):
        verdict, reasons = _rough(step, result['ground'])
    return {'verdict': verdict, 'reasons': reasons, **found}


def seen_in(folder: Path, config: Config) -> Seen:
    """Return the margins of a recording. Raises BadBag where it cannot be read."""
    return _judged(folder, config)[2]


def _judged(
    folder: Path, config: Config, step: Step | None = None
) -> tuple[int, dict[str, Any], Seen]:
    """Return a recording's first time (ns), its evaluation result and its margins."""
    seen = Seen(np.array(config.settings.limits.torque))
    ground = Ground(step.ground.kind) if step and step.ground.kind else None
    found = evaluate(folder, config=config, ground=ground, options=Options(takers=(seen.add,)))
    return found.recording.start_ns, found.result, seen


def decide(
    step: Step,
    alerts: Iterable[Mapping[str, Any]],
    window: tuple[float, ...],
    done: Done,
    share: float,
) -> tuple[str, list[str]]:
    """Return the verdict on a step (PASS, FAIL, INCONCLUSIVE) and its reasons."""
    begin, hold, end = window
    alerts = list(alerts)
    missing = [
        f'expected {pattern_words(pattern)}: no such alert was raised'
        for pattern in step.alerts.must
        if not any(_matches(pattern, a) and _active(a, begin, end) for a in alerts)
    ]
    active = [
        a
        for a in alerts
        if _active(a, hold, end) and any(_matches(p, a) for p in step.alerts.must_not)
    ]
    # Missing data neither passes nor fails.
    unwanted = [_told(a) for a in active if a['level'] != 'STALE']
    unknown = [_told(a) for a in active if a['level'] == 'STALE']
    if done.fault:
        return INCONCLUSIVE, [done.fault]
    if done.stopped:
        return FAIL, [f'stopped: {done.stopped}']
    if share < LEAST and not any(p.startswith('STALE') for p in step.alerts.must):
        unknown.append(f'only {share_words(share)} of the hold could be evaluated')
    # An alert may have been due while margins were unknown.
    wrong = [*unwanted, *([done.wrong] if done.wrong else [])]
    if wrong or (missing and not unknown):
        return FAIL, [*missing, *wrong, *unknown]
    if unknown:
        return INCONCLUSIVE, [*missing, *unknown]
    return PASS, ['all alerts as expected']


def _rough(step: Step, ground: Mapping[str, Any]) -> tuple[str, list[str]]:
    """Return the verdict on a step whose alerts are as expected, on ground that is not flat."""
    accept, known = step.ground.accept, ground['trend_known_share'] or 0.0
    if accept is None:
        return INCONCLUSIVE, [*ground['objections']]
    if known < LEAST:
        return INCONCLUSIVE, [f'the trend of the tilt left is known for {share_words(known)} only']
    return PASS, [f'all alerts as expected; the trend accepted ({step.ground.reason})']


def _told(alert: Mapping[str, Any]) -> str:
    name = pattern_words('{level} {code} {subject}'.format(**alert))
    return f'{name} was active: {alert["message"]}'


def _matches(pattern: str, alert: Mapping[str, Any]) -> bool:
    return matches(pattern, alert['level'], alert['code'], alert['subject'])


def _active(alert: Mapping[str, Any], begin: float, end: float) -> bool:
    over = alert['end_s'] is not None and alert['end_s'] < begin
    return bool(alert['start_s'] <= end and not over)


def measured(seen: Seen, done: Done) -> dict[str, float]:
    """Return the median margins during the hold, with the keys and units of `expected`."""
    time, _, use, tilt = seen.joined()
    rows = (time >= done.hold) & (time <= done.end)
    if not rows.any():
        return {}
    tilt_left = round(float(np.degrees(np.median(tilt[rows].min(axis=1)))), 2)
    # Not known where the hand touches the ground, nor of a robot without joints.
    most = use[rows].max(axis=1) if use.shape[1] else np.empty(0)
    most = most[~np.isnan(most)]
    told = {'use': round(float(np.median(most)), 4)} if len(most) else {}
    return {'tilt_left_deg': tilt_left, **told}


def stood(seen: Seen, done: Done) -> str:
    """Return why the robot counts as not tipped over, as text; empty if it tipped over."""
    time, _, _, tilt = seen.joined()
    rows = tilt[(time >= done.begin) & (time <= done.end)]
    least = float(rows.min()) if rows.size else math.inf
    if math.degrees(least) < -FALLEN:
        return ''
    return f'the robot did not tip over: {degrees_words(least)} to tipping'


def covered(seen: Seen, done: Done) -> float:
    """Return the share of the hold for which margins are known: rows less than 0.2 s apart."""
    time = seen.joined()[0]
    inside = time[(time >= done.hold) & (time <= done.end)]
    edges = np.concatenate(([done.hold], inside, [done.end]))
    steps = np.diff(edges)
    length = max(done.end - done.hold, 1)
    return float(steps[steps < 200_000_000].sum() / length)


def whole(results: Iterable[Mapping[str, Any]]) -> str:
    """Return the verdict on a run: FAIL if a step failed, PASS if all passed, else INCONCLUSIVE."""
    found = {str(r['verdict']) for r in results}
    if FAIL in found:
        return FAIL
    return PASS if found == {PASS} else INCONCLUSIVE
