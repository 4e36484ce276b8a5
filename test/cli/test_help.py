"""The help of every verb: examples that can be copied, sentences that are wrapped once."""

import inspect
import re
import shlex
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import typer
from cli.here import ugv
from cli.options_page import page

from ugv_acceptance.cli import VERBS


def examples_of(verb: str) -> list[str]:
    """Return the lines of a verb's examples, as its docstring has them."""
    module = import_module(f'ugv_acceptance.cli.{verb}')
    _, found, lines = inspect.cleandoc(getattr(module, verb).__doc__ or '').partition('Examples:\n')
    return [line.strip() for line in lines.splitlines() if line.strip()] if found else []


@pytest.mark.parametrize('verb', VERBS)
def test_examples_stand_in_one_line_each(verb: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """On 80 columns no option and no path is broken, and every line begins with the program."""
    monkeypatch.setenv('COLUMNS', '80')
    lines = [line.strip() for line in ugv(verb, '--help').stdout.splitlines()]
    examples = examples_of(verb)
    assert examples
    for example in examples:
        assert example.startswith(f'ugv-acceptance {verb}')
        assert example in lines


@pytest.mark.parametrize('verb', VERBS)
def test_options_of_examples_exist(verb: str) -> None:
    """An example that is copied is not refused."""
    module = import_module(f'ugv_acceptance.cli.{verb}')
    app = typer.Typer()
    app.command(context_settings=getattr(module, 'CONTEXT', None))(getattr(module, verb))
    command: Any = typer.main.get_command(app)
    known = {name for one in command.params for name in (*one.opts, *one.secondary_opts)}
    for example in examples_of(verb):
        words = shlex.split(example, comments=True)[2:]
        ours = words[: words.index('--ros-args')] if '--ros-args' in words else words
        used = {word.partition('=')[0] for word in ours if re.match('--?[a-z]', word)}
        assert used <= known, example


def test_a_sentence_is_wrapped_for_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not as its docstring is, and then once more."""
    monkeypatch.setenv('COLUMNS', '80')
    text = ugv('evaluate', '--help').stdout
    lines = [line.strip() for line in text.partition('Examples')[0].splitlines()]
    start = next(k for k, line in enumerate(lines) if line.startswith('The exit code is'))
    assert lines[start + 1].startswith('of several bags the worst counts')


def test_the_page_of_options_is_what_the_program_says() -> None:
    """docs/options.md has every option of every verb, with its meaning."""
    docs = Path(__file__).resolve().parents[2] / 'docs' / 'options.md'
    assert docs.read_text('utf-8') == page()
