"""Writes docs/options.md: every option of every verb, as `--help` says it.

From the folder of a checkout: `python test/cli/options_page.py > docs/options.md`.
"""

import sys
from importlib import import_module
from typing import Any

import typer

from ugv_acceptance.cli import VERBS

HEAD = """\
# Every option

What `ugv-acceptance VERB --help` says, for those who search. What the verbs do stands on their own
pages and in README.md. This page is written by `python test/cli/options_page.py > docs/options.md`.
"""


def command_of(verb: str) -> Any:
    """Return the command of a verb."""
    module = import_module(f'ugv_acceptance.cli.{verb}')
    app = typer.Typer()
    app.command(context_settings=getattr(module, 'CONTEXT', None))(getattr(module, verb))
    return typer.main.get_command(app)


def rows_of(verb: str) -> list[str]:
    """Return a line of the table for each argument and option of a verb."""
    return [_row(one) for one in command_of(verb).params if '--install-completion' not in one.opts
            and '--show-completion' not in one.opts]  # fmt: skip


def _row(one: Any) -> str:
    names = [*one.opts, *one.secondary_opts]
    dashed = names[0].startswith('-')
    called = ', '.join(f'`{name}`' for name in names) if dashed else f'`{names[0].upper()}`'
    default = one.default
    given = (
        f' Default: `{default}`.'
        if not isinstance(default, bool) and default not in (None, '', ())
        else ''
    )
    help_text = ' '.join((one.help or '').split()).replace('|', '\\|').replace('*=', '\\*=')
    return f'| {called} | {help_text}{given} |'


def page() -> str:
    """Return the page."""
    parts = [HEAD]
    for verb in VERBS:
        parts += [
            f'\n## {verb}\n\n| option | meaning |\n|---|---|\n',
            '\n'.join(rows_of(verb)),
            '\n',
        ]
    return ''.join(parts)


if __name__ == '__main__':
    sys.stdout.write(page())
