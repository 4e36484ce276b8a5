"""`ugv-acceptance check TRAJECTORY --live`: the running monitor's answer, printed."""

from typing import TYPE_CHECKING

from ugv_acceptance import BadConfig

if TYPE_CHECKING:
    from ugv_acceptance.evaluation.planned_motion import Trajectory

# Exit codes by result.
CODES = {'permitted': 0, 'refused': 1, 'not_known': 3}
# Seconds in which a monitor is found, and in which it answers.
WITHIN = 10.0


def check_live(
    planned: 'Trajectory', ros_args: list[str], entered: list[str], *, live: bool, as_json: bool
) -> int:
    """Ask the running monitor, print its answer, and return the exit code.

    `entered` are options of conditions, which the monitor knows better: BadConfig.
    """
    if not live:
        raise BadConfig('--ros-args: only `check --live` takes them')
    if entered:
        raise BadConfig(f'--{entered[0]}: not with --live: the monitor knows how the robot stands')
    from ugv_acceptance.nodes.check_client import ask_live

    answer = ask_live(planned, ros_args, WITHIN)
    if as_json:
        import json

        import typer

        values = {'result': answer.result, 'message': answer.text}
        typer.echo(json.dumps(answer.values | values, indent=2))
        return CODES[answer.result]
    _print(answer.result, answer.text, answer.values)
    return CODES[answer.result]


def _print(result: str, text: str, values: dict[str, str]) -> None:
    """Print an answer: result, what it rests on, why not, until when, what was not checked."""
    from rich.markup import escape

    from ugv_acceptance.cli.terminal_output import console_of, say, shown_verdict

    console = console_of()
    shown = result.replace('_', ' ')
    say(console, shown_verdict(shown.upper(), text.removeprefix(f'{shown}: ')))
    if 'payload_kg' in values:
        say(console, escape(_situation(values)), 2)
    for reason in _sentences(values, 'reasons')[1:]:
        say(console, escape(reason), 2)
    for caution in _sentences(values, 'cautions'):
        say(console, escape(f'CAUTION: {caution}'), 2)
    if result == 'permitted':
        say(
            console, f'it has to begin within {values["valid_s"]} s, from where the robot stands', 2
        )
    for unchecked in _sentences(values, 'not_checked'):
        say(console, escape(f'NOT CHECKED: {unchecked}'), 2)


def _situation(values: dict[str, str]) -> str:
    """Return in a line what an answer rests on."""
    return (
        f'roll {values["roll_deg"]} deg, pitch {values["pitch_deg"]} deg; payload '
        f'{values["payload_kg"]} kg (told by {values["payload_by"] or "nobody"}); '
        f'ground {values["ground"]}; limits {values["limits_hash"]}'
    )


def _sentences(values: dict[str, str], name: str) -> list[str]:
    return [part for part in values.get(name, '').split(' | ') if part]
