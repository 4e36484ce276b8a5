"""A run's report: what each step came to, and what part of the failure map the run has seen."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from ugv_acceptance.config import Config
from ugv_acceptance.plan.maps import safe_maps
from ugv_acceptance.plan.plan import Plan
from ugv_acceptance.plan.search import Arm, roles_of

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font: 15px/1.4 system-ui, sans-serif; max-width: 60rem; margin: 1rem auto; padding: 1rem }}
pre {{ white-space: pre-wrap; font-size: .9rem }}
figure {{ margin: .5rem 0; break-inside: avoid }} svg {{ max-width: 100%; height: auto }}
</style></head>
<body><h1>{title}</h1><pre>{text}</pre>
<h2>The failure map and where the run has been</h2>
<p>Level ground, turret ahead. Blue: cells visited, with any load and on any ground. Numbers: steps
held on level ground with that load; H: home.</p>
{maps}</body></html>
"""


def html_of(text: str, plan: Plan, config: Config, coverage: Mapping[str, Any]) -> str:
    """Return a run's report, its text and the maps of its coverage, as one HTML page."""
    arm = Arm(config.settings, roles_of(config.settings))
    figures = [
        f'<figure>{m["svg"]}<figcaption>{escape(m["caption"])}</figcaption></figure>'
        for m in safe_maps(arm, plan, coverage['visited_deg'])
    ]
    title = f'Run of plan {plan.plan}'
    return PAGE.format(title=escape(title), text=escape(text), maps=''.join(figures))


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
        'failure map: {cells_visited} of {cells_reachable} cells of {cell_deg:g} deg visited'
        ' ({share:.1%})'.format(**coverage),
        *approaches(coverage),
    ]
    return '\n'.join(lines) + '\n'


def counts_of(result: Mapping[str, Any]) -> str:
    """Return how many steps came to what, and how many were asked of nobody."""
    counts = ', '.join(f'{count} {verdict}' for verdict, count in result['counts'].items() if count)
    steps, spared = len(result['steps']), len(result['steps']) - result['asked']
    text = f'{steps} steps: {counts}'
    if spared:
        text += f'; {spared} would pass a limit, for the simulation only: they do not count'
    return text


def approaches(coverage: Mapping[str, Any]) -> list[str]:
    """Return how close a run came to each limit on either side, a line each."""
    kinds = (('torque limit', 'torque_limit', 100.0, '%'), ('tilt', 'tip_limit_deg', 1.0, ' deg'))
    return [
        _approach_line(f'{what}, {name}', found, scale, unit)
        for what, key, scale, unit in kinds
        for name, found in coverage[key].items()
    ]


def _step_lines(step: dict[str, Any]) -> Sequence[str]:
    told, found = step.get('expected') or {}, step.get('measured') or {}
    numbers = [
        f'tilt left {told["tilt_left_deg"]:.1f} expected, {found["tilt_left_deg"]:.1f} deg found'
        for _ in ('tilt',)
        if told.get('tilt_left_deg', 0.0) > 0.0 and 'tilt_left_deg' in found
    ]
    tried = [f'an attempt before: {"; ".join(e["reasons"])}' for e in step.get('earlier', ())]
    reasons = [f'    {reason}' for reason in (*step['reasons'], *numbers, *tried)]
    return [f'{step["verdict"]:<13}{step["id"]}: {step["title"]}', *reasons]


def _approach_line(what: str, found: dict[str, float | None], scale: float, unit: str) -> str:
    sides = [
        f'{side} by {value * scale:.1f}{unit}' if value is not None else f'never {side}'
        for side, value in found.items()
    ]
    return f'closest to the limit: {what}: {", ".join(sides)}'
