"""The folder of a run: what is done already, one recording and one result a step, the report.

    plan.yaml  run.json  result.json  report.txt  steps/ID/{ID_0.mcap,metadata.yaml}  steps/ID.json

A step counts as done once its JSON is there; what was recorded before an interruption is kept under
another name, never written over.
"""

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ugv_acceptance import BadConfig, __version__
from ugv_acceptance.bag.result import write_json
from ugv_acceptance.config import Config
from ugv_acceptance.plan.plan import Plan, Step
from ugv_acceptance.run.verdicts import VERDICTS, whole

RESULT_VERSION = 1


@dataclass(frozen=True, slots=True)
class RunFolder:
    """A run's folder; `open_folder` makes or continues one."""

    path: Path
    plan: Plan
    mode: str

    def recording(self, step: Step) -> Path:
        """Return the folder to record a step into; what an interruption left there moves aside."""
        folder = self.path / 'steps' / step.id
        if folder.exists():
            number = 1
            while (aside := folder.with_name(f'{step.id}.interrupted-{number}')).exists():
                number += 1
            folder.rename(aside)
        return folder

    def result_path(self, step: Step) -> Path:
        """Return where a step's result is."""
        return self.path / 'steps' / f'{step.id}.json'

    def done(self, step: Step) -> dict[str, Any] | None:
        """Return the result of a step that was done, None if it was not."""
        path = self.result_path(step)
        if not path.is_file():
            return None
        found: dict[str, Any] = json.loads(path.read_text('utf-8'))
        return found

    def finish_step(self, step: Step, result: dict[str, Any]) -> None:
        """Write a step's result, whole or not at all."""
        write_json(self.result_path(step), {'plan_sha256': self.plan.sha256, **result})

    def finish(self, config: Config, coverage: dict[str, Any]) -> dict[str, Any]:
        """Write result.json and report.txt from the steps that were done; return the result."""
        results = [
            self.done(s) or {'id': s.id, 'title': s.title, 'verdict': 'SKIPPED', 'reasons': []}
            for s in self.plan.steps
        ]
        result = {
            'version': RESULT_VERSION,
            'verdict': whole(results),
            'counts': {v: sum(r['verdict'] == v for r in results) for v in VERDICTS},
            'mode': self.mode,
            'plan': {'name': self.plan.plan, 'sha256': self.plan.sha256},
            'robot': {'name': config.name, 'serial': config.serial, 'sha256': config.sha256},
            'software': __version__,
            'coverage': coverage,
            'steps': results,
        }
        write_json(self.path / 'result.json', result)
        (self.path / 'report.txt').write_text(report_of(result), 'utf-8')
        return result


def open_folder(
    path: Path, plan: Plan, plan_file: Path, mode: str, config: Config, *, resume: bool
) -> RunFolder:
    """Return a new folder for a run, or with `resume` one that was interrupted.

    Raises BadConfig where the folder holds something else or a run of another plan or robot.
    """
    state = path / 'run.json'
    head = {'plan_sha256': plan.sha256, 'config_sha256': config.sha256, 'mode': mode}
    if path.exists() and any(path.iterdir()):
        if not resume:
            raise BadConfig(f'{path}: expected a new or empty folder; --resume continues a run')
        _check_same(state, head)
    else:
        (path / 'steps').mkdir(parents=True)
        shutil.copyfile(plan_file, path / 'plan.yaml')
        write_json(state, head)
    return RunFolder(path, plan, mode)


def _check_same(state: Path, head: dict[str, str]) -> None:
    try:
        found = json.loads(state.read_text('utf-8'))
    except (OSError, ValueError) as error:
        raise BadConfig(f'{state}: expected the run to continue, got: {error}') from None
    for key, value in head.items():
        if found.get(key) != value:
            raise BadConfig(f'{state}: {key}: expected {value}, got {found.get(key)}')


def report_of(result: dict[str, Any]) -> str:
    """Return a run's report as plain text."""
    coverage = result['coverage']
    lines = [
        '{}: plan {} on {} ({})'.format(
            result['verdict'], result['plan']['name'], result['robot']['name'], result['mode']
        ),
        f'plan sha256 {result["plan"]["sha256"]}',
        ', '.join(f'{count} {verdict}' for verdict, count in result['counts'].items() if count),
        '',
        *(line for step in result['steps'] for line in _step_lines(step)),
        '',
        'failure map: {cells_visited} of {cells_reachable} cells of {cell_deg:g} deg visited'
        ' ({share:.1%})'.format(**coverage),
        _approach_line('torque limit', coverage['torque_limit'], 100.0, '%'),
        _approach_line('tilt limit', coverage['tip_limit_deg'], 1.0, ' deg'),
    ]
    return '\n'.join(lines) + '\n'


def _step_lines(step: dict[str, Any]) -> Sequence[str]:
    told, found = step.get('expected') or {}, step.get('measured') or {}
    numbers = [
        f'tilt left {told["tilt_left_deg"]:.1f} expected, {found["tilt_left_deg"]:.1f} deg found'
        for _ in ('tilt',)
        if 'tilt_left_deg' in told and 'tilt_left_deg' in found
    ]
    reasons = [f'    {reason}' for reason in (*step['reasons'], *numbers)]
    return [f'{step["verdict"]:<13}{step["id"]}: {step["title"]}', *reasons]


def _approach_line(what: str, found: dict[str, float | None], scale: float, unit: str) -> str:
    sides = [
        f'{side} by {value * scale:.1f}{unit}' if value is not None else f'never {side}'
        for side, value in found.items()
    ]
    return f'closest to the {what}: {", ".join(sides)}'
