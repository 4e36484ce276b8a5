"""Sums up and draws what bench_soak.py wrote."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

# Seconds until the monitor's memory is what it will be: caches are full, the past is kept.
WARM = 300.0
# Columns of which the first and the last hour are compared, with what they are.
CURVES = {
    'rss_mb': 'memory, resident, MB',
    'anon_mb': 'memory of its own, MB',
    'blocks': 'Python objects',
    'fds': 'open files',
    'threads': 'threads',
    'cpu_pct': 'CPU of the monitor, %',
    'late_p50_ms': 'lateness p50, ms',
    'late_p99_ms': 'lateness p99, ms',
    'late_p100_ms': 'lateness max, ms',
    'robot_late_ms': 'robot late to send, ms',
    'verdict_gap_s': 'between verdicts, s',
    'load': 'load of the machine',
}
DRAWN = ('rss_mb', 'blocks', 'cpu_pct', 'late_p99_ms', 'load')


def columns_of(path: Path) -> dict[str, Any]:
    """Return the columns as arrays."""
    with path.open(newline='', encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def told(path: Path, of: dict[str, Any]) -> tuple[str, str]:
    """Return what was sent and missed, and what was alerted."""
    counts = {name: of[name].sum() for name in ('raised', 'unexpected', 'acknowledged', 'refused')}
    counts |= {'faults': of['faults'][-1], 'without an alert': of['silent'][-1]}
    sent, missed = of['sent'][-1], of['missed'][-1]
    hours = of['t_s'][-1] / 3600.0
    return (
        f'{path.stem}: {hours:.2f} h, {sent:,.0f} messages sent, {missed:,.0f} missed at the end',
        '  alerts: ' + ', '.join(f'{name} {number:.0f}' for name, number in counts.items()),
    )


def summarise(path: Path) -> str:
    """Return a table: medians of the first hour and the last, and the slope an hour."""
    of = columns_of(path)
    t = of['t_s']
    span = min(3600.0, (t[-1] - WARM) / 2) if t[-1] > WARM else t[-1] / 2
    settled = t >= min(WARM, t[-1] / 4)
    first, last = settled & (t <= t[settled][0] + span), t >= t[-1] - span
    hours = t / 3600.0
    lines = [
        *told(path, of),
        f'  {"":28}{"first hour":>12}{"last hour":>12}{"an hour":>12}{"largest":>12}',
    ]
    for name, title in CURVES.items():
        y, known = of[name], np.isfinite(of[name])
        use = settled & known
        slope = np.polyfit(hours[use], y[use], 1)[0] if use.sum() > 1 else np.nan
        values = [np.median(y[part & known]) for part in (first, last)]
        cells = ''.join(f'{v:12,.3f}' for v in (*values, slope, y[use].max()))
        lines.append(f'  {title:28}{cells}')
    return '\n'.join(lines)


def draw(paths: Sequence[Path], picture: Path) -> None:
    """Draw the curves of all stretches, one below the other."""
    import matplotlib as mpl  # noqa: PLC0415 - slow, and needed here only

    mpl.use('Agg')
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, axes = plt.subplots(len(DRAWN), 1, sharex=True, figsize=(9.0, 11.0))
    for path in paths:
        of = columns_of(path)
        for axis, name in zip(axes, DRAWN, strict=True):
            axis.plot(of['t_s'] / 3600.0, of[name], label=path.stem, linewidth=0.8)
    for axis, name in zip(axes, DRAWN, strict=True):
        axis.set_ylabel(CURVES[name], fontsize=8)
        axis.grid(alpha=0.3)
    axes[0].legend()
    axes[-1].set_xlabel('hours')
    figure.tight_layout()
    figure.savefig(picture)
