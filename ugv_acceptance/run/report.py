"""The report of a run: the verdict of each step, and how much of the safe map was visited."""

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.margin_words import share_words
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.plan.maps import safe_maps, standing_words
from ugv_acceptance.plan.plan import Plan
from ugv_acceptance.plan.search import STEP_DEG, Arm
from ugv_acceptance.run.step_verdict import Seen
from ugv_acceptance.type_aliases import Floats

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font: 15px/1.4 system-ui, sans-serif; max-width: 60rem; margin: 1rem auto; padding: 1rem }}
pre {{ white-space: pre-wrap; font-size: .9rem }}
figure {{ margin: .5rem 0; break-inside: avoid }} svg {{ max-width: 100%; height: auto }}
</style></head>
<body><h1>{title}</h1><pre>{text}</pre>
{maps}</body></html>
"""
MAPS = """<h2>The failure map and where the run has been</h2>
<p>{standing}. Blue: cells visited, with any load and on any ground. Numbers: steps
held on level ground with that load; H: home.</p>
{figures}"""


def html_of(text: str, plan: Plan, config: Config, coverage: Mapping[str, Any]) -> str:
    """Return a run's report as one HTML page: its text and the maps with the visited cells."""
    arm = Arm(config.settings)
    figures = [
        f'<figure>{m["svg"]}<figcaption>{escape(m["caption"])}</figcaption></figure>'
        for m in safe_maps(arm, plan, coverage['visited_deg'])
    ]
    title = f'Run of plan {plan.plan}'
    words = escape(standing_words(arm))
    maps = MAPS.format(standing=words, figures=''.join(figures)) if figures else ''
    return PAGE.format(title=escape(title), text=escape(text), maps=maps)


def report_of(result: dict[str, Any]) -> str:
    """Return a run's report as plain text."""
    coverage = result['coverage']
    lines = [
        '{}: plan {} on {} ({})'.format(
            result['verdict'], result['plan']['name'], result['robot']['name'], result['mode']
        ),
        f'plan sha256 {result["plan"]["sha256"]}',
        f'robot files sha256 {result["robot"]["sha256"]}',
        f'robot serial number {result["robot"]["serial"] or "not entered"}',
        f'ugv_acceptance {result["software"]}',
        counts_of(result),
        '',
        *(line for step in result['steps'] for line in _step_lines(step)),
        '',
        *visited_lines(coverage),
        *approaches(coverage),
    ]
    return '\n'.join(lines) + '\n'


def counts_of(result: Mapping[str, Any]) -> str:
    """Return how many steps had each verdict, and how many were only for the simulation."""
    counts = ', '.join(f'{count} {verdict}' for verdict, count in result['counts'].items() if count)
    steps, spared = len(result['steps']), len(result['steps']) - result['asked']
    text = f'{steps} steps: {counts}'
    if spared:
        text += f'; {spared} would exceed a limit and are for simulation only: they do not count'
    return text


def visited_lines(coverage: Mapping[str, Any]) -> list[str]:
    """Return how much of the map of the arm's joints was visited; no line without an arm."""
    if not coverage['joints']:
        return []
    text = 'failure map: {cells_visited} of {cells_reachable} cells of {cell_deg:g} deg visited'
    return [f'{text.format(**coverage)} ({share_words(coverage["share"], 1)})']


def approaches(coverage: Mapping[str, Any]) -> list[str]:
    """Return how close a run came to each limit from either side, one line of text each."""
    kinds = (('torque limit', 'torque_limit', 100.0, '%'), ('tilt', 'tip_limit_deg', 1.0, ' deg'))
    return [
        _approach_line(f'{what}, {name}', found, scale, unit)
        for what, key, scale, unit in kinds
        for name, found in coverage[key].items()
    ]


def _step_lines(step: dict[str, Any]) -> Sequence[str]:
    told, found = step.get('expected') or {}, step.get('measured') or {}
    numbers = [
        f'tilt left {told["tilt_left_deg"]:.1f} expected, {found["tilt_left_deg"]:.1f} deg measured'
        for _ in ('tilt',)
        if told.get('tilt_left_deg', 0.0) > 0.0 and 'tilt_left_deg' in found
    ]
    tried = [f'earlier attempt: {"; ".join(e["reasons"])}' for e in step.get('earlier', ())]
    reasons = [f'    {reason}' for reason in (*step['reasons'], *numbers, *tried)]
    return [f'{step["verdict"]:<13}{step["id"]}: {step["title"]}', *reasons]


def _approach_line(what: str, found: dict[str, float | None], scale: float, unit: str) -> str:
    sides = [
        f'{side} by {value * scale:.1f}{unit}' if value is not None else f'never {side}'
        for side, value in found.items()
    ]
    return f'closest to the limit: {what}: {", ".join(sides)}'


def coverage_of(config: Config, seen: Iterable[Seen]) -> dict[str, Any]:
    """Return which of the arm's postures were visited by the recorded margins `seen`, for JSON.

    Cells are squares of the two arm joints' positions, `visited_deg` their lower corners (first
    joint -> second); only those that keep clear of ground and deck count. `inside` and `outside`
    are the closest approaches to the torque limit of each joint (a share of it) and to the tilt
    limit on each of SIDES (deg); None on a side the run was never on.
    """
    arm = Arm(config.settings)
    axes = arm.columns
    reachable = cells(arm.grid[:, axes]) if axes else set()
    visited: set[tuple[int, int]] = set()
    names = arm.robot.joint_names
    use, tilt = [np.empty((0, len(names)))], [np.empty((0, len(SIDES)))]
    for one in seen:
        _, q, used, left = one.joined()
        visited |= cells(q[:, axes]) if axes else set()
        use.append(used)
        tilt.append(left)
    limits = config.settings.limits
    torque = np.concatenate(use) - limits.torque_error
    angle = np.degrees(limits.tip_error - np.concatenate(tilt))
    there: dict[str, list[float]] = {}
    for a, b in sorted(visited & reachable):
        there.setdefault(f'{a * STEP_DEG - 180.0:g}', []).append(b * STEP_DEG - 180.0)
    limited = [(n, k) for k, n in enumerate(names) if math.isfinite(limits.torque[k])]
    return {
        'cell_deg': STEP_DEG,
        'joints': list(arm.varied),
        'cells_reachable': len(reachable),
        'cells_visited': len(visited & reachable),
        'share': round(len(visited & reachable) / max(len(reachable), 1), 4),
        'visited_deg': there,
        'torque_limit': {name: _approach(torque[:, k]) for name, k in limited},
        'tip_limit_deg': {side: _approach(angle[:, k]) for k, side in enumerate(SIDES)},
    }


def cells(q: Floats) -> set[tuple[int, int]]:
    """Return the map cells that positions (n, 2) in rad lie in, modulo full turns."""
    turned = (np.degrees(q) + 180.0) % 360.0
    turned = turned[np.isfinite(turned).all(axis=1)]
    return {(int(a), int(b)) for a, b in np.unique(np.floor(turned / STEP_DEG + 1e-6), axis=0)}


def _approach(beyond: Floats) -> dict[str, float | None]:
    """Return how close values came to zero from below (inside) and from above (outside)."""
    beyond = beyond[np.isfinite(beyond)]
    inside, outside = -beyond[beyond <= 0.0], beyond[beyond > 0.0]
    return {
        'inside': round(float(inside.min()), 4) if inside.size else None,
        'outside': round(float(outside.min()), 4) if outside.size else None,
    }
