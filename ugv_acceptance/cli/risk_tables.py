"""The verb risk's results as lines to read and as a document."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ugv_acceptance.cli.risk_study import Phase
from ugv_acceptance.studies.risk import EVENTS, Risk, estimate
from ugv_acceptance.studies.spread import NORMAL, Spread, together

# Inputs shown: those that matter most.
SHOWN = 8
_ANGLES = ('slope', 'heading', '.position', '.rate')


def phase_lines(phase: Phase, risk: Risk) -> list[str]:
    """Return what a person reads of one phase."""
    first = risk.estimates['either']
    lines = [f'{phase.name}: {first.samples:,} samples, seed {risk.seed}, 95 % intervals']
    lines += [
        f'  {event:12}{found.probability:12.6f}   [{found.low:.6f}, {found.high:.6f}]'
        for event, found in risk.estimates.items()
    ]
    lines.append('  convergence of "either"')
    for e in risk.history['either']:
        lines.append(f'  {e.samples:>14,}{e.probability:12.6f}   +/- {(e.high - e.low) / 2:.6f}')
    lines += ['  what matters most (share of the variance explained alone)']
    lines.append(f'    {"input":28}{"saturation":>12}{"rollover":>12}   drawn')
    ranked = sorted(risk.sensitivity, key=lambda name: -max(risk.sensitivity[name].values()))
    for name in ranked[:SHOWN]:
        share, spread = risk.sensitivity[name], phase.study.spreads[name]
        numbers = f'{100 * share["saturation"]:11.1f}%{100 * share["rollover"]:11.1f}%'
        lines.append(f'    {name:28}{numbers}   {words(name, spread)}')
    if phase.not_varied:
        lines.append(f'  not varied: {", ".join(phase.not_varied)}')
    return lines


def words(name: str, spread: Spread) -> str:
    """Return a spread in words; angles in degrees."""
    turn = any(name == part or name.endswith(part) for part in _ANGLES)
    low, high = ((math.degrees(x) if turn else x) for x in (spread.low, spread.high))
    unit = ' deg' if turn and not name.endswith('.rate') else ' deg/s' if turn else ''
    if spread.kind == NORMAL:
        return f'normal, {low:.4g} +- {high:.4g}{unit}'
    return f'even, {low:.4g} to {high:.4g}{unit}'


def mission_lines(phases: Sequence[Phase], risks: Sequence[Risk]) -> list[str]:
    """Return the mission's probability: at least one failure in all phases, each so often."""
    lines = ['mission: at least one failure, phases independent, 95 % intervals']
    for event, (low, middle, high) in mission_risk(phases, risks).items():
        lines.append(f'  {event:12}{middle:12.6f}   [{low:.6f}, {high:.6f}]')
    return lines


def mission_risk(
    phases: Sequence[Phase], risks: Sequence[Risk]
) -> dict[str, tuple[float, float, float]]:
    """Return low, best and high probability an event.

    Each phase's interval is exact at 1 - 0.05 / phases, so all hold together at 95 % (Bonferroni);
    the mission's probability rises with each phase's.
    """
    confidence = 1.0 - 0.05 / len(phases)
    times = [phase.times for phase in phases]
    found = {}
    for event in EVENTS:
        each = [
            estimate(r.estimates[event].failures, r.estimates[event].samples, confidence)
            for r in risks
        ]
        columns = ([e.low for e in each], [e.probability for e in each], [e.high for e in each])
        low, middle, high = (together(column, times) for column in columns)
        found[event] = (low, middle, high)
    return found


def as_document(phases: Sequence[Phase], risks: Sequence[Risk]) -> dict[str, Any]:
    """Return everything for JSON."""
    return {
        'phases': [
            {
                'name': phase.name,
                'times': phase.times,
                'seed': risk.seed,
                'estimates': {k: asdict(v) for k, v in risk.estimates.items()},
                'history': {k: [asdict(e) for e in v] for k, v in risk.history.items()},
                'sensitivity': risk.sensitivity,
                'spreads': {k: asdict(v) for k, v in phase.study.spreads.items()},
                'not_varied': list(phase.not_varied),
            }
            for phase, risk in zip(phases, risks, strict=True)
        ],
        'mission': {
            event: {'low': low, 'probability': middle, 'high': high}
            for event, (low, middle, high) in mission_risk(phases, risks).items()
        },
    }
