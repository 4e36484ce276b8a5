"""Do alerts come in time: labelled runs on both cores; `python -m bench.bench_scenarios`.

Prints recall of critical events, warning time before them by kind (p5, p50), false critical alerts
per hour of quiet work by kind, the same for predictions, and how fast the simulation was.
In parts: `--runs 0 --hours 5 --seed 30 --json b.json`; then `--runs 0 --hours 0 --add *.json`.
"""

import argparse
import json
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import cache
from itertools import chain
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from bench.labelled_runs import Event, Labelled, cases, label, work_cases
from ugv_acceptance.config import Config, load
from ugv_acceptance.run.catalogue import Case

# A warning this long (s) before a tip-over is in time.
IN_TIME = 0.5


@cache
def config() -> Config:
    """Return the configuration that ships, once a process."""
    return load()


def one(task: tuple[str, int, Case]) -> Labelled:
    """Label one case."""
    return label(config(), *task)


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--runs', type=int, default=200, help='runs in which something may happen')
    parser.add_argument('--hours', type=float, default=50.0, help='simulated hours of quiet work')
    parser.add_argument('--seed', type=int, default=0, help='quiet work: one a ten minutes')
    parser.add_argument('--workers', type=int, default=2)
    parser.add_argument('--json', type=Path, help='write every run to this file')
    parser.add_argument('--add', type=Path, nargs='*', default=[], help='runs of earlier parts')
    asked = parser.parse_args()
    tasks = [*cases(config(), asked.runs, asked.seed)]
    quiet = [*work_cases(config(), asked.hours, asked.seed)]
    made: list[Labelled] = []
    if tasks or quiet:
        with ProcessPoolExecutor(asked.workers, mp_context=get_context('spawn')) as pool:
            # Starts the processes and compiles the formulas.
            list(pool.map(one, [next(cases(config(), 1, 0))] * asked.workers))
            for name, part in (('labelled runs', tasks), ('quiet work', quiet)):
                made += timed(name, pool, part)
    if asked.json:
        asked.json.write_text(json.dumps([asdict(r) for r in made], default=float))
    made += chain.from_iterable(map(read, asked.add))
    table([r for r in made if r.kind != 'work'])
    silence([r for r in made if r.kind == 'work'])


def read(path: Path) -> list[Labelled]:
    """Return the runs of a file that --json wrote."""
    return [
        Labelled(**{**run, 'events': tuple(Event(**e) for e in run['events'])})
        for run in json.loads(path.read_text())
    ]


def timed(
    name: str, pool: ProcessPoolExecutor, tasks: list[tuple[str, int, Case]]
) -> list[Labelled]:
    """Return the labelled runs; print simulated seconds a second."""
    began = time.perf_counter()
    found = list(pool.map(one, tasks))
    taken = time.perf_counter() - began
    if found:
        speed = sum(r.seconds for r in found) / taken
        print(f'{name}: {len(found)} runs at {speed:.0f} x real time')
    return found


def table(found: list[Labelled]) -> None:
    """Print recall and warning times by kind of run and event."""
    if not found:
        return
    head = ('run', 'event', 'n', 'warned', 'alarmed', 'first p5', 'p50', 'ERROR p5', 'p50',
            'ahead', 'p5', 'p50')  # fmt: skip
    widths = (28, 11, 4, 7, 8, 9, 6, 9, 6, 6, 6, 6)
    print(''.join(f'{h:>{w}}' for h, w in zip(head, widths, strict=True)))
    kinds = sorted({(r.kind, e.kind) for r in found for e in r.events}, key=lambda k: (k[1], k[0]))
    for kind, event in [*kinds, ('all', 'tip-over'), ('all', 'saturation')]:
        of = [e for r in found for e in r.events if e.kind == event and kind in ('all', r.kind)]
        cells = (kind, event, len(of), *seen(of))
        print(''.join(f'{c!s:>{w}}' for c, w in zip(cells, widths, strict=True)))
    in_time(found)
    early(found)


def in_time(found: list[Labelled]) -> None:
    """Print how many tip-overs were warned of half a second before, with and without an impact."""
    for impact, text in ((False, 'no impact'), (True, 'an impact')):
        of = [(r.kind, e) for r in found for e in r.events if e.kind == 'tip-over']
        left: dict[str, list[float]] = {k: [] for k, e in of if e.impact == impact}
        for kind, event in of:
            if event.impact == impact:
                left[kind].append(event.time - event.warned)
        times = [x for one in left.values() for x in one]
        soon = sum(x >= IN_TIME for x in times)
        late = ', '.join(f'{k} {sum(x < IN_TIME for x in v)} of {len(v)}'
                         for k, v in sorted(left.items()) if min(v) < IN_TIME)  # fmt: skip
        share = f'{soon / len(times):.1%}' if times else 'none'
        print(f'tip-overs with {text}: {len(times)}, warned {IN_TIME} s before: {share}')
        if late:
            print(f'  later: {late}')


def seen(events: list[Event]) -> list[str]:
    """Return shares and percentiles of warning times (s) as texts."""
    texts = []
    of = {n: np.array([e.time - getattr(e, n) for e in events]) for n in
          ('warned', 'alarmed', 'predicted')}  # fmt: skip
    shares = {name: np.isfinite(left).mean() for name, left in of.items()}
    texts += [f'{shares["warned"]:.0%}', f'{shares["alarmed"]:.0%}']
    texts += [*percentiles(of['warned']), *percentiles(of['alarmed'])]
    return [*texts, f'{shares["predicted"]:.0%}', *percentiles(of['predicted'])]


def percentiles(left: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> list[str]:
    """Return p5 and p50; an event without a warning counts as minus infinity."""
    if not len(left):
        return ['', '']
    return [f'{x:.2f}' for x in np.percentile(left, [5, 50], method='lower')]


def early(found: list[Labelled]) -> None:
    """Print false critical alerts in runs meant to be critical."""
    calm = [r for r in found if not r.events]
    alerts = Counter(code for r in calm for _, code, _ in r.for_nothing)
    told = ', '.join(f'{n} {code}' for code, n in alerts.most_common()) or 'none'
    print(f'{len(calm)} of these runs came to nothing; critical alerts in them: {told}')


def silence(work: list[Labelled]) -> None:
    """Print false alerts in quiet work."""
    if not work:
        return
    hours = sum(r.seconds for r in work) / 3600.0
    events = sum(len(r.events) for r in work)
    alerts = [a for r in work for a in r.for_nothing]
    told = sum(r.predictions_for_nothing for r in work)
    print(f'quiet work: {hours:.2f} h simulated, {events} true events')
    # No alert in T hours bounds the rate by 3/T at 95 %.
    bound = f' (95 %: at most {3.0 / hours:.2f})' if not alerts else ''
    print(f'critical alerts for nothing: {len(alerts)}, {len(alerts) / hours:.2f} an hour{bound}')
    print(f'predictions for nothing: {told}, {told / hours:.2f} an hour')
    for alert, count in Counter(
        map(tuple, chain(alerts, *(r.warnings for r in work)))
    ).most_common():
        print(f'  {count / hours:.2f} an hour: {" ".join(alert)}')


if __name__ == '__main__':
    main()
