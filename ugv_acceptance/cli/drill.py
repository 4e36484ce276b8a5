"""`ugv-acceptance drill`: trains an operator on the simulator, and records the outcome."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance.cli.options import Overwrite

if TYPE_CHECKING:
    from collections.abc import Callable

    from ugv_acceptance.drill.course import Course
    from ugv_acceptance.drill.outcome import Drill, Outcome

PORT = 8770
# Exit codes beside 2 for bad input.
PASSED, TO_REPEAT = 0, 1


def _situations(incomplete: str) -> list[str]:
    """Return the names of situations that begin so, for the shell's completion."""
    from ugv_acceptance.drill.situations import SITUATIONS

    return [name for name in SITUATIONS if name.startswith(incomplete)]


def drill(
    only: Annotated[
        list[str] | None,
        typer.Option(
            help='One situation instead of all; may be given again. --list names them.',
            autocompletion=_situations,
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help='Seed of all that is drawn: the same seed, the same drill.')
    ] = 1,
    operator: Annotated[str, typer.Option(help='Whose drill it is, for the record.')] = 'unknown',
    out: Annotated[
        Path | None, typer.Option('--out', '-o', help='Write the record: a JSON file.')
    ] = None,
    script: Annotated[
        Path | None, typer.Option(help='File with the answers, instead of a person; -: stdin.')
    ] = None,
    page: Annotated[bool, typer.Option('--page', help='On a page in the browser.')] = False,
    port: Annotated[int, typer.Option(help='Port of the page; 0 takes a free one.')] = PORT,
    listed: Annotated[bool, typer.Option('--list', help='Print the situations and end.')] = False,
    overwrite: Overwrite = False,
) -> None:
    """Train an operator: situations on the simulator, what do you do, and what happens then.

    The simulated PackBot does what is answered, and that decides. Exit code 0: passed; 1: something
    to repeat.

    \b
    A script has a line for each situation (or for all): SITUATION: ANSWER at 3 s, ANSWER at 5 s
      all: follow-advice
      stairs: stop at 1 s, follow-advice at 4 s
      load: ignore
    ANSWER: follow-advice, ignore, nothing, or words of the answer.

    \b
    Examples:
      ugv-acceptance drill
      ugv-acceptance drill --page --operator Ada --out ada.json
      ugv-acceptance drill --only slope --seed 7
      ugv-acceptance drill --script answers.txt --out ada.json
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    if listed:
        _print_list()
        return
    from ugv_acceptance.cli.output_kinds import DRILL_RECORD
    from ugv_acceptance.cli.outputs import Output, check_outputs, inputs_of
    from ugv_acceptance.config import load
    from ugv_acceptance.drill.course import Course
    from ugv_acceptance.drill.situations import SITUATIONS

    config = load(None)
    told = None if script is None or str(script) == '-' else script
    output = Output('--out', out, DRILL_RECORD)
    check_outputs([output], inputs_of(config, script=told), overwrite=overwrite)
    unknown = [name for name in only or () if name not in SITUATIONS]
    if unknown:
        known = ', '.join(SITUATIONS)
        raise typer.BadParameter(
            f'expected one of {known}, got {unknown[0]!r}', param_hint='--only'
        )
    course = Course(config, seed, tuple(only or SITUATIONS))
    result = _Clock(course, operator, scripted=script is not None)
    if script is not None:
        _by_script(course, script)
    elif page:
        _on_page(course, result, out, port)
    else:
        _in_terminal(course)
    _finish(result(), out, written=page)


class _Clock:
    """The result of a drill so far; its time is measured from when this was made."""

    def __init__(self, course: 'Course', operator: str, *, scripted: bool) -> None:
        import time
        from datetime import datetime, timezone

        self._course, self._operator = course, operator.strip() or 'unknown'
        self._scripted = scripted
        self._started = f'{datetime.now(timezone.utc):%Y-%m-%dT%H:%M:%SZ}'
        self._now, self._began = time.monotonic, time.monotonic()

    def __call__(self) -> 'Drill':
        minutes = (self._now() - self._began) / 60.0
        who = self._operator, self._started, minutes
        return self._course.drill(*who, scripted=self._scripted)


def _by_script(course: 'Course', path: Path) -> None:
    from ugv_acceptance import BadConfig
    from ugv_acceptance.drill.script import run_script, script_from

    try:
        text = sys.stdin.read() if str(path) == '-' else path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise BadConfig(f'--script {path}: expected a text file: {error}') from None
    try:
        script = script_from(text)
        run_script(course, script, _say)
    except BadConfig as error:
        raise BadConfig(f'--script {path}: {error}') from None


def _on_page(course: 'Course', result: 'Callable[[], Drill]', out: Path | None, port: int) -> None:
    from ugv_acceptance.cli.termination import asked_to_end
    from ugv_acceptance.cli.watch import need

    need('starlette', 'uvicorn', 'websockets')
    from ugv_acceptance.drill.feed import DrillFeed
    from ugv_acceptance.drill.page import serve_drill

    def announce(address: str) -> None:
        typer.echo(f'Drill on {address} (Ctrl-C ends)')

    with asked_to_end() as asked:
        serve_drill(DrillFeed(course), result, out, port=port, ready=announce, asked=asked)


def _in_terminal(course: 'Course') -> None:
    from ugv_acceptance import BadConfig
    from ugv_acceptance.cli.termination import asked_to_end
    from ugv_acceptance.drill.feed import DrillFeed
    from ugv_acceptance.drill.terminal import play

    if not all(file.isatty() for file in (sys.stdin, sys.stdout)):
        raise BadConfig('drill: expected a terminal; without one use --script FILE or --page')
    with asked_to_end() as asked:
        play(DrillFeed(course), sys.stdout, asked, colour=not os.environ.get('NO_COLOR'))


def _say(outcome: 'Outcome') -> None:
    """Print the outcome of a situation: how it ended, what happened, the lesson."""
    from textwrap import fill

    mark = '[OK] passed' if outcome.passed else '[X] to repeat'
    given = [f'{key} after {after:.1f} s' for key, after in outcome.answers]
    typer.echo(f'{mark}: {outcome.title} ({", ".join(given) or "no answer"})')
    for text in (outcome.happened, outcome.lesson):
        typer.echo(fill(text, 79, initial_indent='  ', subsequent_indent='  '))


def _finish(result: 'Drill', out: Path | None, *, written: bool) -> None:
    """Print how the drill ended, write its record, and end with the exit code."""
    from ugv_acceptance.bag.atomic_files import write_json
    from ugv_acceptance.drill.record import record_json

    record = record_json(result)
    if out is not None and not written:
        write_json(out, record)
    passed = len({o.situation for o in result.outcomes}) - len(result.to_repeat)
    typer.echo(f'{passed} passed, {len(result.to_repeat)} to repeat', nl=not result.to_repeat)
    if result.to_repeat:
        typer.echo(f': {", ".join(result.to_repeat)}')
    if out is not None and (result.outcomes or not written):
        typer.echo(f'Wrote {out}')
    raise typer.Exit(PASSED if result.outcomes and not result.to_repeat else TO_REPEAT)


def _print_list() -> None:
    from ugv_acceptance.drill.situations import SITUATIONS

    for situation in SITUATIONS.values():
        typer.echo(f'{situation.name:<12} {situation.title}')
