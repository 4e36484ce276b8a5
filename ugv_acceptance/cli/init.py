"""`ugv-acceptance init`: derives a robot's configuration from what its files and topics tell."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.completion import words_like
from ugv_acceptance.cli.options import Overwrite
from ugv_acceptance.cli.terminal_output import console_of, say, wrote

if TYPE_CHECKING:
    from ugv_acceptance.cli.init_work import Found

DONE, FAILS, OPEN = 0, 1, 3
COLOURS = {
    'ok': 'green',
    'FAILS': 'bold red',
    'open': 'yellow',
    'not seen': 'dim',
    'look': 'yellow',
}


def doing(text: str) -> None:
    """Say on a terminal what is being done; nothing in a script."""
    if sys.stderr.isatty():
        typer.echo(f'{text} ...', err=True)


def is_asked() -> bool:
    """Return whether a person is there who can be asked."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def print_found(found: 'Found') -> int:
    """Print checks, notes and what is open; return the exit code."""
    from ugv_acceptance.configure.checks import exit_code

    console, code = console_of(), exit_code(found.checks)
    failed = [check.what for check in found.checks if check.state == 'FAILS']
    words = {
        DONE: f'[bold green]done:[/] {escape(found.done)}',
        FAILS: f'[bold red]NOT done, a check fails:[/] {escape(", ".join(failed))}',
        OPEN: f'[bold yellow]NOT done, open:[/] {escape(_open(found))}',
    }
    say(console, words[code])
    for note in found.notes:
        say(console, f'note: {escape(note)}')
    wide = max((len(check.what) for check in found.checks), default=0)
    for check in found.checks:
        state = f'[{COLOURS[check.state]}]{check.state:8}[/]'
        say(console, f'{check.what:{wide}}  {state}  {escape(check.text)}', 2, wide + 14)
    for question in found.questions:
        text = f'open: {question.key}: {question.option}; until then {question.otherwise}'
        say(console, escape(text))
    say(console, words[code])
    wrote(*found.written)
    return code


def _open(found: 'Found') -> str:
    """Return what is open, and what that costs: of the mass alone that the URDF's is taken."""
    names = list(dict.fromkeys(check.what for check in found.checks if check.state == 'open'))
    alone = names == ['mass']
    cost = "the URDF's is taken" if alone else 'what hangs on it is not checked'
    return f'{", ".join(names)}; {cost}'


def init(
    sources: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar='[SOURCE]...', help='A URDF or xacro, a recording, or both of one robot.'
        ),
    ] = None,
    out: Annotated[Path, typer.Option('--out', '-o', help='The YAML to write.')] = Path(
        'robot.yaml'
    ),
    live: Annotated[
        bool, typer.Option('--live', help='Listen to the running robot: URDF, joints, IMU.')
    ] = False,
    seconds: Annotated[str, typer.Option('--for', help='With --live: how long.')] = '10s',
    meshes: Annotated[
        list[Path] | None,
        typer.Option(help='Folder with packages or meshes that the robot names (repeatable).'),
    ] = None,
    xacro_arg: Annotated[
        list[str] | None, typer.Option(help='Argument of the xacro, NAME:=VALUE (repeatable).')
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help='Draw the robot in this file: .png or .html.')
    ] = None,
    check: Annotated[
        Path | None,
        typer.Option(help='Check this configuration, against a recording if one is given.'),
    ] = None,
    mass: Annotated[
        str | None,
        typer.Option(
            help='What it weighs on scales: 68kg; or urdf: as the URDF says.',
            autocompletion=words_like('urdf'),
        ),
    ] = None,
    contacts: Annotated[
        str | None,
        typer.Option(
            help='What touches the ground: yes (as found), no, none, LINK,LINK.',
            autocompletion=words_like('yes', 'no'),
        ),
    ] = None,
    tilt: Annotated[
        str | None,
        typer.Option(
            help='The tilt of its contact points is real, or not-real.',
            autocompletion=words_like('real', 'not-real'),
        ),
    ] = None,
    mounting: Annotated[
        str | None,
        typer.Option(
            help='How the IMU is turned: 180deg,-90deg,0; yes (as found); none.',
            autocompletion=words_like('yes', 'none'),
        ),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(help='JOINT=50 (N m; N of a slide), =none, =urdf; "*=urdf" (repeatable).'),
    ] = None,
    load_link: Annotated[
        str | None,
        typer.Option(
            help='The link that carries the load, or none.', autocompletion=words_like('none')
        ),
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Derive a robot's configuration: contact points, joints, IMU, limits, with their sources.

    Every line of the YAML says how sure it is. What no file tells is asked on a terminal, at most
    five things; in a script the options answer. Without an answer it is written as unknown: what
    hangs on it is not checked, and nothing passes. For the mass alone the URDF's stands in, and
    every verdict says that it is assumed. A xacro is a program: give only one you trust.

    The exit code is 0 when done, 1 if a check fails, 2 for bad input, 3 if something is open.

    \b
    Examples:
      ugv-acceptance init husky.urdf
      ugv-acceptance init husky.urdf run/ --mass 52kg --picture husky.png
      ugv-acceptance init robot.urdf.xacro --meshes ~/ws/src -o robot.yaml
      ugv-acceptance init run/ --contacts wheel_1,wheel_2 --limit 'arm_*=urdf'
      ugv-acceptance init --live --for 20s
      ugv-acceptance init --check robot.yaml run/ --picture robot.html
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.init_work import Asked, check_it, make_it
    from ugv_acceptance.config import quantity
    from ugv_acceptance.configure.questions import Answers

    answers = Answers(mass, contacts, tilt, mounting, tuple(limit or ()), load_link)
    heard = quantity(seconds, 'time', '--for') if live else None
    arguments = dict(_argument(text) for text in xacro_arg or ())
    asked = Asked(
        tuple(sources or ()), tuple(meshes or ()), heard, arguments, picture, overwrite, doing
    )
    if check is not None:
        _refuse_answers(answers)
        raise typer.Exit(print_found(check_it(check, asked)))
    raise typer.Exit(print_found(make_it(out, asked, answers, _prompt if is_asked() else None)))


def _argument(text: str) -> tuple[str, str]:
    name, found, value = text.partition(':=')
    if not found or not name:
        raise BadConfig(f'--xacro-arg: expected NAME:=VALUE, got {text}')
    return name, value


def _refuse_answers(answers: object) -> None:
    from ugv_acceptance.configure.questions import Answers

    if answers != Answers():
        raise BadConfig('--check: expected no answers beside it: it changes no configuration')


def _prompt(text: str, guess: str) -> str:
    """Ask a person a question; return what was typed, or the guess."""
    told: str = typer.prompt(f'{text}\n ', default=guess, show_default=bool(guess))
    return told
