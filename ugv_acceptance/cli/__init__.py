"""The command line, `ugv-acceptance VERB`: one module a verb, imported only when it is used."""

import sys
from importlib import import_module
from typing import Any

import click
import typer
from typer.core import TyperGroup

from ugv_acceptance import AcceptanceError

PASS, FAIL, BAD_INPUT, INCONCLUSIVE = range(4)

# Verb -> its one line in --help; its code is ugv_acceptance/cli/VERB.py, function VERB.
VERBS = {
    'demo': 'Play a recorded run into the live monitor, then judge the same recording.',
    'evaluate': 'Judge a recorded run: margins, alerts and a verdict.',
    'monitor': 'Watch joint_states and IMU live and publish margins and alerts.',
    'replay': 'Publish a recording on its topics.',
    'model': 'Print what the tool believes the robot is.',
    'doctor': 'Check a set-up and say what to do.',
}


class LazyGroup(TyperGroup):
    """Loads a verb's module when it is called or asked for help, not at start-up."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order in which people meet them."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a verb, or None where there is none of that name."""
        if cmd_name not in VERBS:
            return None
        module = import_module(f'ugv_acceptance.cli.{cmd_name}')
        app = typer.Typer(add_completion=False, rich_markup_mode=None)
        app.command(cmd_name, help=getattr(module, cmd_name).__doc__)(getattr(module, cmd_name))
        return typer.main.get_command(app)
