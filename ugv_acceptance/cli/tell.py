"""`ugv-acceptance tell WHAT`: an operator's word to the running monitor, and its answer."""

from typing import Annotated

import typer

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.completion import GROUNDS, codes_like
from ugv_acceptance.cli.options import CONTEXT

__all__ = ['CONTEXT', 'tell']

REFUSED = 1
# What may be told, and the words that follow: the least and the most of them, and their names.
ALERT = 'CODE [SUBJECT]'
WORDS: dict[str, tuple[int, int, str]] = {
    'acknowledge': (0, 2, f'[{ALERT}]'),
    'shelve': (1, 2, ALERT),
    'unshelve': (1, 2, ALERT),
    'reset': (0, 2, f'[{ALERT}]'),
    'payload': (1, 1, 'MASS, such as 2.5kg'),
    'ground': (1, 1, f'one of {", ".join(GROUNDS)}'),
    'hand': (1, 1, 'allowed or not-allowed'),
}
HANDS = {'allowed': 'true', 'not-allowed': 'false'}
# Options that only one of them takes.
OPTIONS = {'--for': 'shelve', '--at': 'payload'}


def _whats(incomplete: str) -> list[str]:
    return [what for what in WORDS if what.startswith(incomplete)]


def _values(context: typer.Context, incomplete: str) -> list[str]:
    """Return what may follow, for the shell's completion."""
    what = context.params.get('what')
    values = {'ground': GROUNDS, 'hand': HANDS, 'payload': ()}.get(str(what))
    if values is None:
        return sorted(codes_like(incomplete))
    return [value for value in values if value.startswith(incomplete)]


def tell(
    context: typer.Context,
    what: Annotated[str, typer.Argument(help=f'One of {", ".join(WORDS)}.', autocompletion=_whats)],
    values: Annotated[
        list[str] | None,
        typer.Argument(
            help='An alert (CODE, or CODE SUBJECT), a mass, a kind of ground.',
            autocompletion=_values,
        ),
    ] = None,
    length: Annotated[
        str, typer.Option('--for', help='How long to shelve: 5min, 90s; at most 10min.')
    ] = '',
    at: Annotated[
        str,
        typer.Option(
            help='Centre of gravity of the load in its link: 10cm,0,0; without it, as before.'
        ),
    ] = '',
    by: Annotated[str, typer.Option(help='Who says it; without it, the login name.')] = '',
    note: Annotated[str, typer.Option(help='A note, such as why.')] = '',
    within: Annotated[
        float, typer.Option(min=0.1, max=600.0, help='Seconds to find the monitor.')
    ] = 10.0,
) -> None:
    """Tell the running monitor: alarm seen, load carried, ground driven on. Prints its answer.

    Exit codes: 0 done, 1 refused, 2 bad usage, or no monitor there.

    \b
    Examples:
      ugv-acceptance tell acknowledge
      ugv-acceptance tell acknowledge TIP_OVER right --by Ada --note "stands well"
      ugv-acceptance tell shelve TORQUE_LIMIT shoulder --for 5min
      ugv-acceptance tell reset
      ugv-acceptance tell payload 2.5kg --at 10cm,0,0
      ugv-acceptance tell ground stairs
      ugv-acceptance tell hand allowed
      ugv-acceptance tell ground flat --ros-args -r __ns:=/robot1
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    words, ros_args = _apart([*(values or []), *context.args])
    for option, given in (('--for', length), ('--at', at)):
        if given and OPTIONS[option] != what:
            raise BadConfig(f'{option}: only `tell {OPTIONS[option]}` takes it, not {what}')
    asked = values_of(what, words, length, at)
    from ugv_acceptance.nodes.operator_client import Command, ask_once

    do = 'hand_may_touch' if what == 'hand' else what
    answer = ask_once(Command(do, by or login_name(), note, asked), ros_args, within)
    if not answer.done:
        typer.echo(f'refused: {answer.text}', err=True)
        raise typer.Exit(REFUSED)
    typer.echo(answer.text)


def _apart(words: list[str]) -> tuple[list[str], list[str]]:
    """Return the words before --ros-args, and the arguments for ROS; BadConfig for an option."""
    at = words.index('--ros-args') if '--ros-args' in words else len(words)
    mine, ros_args = words[:at], words[at:]
    unknown = [word for word in mine if word.startswith('--')]
    if unknown:
        raise BadConfig(f'{unknown[0]!r} is not an option; arguments for ROS: after --ros-args')
    return mine, ros_args


def values_of(what: str, words: list[str], length: str = '', at: str = '') -> dict[str, str]:
    """Return the values of a command, from what was typed. Raises BadConfig saying what is wrong.

    `length` says how long to shelve, `at` where a load is.
    """
    if what not in WORDS:
        raise BadConfig(f'tell: expected one of {", ".join(WORDS)}, got {what!r}')
    least, most, names = WORDS[what]
    if not least <= len(words) <= most:
        raise BadConfig(f'tell {what}: expected {names}, got {" ".join(words) or "nothing"}')
    if what == 'payload':
        from ugv_acceptance.config import quantity

        found = {'mass_kg': repr(quantity(words[0], 'mass', 'tell payload'))}
        from ugv_acceptance.console.typed import place_from

        return found | ({'cog_m': ','.join(map(repr, place_from(at, '--at')))} if at else {})
    if what == 'ground':
        return {'kind': _one_of(GROUNDS, words[0], 'tell ground')}
    if what == 'hand':
        return {'allowed': HANDS[_one_of(tuple(HANDS), words[0], 'tell hand')]}
    if not words:
        return {}
    from ugv_acceptance.evaluation.alerts.messages import ALERTS

    found = {'code': _one_of(tuple(ALERTS), words[0].upper(), f'tell {what}')}
    found |= {'subject': words[1]} if len(words) > 1 else {}
    return found | ({'seconds': repr(seconds_of(length))} if length else {})


def seconds_of(text: str) -> float:
    """Return a time of a command line in s: 5min, 90s. Raises BadConfig where it is none."""
    from ugv_acceptance.config import quantity

    number = text.strip().removesuffix('min')
    if number == text.strip():
        return quantity(text, 'time', '--for')
    return 60.0 * quantity(f'{number} s', 'time', '--for')


def _one_of(known: tuple[str, ...], word: str, what: str) -> str:
    if word not in known:
        from difflib import get_close_matches

        near = get_close_matches(word, known, 1)
        listed = ', '.join(known) if len(known) < 10 else 'the code of an alert (docs/operator.md)'
        hint = f'; did you mean {near[0]}?' if near else ''
        raise BadConfig(f'{what}: expected {listed}, got {word!r}{hint}')
    return word


def login_name() -> str:
    """Return the name the user is logged in with; 'operator' where the system knows none."""
    from getpass import getuser

    try:
        return getuser()
    except (KeyError, OSError):
        return 'operator'
