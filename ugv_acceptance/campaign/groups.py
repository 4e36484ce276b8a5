"""Compares two groups of runs, such as two robots or two versions of firmware."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from ugv_acceptance import AcceptanceError
from ugv_acceptance.campaign.failures import Failure
from ugv_acceptance.campaign.run_table import Row
from ugv_acceptance.type_aliases import Json

if TYPE_CHECKING:
    from ugv_acceptance.studies.two_groups import Compared


def comparison(
    rows: Sequence[Row],
    failures: Sequence[Failure],
    groups: Sequence[tuple[str, str]],
    confidence: float,
) -> Json | None:
    """Return MTBF and success of two groups (name, pattern), with significance tests and power.

    None without groups. Raises AcceptanceError where a group has no run or no judged time, or a run
    is in both.
    """
    if not groups:
        return None
    # SciPy's statistics take longer to load than a resumed campaign without groups.
    from ugv_acceptance.studies.two_groups import compare_mtbf, compare_success  # noqa: PLC0415

    members = [[row for row in rows if _matches(row, pattern)] for _, pattern in groups]
    _check(groups, members)
    charged = [f.run for f in failures if f.chargeable]
    sides = [_side(name, runs, charged) for (name, _), runs in zip(groups, members, strict=True)]
    first, second = sides
    rates = compare_mtbf(
        (first['hours'], first['failures']), (second['hours'], second['failures']), confidence
    )
    shares = compare_success(
        (first['passed'], first['runs']), (second['passed'], second['runs']), confidence
    )
    return {'groups': sides, 'mtbf': _json(rates), 'success': _json(shares)}


def _matches(row: Row, pattern: str) -> bool:
    """Return whether the name of a run, or of a copy of it, fits a pattern."""
    return any(fnmatchcase(name, pattern) for name in (row.name, *row.also))


def _side(name: str, runs: Sequence[Row], charged: Sequence[str]) -> Json:
    names = {run.name for run in runs}
    return {
        'name': name,
        'runs': len(runs),
        'passed': sum(run.verdict == 'PASS' for run in runs),
        'hours': sum(run.judged_s for run in runs) / 3600.0,
        'failures': sum(run in names for run in charged),
    }


def _check(groups: Sequence[tuple[str, str]], members: Sequence[Sequence[Row]]) -> None:
    if len(groups) != 2:
        raise AcceptanceError(f'--compare: expected two groups, got {len(groups)}')
    for (name, pattern), runs in zip(groups, members, strict=True):
        if sum(run.judged_s for run in runs) <= 0.0:
            raise AcceptanceError(
                f'--compare {name}={pattern}: expected runs with judged time, got {len(runs)} runs'
            )
    second = {run.name for run in members[1]}
    both = min(
        (run for run in members[0] if run.name in second), key=lambda r: r.name, default=None
    )
    if both is not None:
        copies = f' (it is also {", ".join(both.also)})' if both.also else ''
        raise AcceptanceError(
            f'--compare: expected each run in one group, {both.name}{copies} is in both'
        )


def _json(found: 'Compared') -> Json:
    return {
        k: None if v is not None and not math.isfinite(v) else v for k, v in asdict(found).items()
    }
