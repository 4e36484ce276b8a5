"""The report of a campaign: its statement as one self-contained HTML page with a trend chart."""

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ugv_acceptance.report.format import hours_text, number_text
from ugv_acceptance.report.regions import figure, svg_of
from ugv_acceptance.type_aliases import Json

# Most runs listed one by one; campaign.json has all.
MOST_RUNS = 400
MOST_FAILURES = 400
MARKS = {
    'PASS': '✓',
    'FAIL': '✗',
    'INCONCLUSIVE': '?',
    'DOUBTFUL': '≈',
    'BROKEN': '!',
    'NOT_JUDGED': '∅',
}


def campaign_page(said: Json) -> str:
    """Return the HTML of the report on a campaign's statement."""
    environment = Environment(
        loader=PackageLoader('ugv_acceptance.report'), autoescape=True, undefined=StrictUndefined
    )
    environment.filters.update(number=number_text, percent=_percent, hours=hours_text)
    runs = sorted(said['each_run'], key=lambda run: run['verdict'] == 'PASS')
    made = trend_figure(said)
    return environment.get_template('campaign.html').render(
        said=said,
        marks=MARKS,
        confidence=f'{said["confidence"]:.0%}',
        trend=svg_of(made, 'trend') if made else None,
        runs=runs[:MOST_RUNS],
        more_runs=max(0, len(runs) - MOST_RUNS),
        failures=said['failures']['each'][:MOST_FAILURES],
        more_failures=max(0, len(said['failures']['each']) - MOST_FAILURES),
        closing=closing(said),
    )


def closing(said: Json) -> str:
    """Return the last sentence of the report: what the campaign shows."""
    if said['no_statement'] is not None:
        return f'{said["no_statement"]}. Run the same command again to judge the missing runs.'
    found = said['requirement']
    if found is None:
        return 'No reliability was required of this campaign; it states what was observed.'
    wanted = f'MTBF of {found["mtbf_h"]:g} h at {said["confidence"]:.0%} confidence'
    return {
        'PASS': f'This campaign met this criterion: {wanted}.',
        'FAIL': f'This campaign did not meet this criterion: {wanted}.',
        'INCONCLUSIVE': f'This campaign did not meet this criterion: {wanted}; it may still hold.',
    }[found['verdict']]


def trend_figure(said: Json) -> Figure | None:
    """Return failures over judged hours: count, constant rate, power law; None without failures."""
    if said['trend'] is None:
        return None
    times, hours = said['trend']['failure_times_h'], said['hours']['counted']
    if not times or hours <= 0.0:
        return None
    made = figure(7.6, 3.4)
    axes = made.add_subplot()
    axes.step([0.0, *times, hours], [0, *range(1, len(times) + 1), len(times)], where='post')
    axes.lines[0].set(color='black', linewidth=1.4, label='failures')
    axes.plot([0.0, hours], [0.0, len(times)], ':', color='#555555', label='constant rate')
    law = said['trend']['power_law']
    if law is not None:
        grid = np.linspace(0.0, hours, 200)
        text = f'power law, slope {law["beta"]:.2f}'
        axes.plot(grid, law['scale'] * grid ** law['beta'], '--', color='#0b57a4', label=text)
    axes.set(xlabel='judged operating time (h)', ylabel='failures so far', xlim=(0.0, hours))
    axes.set_ylim(bottom=0.0)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(visible=True, linewidth=0.3)
    axes.legend(loc='upper left')
    return made


def _percent(value: float | None) -> str:
    return number_text(None if value is None else 100.0 * value, 1, '%')
