"""What streams can show, and how sentences are wrapped."""

import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from rich.markup import escape

from ugv_acceptance.cli import result_text
from ugv_acceptance.cli.plain_text import columns_of, has_utf8, prepare, takes_colour
from ugv_acceptance.cli.terminal_output import again, say
from ugv_acceptance.offline.evaluate import evaluate

ASKED = ('LC_ALL', 'LC_CTYPE', 'LANG', 'PYTHONIOENCODING', 'PYTHONUTF8', 'COLUMNS')
WORDS = st.text('abcdefghij', min_size=1, max_size=12)


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Take from the environment all that decides how text is shown."""
    for name in (*ASKED, 'NO_COLOR', 'FORCE_COLOR'):
        monkeypatch.delenv(name, raising=False)
    return monkeypatch


def stream(encoding: str = 'utf-8') -> io.TextIOWrapper:
    """Return a stream that is no terminal."""
    return io.TextIOWrapper(io.BytesIO(), encoding=encoding, write_through=True)


@pytest.mark.parametrize(
    ('told', 'encoding', 'utf8'),
    [
        ({'LANG': 'C.UTF-8'}, 'utf-8', True),
        ({'LANG': 'de_DE.UTF-8'}, 'utf-8', True),
        ({'LANG': 'C'}, 'utf-8', False),
        ({}, 'utf-8', False),
        # Python says so itself where it finds the C locale.
        ({'LANG': 'C', 'LC_CTYPE': 'C.UTF-8'}, 'utf-8', False),
        ({'LANG': 'en_US.UTF-8', 'LC_ALL': 'C'}, 'utf-8', False),
        ({'LANG': 'C', 'LC_ALL': 'en_US.UTF-8'}, 'utf-8', True),
        ({'LANG': 'C', 'PYTHONIOENCODING': 'utf-8'}, 'utf-8', True),
        ({'LANG': 'en_US.UTF-8'}, 'ascii', False),
        ({'LANG': 'de_DE.ISO-8859-1'}, 'iso8859-1', False),
    ],
)
def test_utf8_is_for_those_who_say_so(
    told: dict[str, str], encoding: str, bare: pytest.MonkeyPatch, *, utf8: bool
) -> None:
    """Where nobody says what a terminal can show, it gets ASCII: every terminal can show that."""
    for name, value in told.items():
        bare.setenv(name, value)
    assert has_utf8(stream(encoding)) is utf8


def test_a_letter_that_a_terminal_has_not_is_written_in_ascii(bare: pytest.MonkeyPatch) -> None:
    """Signs by their like, of the same width in tables; others as an escape, never a "?"."""
    out = stream()
    bare.setattr('sys.stdout', out)
    prepare()
    print('─│┌ short…name ≤ 5° Ω', file=out)
    written = out.buffer
    assert isinstance(written, io.BytesIO)
    assert written.getvalue() == b'-|+ short~name <= 5 deg \\u03a9\n'


@pytest.mark.parametrize('locale', ['C', 'C.UTF-8'])
def test_a_file_name_of_any_bytes_is_printed_as_it_is(
    locale: str, bare: pytest.MonkeyPatch
) -> None:
    """Such a name came as bytes that are no UTF-8; it does not end the program."""
    bare.setenv('LANG', locale)
    out = stream()
    bare.setattr('sys.stdout', out)
    prepare()
    print(b'run\xff'.decode('utf-8', 'surrogateescape'), file=out)
    written = out.buffer
    assert isinstance(written, io.BytesIO)
    assert written.getvalue() == b'run\xff\n'


@pytest.mark.parametrize(
    ('told', 'colour'),
    [
        ({}, False),
        ({'FORCE_COLOR': '1'}, True),
        ({'FORCE_COLOR': '0'}, False),
        ({'FORCE_COLOR': '1', 'NO_COLOR': '1'}, False),
        ({'FORCE_COLOR': '1', 'NO_COLOR': ''}, True),
    ],
)
def test_a_pipe_has_colour_only_if_it_is_forced(
    told: dict[str, str], bare: pytest.MonkeyPatch, *, colour: bool
) -> None:
    """NO_COLOR is before FORCE_COLOR; a variable that is empty is not set."""
    for name, value in told.items():
        bare.setenv(name, value)
    assert takes_colour(stream()) is colour


@pytest.mark.parametrize(('told', 'columns'), [('', 80), ('120', 120), ('0', 80), ('wide', 80)])
def test_a_pipe_has_80_columns(told: str, columns: int, bare: pytest.MonkeyPatch) -> None:
    """Whatever terminal the program was started from; COLUMNS says otherwise."""
    bare.setenv('COLUMNS', told)
    assert columns_of(stream()) == columns


def said(text: str, width: int, indent: int = 0, hang: int | None = None) -> list[str]:
    """Return the lines of a sentence."""
    out = io.StringIO()
    say(Console(file=out, width=width, highlight=False), escape(text), indent, hang)
    return out.getvalue().splitlines()


@given(st.lists(WORDS, min_size=1, max_size=40), st.integers(20, 100), st.integers(0, 8))
def test_a_wrapped_sentence_loses_nothing(words: list[str], width: int, indent: int) -> None:
    """Every word is there, whole and in its place; no line is wider, but for one that must be."""
    lines = said(' '.join(words), width, indent, indent + 2)
    assert ' '.join(lines).split() == words
    assert all(len(line) <= width or len(line.split()) == 1 for line in lines)
    assert [len(line) - len(line.lstrip()) for line in lines] == [
        indent, *[indent + 2] * (len(lines) - 1)
    ]  # fmt: skip


def test_a_path_stays_whole_and_a_number_with_its_unit() -> None:
    """A path can be copied; "12.21" and "s" do not stand in two lines."""
    path = '/a/very/long/path/to/the/recording/of/the/robot/run_0.mcap'
    assert path in [line.strip() for line in said(f'see {path} for it', 30)]
    for width in range(20, 40):
        assert not [x for x in said('its limit is 55.4 N m at 12.21 s', width) if x.endswith('m at')
                    and x.startswith('  N')]  # fmt: skip
        assert all(not re.search(r'\d$', x) for x in said('then 55.4 N m at 12.21 s', width))


@pytest.mark.parametrize(
    ('typed', 'told'),
    [
        (['campaign', 'my runs', '-o', 'x'], "ugv-acceptance campaign 'my runs' -o x --resume"),
        (['run', '--ros-args', '-r', 'a:=b'], 'ugv-acceptance run --resume --ros-args -r a:=b'),
    ],
)
def test_a_command_is_told_so_that_it_can_be_typed_again(
    typed: list[str], told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Quoted for a shell; what is added stands before the arguments for ROS."""
    monkeypatch.setattr('sys.argv', ['/opt/bin/ugv-acceptance', *typed])
    assert again('--resume') == told


def test_the_short_text_keeps_what_must_not_be_lost(repository: object) -> None:
    """Of many reasons three, of doubts two, of the others how many: never all of them away."""
    result = evaluate(f'{repository}/bags/packbot_fail').result
    result['reasons'] = [f'reason {k}' for k in range(9)]
    result['model_check']['findings'] = [f'odd {k}' for k in range(5)]
    result['robot']['warnings'] = [f'strange {k}' for k in range(4)]
    result['not_checked'] = [
        {'what': f'thing {k} of a long name', 'why': '', 'seconds': None} for k in range(60)
    ]
    out = io.StringIO()
    result_text.print_result(result, Console(file=out, width=80, highlight=False))
    text = ' '.join(out.getvalue().split())
    for words in (
        *('reason 0 reason 1 reason 2 and 6 more reasons (-v lists them)', 'doubt: odd 0'),
        *('doubt: odd 1 and 3 more doubts (-v lists them)', 'warning: strange 0 and 3 more'),
        *('NOT CHECKED: thing 0 of a long name; thing 1', 'more', '60 reasons of NOT CHECKED'),
    ):
        assert words in text
    assert len(out.getvalue().splitlines()) <= 26
    out = io.StringIO()
    result_text.print_result(result, Console(file=out, highlight=False), verbose=True)
    text = out.getvalue()
    assert all(f'{what} {k}' in text for what, n in (('reason', 9), ('odd', 5)) for k in range(n))
    assert all(f'thing {k} of' in text for k in range(60))
