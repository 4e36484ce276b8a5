"""The folder of a run: a recording and a result for each step, the journal, and the report.

    plan.yaml  run.json  journal.jsonl  result.json  report.txt  report.html
    steps/ID/{ID_0.mcap,metadata.yaml}  steps/ID.json

A step counts as done once its JSON is there. A recording made before an interruption, or in an
attempt that showed nothing, is kept under another name and never overwritten. The journal gets a
line as soon as anything begins or ends.
"""

import json
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from ugv_acceptance import BadConfig, __version__
from ugv_acceptance.bag.atomic_files import write_json, write_text
from ugv_acceptance.config import Config
from ugv_acceptance.plan.plan import SIMULATION, Plan, Step, plan_text
from ugv_acceptance.run.actuation import SIM
from ugv_acceptance.run.report import html_of, report_of
from ugv_acceptance.run.step_verdict import VERDICTS, whole

RESULT_VERSION = 1


@dataclass(frozen=True, slots=True)
class RunFolder:
    """A run's folder; `open_folder` makes or continues one."""

    path: Path
    plan: Plan
    mode: str

    def recording(self, step: Step, before: str = 'interrupted') -> Path:
        """Return the folder to record a step into; an older recording moves to ID.BEFORE-1."""
        folder = self.path / 'steps' / step.id
        if folder.exists():
            number = 1
            while (aside := folder.with_name(f'{step.id}.{before}-{number}')).exists():
                number += 1
            folder.rename(aside)
        return folder

    def note(self, event: str, **values: object) -> None:
        """Append an event to the journal: the time, what happened, and further fields."""
        now = datetime.now(timezone.utc).isoformat(timespec='milliseconds')
        line = json.dumps({'time': now, 'event': event, **values}, default=str)
        # One write of a whole line: a killed process leaves no half of it.
        with (self.path / 'journal.jsonl').open('ab', buffering=0) as file:
            file.write(f'{line}\n'.encode())

    def result_path(self, step: Step) -> Path:
        """Return the path of a step's result."""
        return self.path / 'steps' / f'{step.id}.json'

    def done(self, step: Step) -> dict[str, Any] | None:
        """Return the stored result of a step, None if it is not done."""
        path = self.result_path(step)
        if not path.is_file():
            return None
        found: dict[str, Any] = json.loads(path.read_text('utf-8'))
        return found

    def finish_step(self, step: Step, result: dict[str, Any]) -> None:
        """Write a step's result, complete or not at all."""
        write_json(self.result_path(step), {'plan_sha256': self.plan.sha256, **result})

    def finish(self, config: Config, coverage: dict[str, Any]) -> dict[str, Any]:
        """Write result.json and report.txt from the steps' results; return the run's result."""
        results = [
            self.done(s) or {'id': s.id, 'title': s.title, 'verdict': 'SKIPPED', 'reasons': []}
            for s in self.plan.steps
        ]
        # Steps that would pass a limit are only for the simulation.
        asked = [
            found
            for step, found in zip(self.plan.steps, results, strict=True)
            if step.where != SIMULATION or self.mode.startswith(SIM)
        ]
        result = {
            'version': RESULT_VERSION,
            'verdict': whole(asked),
            'asked': len(asked),
            'counts': {v: sum(r['verdict'] == v for r in results) for v in VERDICTS},
            'mode': self.mode,
            'plan': {'name': self.plan.plan, 'sha256': self.plan.sha256},
            'robot': {'name': config.name, 'serial': config.serial, 'sha256': config.sha256},
            'software': __version__,
            'coverage': coverage,
            'steps': results,
        }
        write_json(self.path / 'result.json', result)
        text = report_of(result)
        write_text(self.path / 'report.txt', text)
        write_text(self.path / 'report.html', html_of(text, self.plan, config, coverage))
        return result


def open_folder(
    path: Path, plan: Plan, source: Path | None, mode: str, config: Config, *, resume: bool
) -> RunFolder:
    """Return a new folder for a run, or with `resume` one that was interrupted.

    The plan is copied from its file `source`, comments and all; None: it is written.

    Raises BadConfig where the folder holds something else or a run of another plan or robot.
    """
    state = path / 'run.json'
    head = {'plan_sha256': plan.sha256, 'config_sha256': config.sha256, 'mode': mode}
    folder = RunFolder(path, plan, mode)
    if path.exists() and not _unborn(path):
        if not resume:
            raise BadConfig(
                f'{path}: expected a new or empty folder; use --resume to continue a run,'
                ' or another --out'
            )
        _check_same(state, head)
        folder.note('resumed')
        return folder
    try:
        (path / 'steps').mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadConfig(
            f'{path}: expected a folder to record into, got: {error.strerror}'
        ) from None
    text = plan_text(plan) if source is None else source.read_text('utf-8')
    write_text(path / 'plan.yaml', text)
    folder.note('begun', plan_sha256=plan.sha256, mode=mode)
    # Last: a folder with this file is a run.
    write_json(state, head)
    return folder


def _unborn(path: Path) -> bool:
    """Return whether a folder is empty, or holds only what a run killed at its start left there.

    `steps` is made first: without it, a plan in the folder is somebody's own.
    """
    if not path.is_dir():
        return False
    found = {p.name for p in path.iterdir() if p.suffix != '.part'}
    begun = 'steps' in found and found <= {'steps', 'plan.yaml', 'journal.jsonl'}
    return not found or (begun and not any((path / 'steps').glob('*')))


def _check_same(state: Path, head: dict[str, str]) -> None:
    try:
        found = json.loads(state.read_text('utf-8'))
    except (OSError, ValueError, RecursionError) as error:
        raise BadConfig(f'{state}: expected the run to continue, got: {error}') from None
    for key, value in head.items():
        if not isinstance(found, dict):
            raise BadConfig(f'{state}: expected the run to continue, got: {found!r:.40}')
        if found.get(key) != value:
            raise BadConfig(f'{state}: {key}: expected {value}, got {found.get(key)}')
