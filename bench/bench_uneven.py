"""Tip-overs on uneven ground: who warns of them, and who cries wolf. docs/uneven_ground.md.

    nice python -m bench.bench_uneven [drives on each scene] [seed] [hours on flat ground]

The drives are split over two processes. Draws docs/images/uneven_tradeoff.png.
"""

import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from bench.uneven_scenes import PITCH
from bench.uneven_trial import EDGES, LOOK, SCENES, Drive, driven_all
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.tipping_trend import ERROR, TREND, WARN, trend_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.shortened_tracks import shortened
from ugv_acceptance.model.stability import margins
from ugv_acceptance.type_aliases import Floats

mpl.use('Agg')
UNEVEN = tuple(s for s in SCENES if s != 'flat' and s not in EDGES)
# Delays (s) of an alert: a level lasts so long before it is raised, is gone so long before it ends.
RAISED, ENDED = 0.1, 1.0
# How far ahead (s) a tip-over is to be warned of; true margin (rad) above which no alert is due,
# looked at from and to so long (s) about an alert; a tip-over so soon (s) after one was meant.
AHEAD, SAFE, ABOUT, MEANT = 0.5, math.radians(7.0), (0.25, 0.5), 3.0
PICTURE = Path(__file__).parent.parent / 'docs/images/uneven_tradeoff.png'
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Seen:
    """A drive with the margins (n, 4) rad of flat ground and of shortened tracks."""

    drive: Drive
    flat: Floats
    cautious: Floats

    @property
    def ns(self) -> NDArray[np.int64]:
        """Return the times of the looks in ns."""
        return np.round(self.drive.time * 1e9).astype(np.int64)


Rule = Callable[[Seen], Mask]


@dataclass(slots=True)
class Count:
    """What a rule did: tip-overs, those warned of in time, false alerts, and more.

    `late` are tip-overs warned AHEAD of when the robot lies, not of the last balance. `idle` and
    `calm_s` are alerts and seconds of drives without a tip-over, `on_s` seconds under alert there.
    """

    tips: int = 0
    warned: int = 0
    late: int = 0
    false: int = 0
    seconds: float = 0.0
    idle: int = 0
    calm_s: float = 0.0
    on_s: float = 0.0


def seen(robot: Robot, drive: Drive) -> Seen:
    """Return the margins that a monitor would compute from the sensors of a drive."""
    load_kg = Payload(drive.trial.load, robot.payload.cog)
    narrow = shortened(robot, PITCH / 2.0)
    flat, cautious = (margins(r, drive.q, drive.gravity, load_kg).angle for r in (robot, narrow))
    return Seen(drive, flat, cautious)


def below(limit: float, *, cautious: bool = False) -> Rule:
    """Return the rule that warns below a least margin (deg)."""
    edge = math.radians(limit)
    return lambda s: (s.cautious if cautious else s.flat).min(axis=1) < edge


def trend(least: int = WARN, warn: float | None = None, cautious: float | None = None) -> Rule:
    """Return the product's rule from a level on; `warn`, `cautious` (deg) are other thresholds."""
    rule = TREND
    if warn is not None:
        rule = replace(rule, warn=math.radians(warn))
    if cautious is not None:
        rule = replace(rule, cautious=math.radians(cautious))
    return lambda s: trend_of(s.ns, s.flat, s.cautious, rule).level >= least


RULES: dict[str, Rule] = {
    'flat margin below 5 deg': below(5.0),
    'flat margin below 10 deg': below(10.0),
    'half a pitch cut, below 5 deg': below(5.0, cautious=True),
    'half a pitch cut, below 10 deg': below(10.0, cautious=True),
    'slope alone': trend(cautious=-1e9),
    'trend: WARN': trend(),
    'trend: ERROR': trend(ERROR),
}


def alerts(at: Floats, on: Mask) -> Iterator[tuple[float, float]]:
    """Yield start and end (s) of alerts: a level that lasts is raised, and ends when it is gone."""
    since = start = last = math.nan
    for t, now in zip(at.tolist(), on.tolist(), strict=True):
        if now:
            since = t if math.isnan(since) else since
            start = t if math.isnan(start) and t - since >= RAISED - LOOK / 9 else start
            last = t
        else:
            since = math.nan
            if t - last >= ENDED - LOOK / 9 and not math.isnan(start):
                yield start, t
                start = math.nan
    if not math.isnan(start):
        yield start, float(at[-1])


def add(count: Count, one: Seen, rule: Rule) -> None:
    """Count a drive."""
    drive, tips = one.drive, one.drive.tips_at
    found = list(alerts(drive.time, rule(one)))
    end = min(tips, float(drive.time[-1]))
    count.seconds += end
    if math.isfinite(tips):
        count.tips += 1
        count.warned += _held(found, tips - AHEAD)
        count.late += _held(found, drive.over - AHEAD)
    else:
        count.calm_s += end
        count.idle += len(found)
        count.on_s += sum(b - a for a, b in found)
    for start, over in found:
        if math.isfinite(tips) and (start > tips or tips - over < MEANT):
            continue
        about = (drive.time >= start - ABOUT[0]) & (drive.time <= over + ABOUT[1])
        count.false += bool(np.nanmin(drive.truth[about]) > SAFE)


def _held(found: Sequence[tuple[float, float]], at: float) -> bool:
    return any(a <= at + LOOK / 9 and b >= at - LOOK / 9 for a, b in found)


def counted(some: Sequence[Seen], rule: Rule) -> Count:
    """Return what a rule did on drives."""
    count = Count()
    for one in some:
        add(count, one, rule)
    return count


def print_excess(some: Sequence[Seen]) -> None:
    """Print by how much each margin is above the true one, before a robot tips."""
    print(f'{"":12}{"drives":>7}{"tips":>6}', end='')
    print('   flat margin: >2 deg, p95   half a pitch cut: >2 deg, p95')
    for name in SCENES:
        of = [s for s in some if s.drive.trial.scene == name]
        print(f'{name:12}{len(of):7}{sum(math.isfinite(s.drive.over) for s in of):6}', end='')
        for part in ('flat', 'cautious'):
            over = np.concatenate([_excess(s, getattr(s, part)) for s in of])
            print(f'{np.mean(over > 2.0):18.0%} {np.percentile(over, 95):6.1f}', end='      ')
        print()


def _excess(one: Seen, shown: Floats) -> Floats:
    before = (one.drive.time < one.drive.tips_at) & ~np.isnan(one.drive.truth)
    over: Floats = np.degrees(shown.min(axis=1) - one.drive.truth)[before]
    return over


def print_rules(some: Sequence[Seen]) -> None:
    """Print what each rule warned of."""
    print(f'\n{"":32}{"tips":>5}{"0.5 s ahead":>12}{"of lying":>9}{"false/h":>8}', end='')
    print(f'{"idle/h":>8}{"time on":>8}{"  edges: tips":>14}{"0.5 s ahead":>12}')
    for name, rule in RULES.items():
        on = counted([s for s in some if s.drive.trial.scene in UNEVEN], rule)
        edges = counted([s for s in some if s.drive.trial.scene in EDGES], rule)
        print(f'{name:32}{on.tips:5}{_share(on.warned, on.tips):>12}', end='')
        print(f'{_share(on.late, on.tips):>9}{on.false / on.seconds * 3600:8.0f}', end='')
        print(f'{on.idle / on.calm_s * 3600:8.0f}{_share(on.on_s, on.calm_s):>8}', end='')
        print(f'{edges.tips:14}{_share(edges.warned, edges.tips):>12}')
    print(f'driven on uneven ground: {on.seconds / 3600:.2f} h, of them {on.calm_s / 3600:.2f} h')
    print('in drives without a tip-over')
    print('\nwarned 0.5 s ahead, by scene')
    for name in ('flat margin below 10 deg', 'half a pitch cut, below 10 deg', 'trend: WARN'):
        print(f'{name:32}', end='')
        for place in SCENES:
            on = counted([s for s in some if s.drive.trial.scene == place], RULES[name])
            print(f' {place} {on.warned}/{on.tips}', end='')
        print()


def _share(part: float, whole: float) -> str:
    return f'{part / whole:.0%}' if whole else '-'


def draw(some: Sequence[Seen]) -> None:
    """Draw the share of tip-overs warned of against false alerts and against time under alert."""
    from matplotlib import pyplot as plt  # noqa: PLC0415 - after the backend is chosen

    on = [s for s in some if s.drive.trial.scene in UNEVEN]
    lines = {
        'flat margin below a limit': [below(x) for x in (0, 5, 10, 15, 20, 25, 30)],
        'half a pitch cut, below a limit': [
            below(x, cautious=True) for x in (-10, -5, 0, 5, 10, 15)
        ],
        'slope alone': [trend(warn=x, cautious=-1e9) for x in (0, 5, 10, 15, 20, 30)],
        'slope or cautious margin': [trend(cautious=x) for x in (-5, 0, 3, 5, 7, 10)],
    }
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True)
    for name, rules in lines.items():
        counts = [counted(on, rule) for rule in rules]
        warned = [100.0 * c.warned / c.tips for c in counts]
        axes[0].plot([c.false / c.seconds * 3600 for c in counts], warned, 'o-', label=name)
        axes[1].plot([100.0 * c.on_s / c.calm_s for c in counts], warned, 'o-', label=name)
    ours = counted(on, trend())
    place = [ours.false / ours.seconds * 3600, 100.0 * ours.on_s / ours.calm_s]
    for axis, x in zip(axes, place, strict=True):
        axis.plot(x, 100.0 * ours.warned / ours.tips, 'k*', markersize=14, label='the rule')
        axis.grid(alpha=0.3)
    axes[0].set(xlabel='false alerts an hour', ylabel='tip-overs warned 0.5 s ahead (%)')
    axes[1].set(xlabel='time under alert in drives without a tip-over (%)')
    axes[1].legend(loc='lower right')
    figure.tight_layout()
    figure.savefig(PICTURE, dpi=110)


def flat_hours(robot: Robot, hours: float, seed: int) -> None:
    """Print the false alerts of hours on flat ground, driven as signals and not in MuJoCo."""
    rng = np.random.default_rng([seed, 11])
    n = round(600.0 / LOOK)
    found = dict.fromkeys(('below 5 deg', 'below 10 deg'), 0)
    excess = []
    for _ in range(math.ceil(hours * 6.0)):
        q = np.empty((n, len(robot.joint_names)))
        for k, name in enumerate(robot.joint_names):
            middle, way = {'shoulder_joint': (1.4, 0.9), 'elbow_joint': (-1.2, 1.2)}.get(
                name, (0.0, math.pi) if name == 'turret_joint' else (math.pi, 0.0)
            )
            q[:, k] = middle + way * _wander(rng, n)
        pitch, roll = 0.3 * _wander(rng, n), 0.3 * _wander(rng, n)
        up = (-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll))
        gravity = -robot.gravity * np.stack(up, axis=1)
        load_kg = Payload(float(rng.uniform(0.0, 5.0)), robot.payload.cog)
        true = margins(robot, q, gravity, load_kg).angle.min(axis=1)
        felt = gravity + np.cross(rng.normal(0.0, 0.004, (n, 3)), gravity)
        shown = margins(robot, q + rng.normal(0.0, 0.001, q.shape), felt, load_kg).angle
        excess.append(np.degrees(shown.min(axis=1) - true)[::20])
        at = np.linspace(0.0, (n - 1) * LOOK, n)
        for limit in (5.0, 10.0):
            on = shown.min(axis=1) < math.radians(limit)
            for start, end in alerts(at, on):
                about = (at >= start - ABOUT[0]) & (at <= end)
                safe = max(SAFE, math.radians(limit + 2.0))
                found[f'below {limit:g} deg'] += bool(true[about].min() > safe)
    p95 = np.percentile(np.concatenate(excess), 95)
    print(
        f'\n{hours:g} h on flat ground as signals: p95 excess {p95:.2f} deg; false alerts {found}'
    )


def _wander(rng: np.random.Generator, n: int) -> Floats:
    """Return values within 1 that move on to others every few seconds, smoothly."""
    knots = rng.uniform(-1.0, 1.0, n // 160 + 2)
    smooth = np.convolve(np.repeat(knots, 160)[: n + 80], np.hanning(82)[1:-1], mode='same')
    values: Floats = smooth[:n] / np.hanning(82)[1:-1].sum()
    return values


def main() -> None:
    """Run the drives and print all tables."""
    given = [float(a) for a in sys.argv[1:]]
    count, seed, hours = (given + [48.0, 3000.0, 30.0][len(given) :])[:3]
    robot, begin = load().settings.robot, time.perf_counter()
    drives = driven_all(robot, int(count), int(seed))
    print(f'{len(drives)} drives, seed {int(seed)}, {time.perf_counter() - begin:.0f} s')
    some = [seen(robot, drive) for drive in drives]
    print_excess(some)
    print_rules(some)
    draw(some)
    flat_hours(robot, hours, int(seed))


if __name__ == '__main__':
    main()
