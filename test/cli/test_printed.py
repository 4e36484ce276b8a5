"""What a person sees of the verbs: the verdict first and last, short, 80 columns, no codes left."""

import fcntl
import json
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from cli.here import ugv

from ugv_acceptance.cli import VERBS

MAIN = 'from ugv_acceptance.cli import main; main()'
BAGS = Path(__file__).parents[2] / 'bags'
FAIL, PASS = BAGS / 'packbot_fail', BAGS / 'packbot_pass'
ESCAPE = '\x1b'
# Verbs that print a result without a robot, and end by themselves.
PRINTED = {
    'evaluate': ('evaluate', FAIL),
    'evaluate -v': ('evaluate', FAIL, '-v'),
    'model': ('model', '--config', 'packbot_eod'),
    'plan': ('plan', '--short'),
    'speed': ('speed', '--samples', '3'),
    'risk': ('risk', '--samples', '1000'),
    'map': ('map', 'rollover', '--steps', '11', '--out', 'map.csv', '--overwrite'),
    'simulate --list': ('simulate', '--list'),
    'campaign': ('campaign', PASS, '-o', 'campaign', '--workers', '1'),
    **{f'{verb} --help': (verb, '--help') for verb in VERBS},
    '--help': ('--help',),
}


def too_long(text: str) -> list[str]:
    """Return the lines of more than 80 columns that could have been wrapped at a blank."""
    lines = (line.rstrip() for line in text.splitlines())
    return [x for x in lines if len(x) > 80 and len(x.split()) > 1 and '/' not in x]


@pytest.mark.parametrize('name', PRINTED)
def test_a_pipe_of_the_c_locale_gets_ascii_of_80_columns(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No code for a terminal, no letter beyond ASCII, no question mark in its place."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('LC_ALL', 'C')
    for gone in ('COLUMNS', 'FORCE_COLOR', 'PYTHONIOENCODING'):
        monkeypatch.delenv(gone, raising=False)
    # Whoever runs the tests may force colours on typer's help.
    monkeypatch.setenv('GITHUB_ACTIONS', '1')
    done = ugv(*PRINTED[name])
    text = done.stdout + done.stderr
    assert done.returncode in (0, 1), done.stderr
    assert text.isascii(), [c for c in text if not c.isascii()]
    assert ESCAPE not in text
    assert too_long(text) == []


def in_terminal(folder: Path, *words: object, **more: str) -> str:
    """Run a verb on a terminal of 80 columns and return all that it was sent."""
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack('HHHH', 24, 80, 0, 0))
    kept = ('NO_COLOR', 'FORCE_COLOR', 'COLUMNS', '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'LC_ALL')
    known = {k: v for k, v in os.environ.items() if k not in kept}
    command = [sys.executable, '-c', MAIN, *map(str, words)]
    environment = {**known, 'TERM': 'xterm-256color', 'LANG': 'C.UTF-8', **more}
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdin=follower, stdout=follower, stderr=follower
    ):
        os.close(follower)
        parts = []
        try:
            while part := os.read(leader, 65536):
                parts.append(part)
        except OSError:  # the last of the terminal's users is gone
            pass
    os.close(leader)
    return b''.join(parts).decode().replace('\r\n', '\n')


def test_a_terminal_gets_colour_and_no_line_of_more_columns(tmp_path: Path) -> None:
    """The verdict is red, first and last; what was drawn meanwhile is wiped away."""
    text = in_terminal(tmp_path, 'evaluate', FAIL, '--json', 'r.json')
    shown = text.rpartition('\r')[2] if '\r' in text else text
    assert re.search(r'\x1b\[1;31m\[X\] FAIL\x1b\[0m', text)
    assert text.count('[X] FAIL') == 2
    assert too_long(re.sub(r'\x1b\[[0-9;?]*[a-zA-Z]', '', shown)) == []


@pytest.mark.parametrize('words', [('evaluate', FAIL, '--json', 'r.json'), ('evaluate', '--help')])
def test_no_color_leaves_no_escape_sequence(words: tuple[object, ...], tmp_path: Path) -> None:
    """Neither bold nor dim, and nothing that moves the cursor."""
    text = in_terminal(tmp_path, *words, NO_COLOR='1')
    assert ESCAPE not in text
    assert 'FAIL' in text
    assert too_long(text) == []


def test_colour_can_be_forced_on_a_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    """As CI shows it; nothing moves a cursor that is not there. NO_COLOR has the last word."""
    monkeypatch.setenv('FORCE_COLOR', '1')
    monkeypatch.delenv('NO_COLOR', raising=False)
    done = ugv('evaluate', FAIL)
    assert f'{ESCAPE}[1;31m[X] FAIL' in done.stdout
    assert set(re.findall(r'\x1b\[[0-9;?]*([a-zA-Z])', done.stdout + done.stderr)) == {'m'}
    monkeypatch.setenv('NO_COLOR', '1')
    assert ESCAPE not in ugv('evaluate', FAIL).stdout


def test_the_verdict_stands_first_and_last_in_a_dozen_lines() -> None:
    """Sentences; each may need two lines. What is left out is counted, and -v has it."""
    lines = ugv('evaluate', FAIL).stdout.splitlines()
    assert lines[0] == lines[-1]
    assert lines[0].startswith('[X] FAIL')
    assert len(lines) <= 20
    # A sentence begins two or four columns in; what is wrapped hangs two further in.
    sentences = [x for k, x in enumerate(lines) if not k or not x.startswith(' ' * 8)]
    assert len([x for x in sentences if re.match(r' {0,2}\S', x)]) <= 14
    (told,) = [line for line in lines if line.endswith('left out: -v lists them')]
    count = int(re.findall(r'(\d+) alerts', told)[0])
    whole = ugv('evaluate', FAIL, '-v').stdout
    shown = sum(bool(re.match(r' {4}\d+\.\d+ (s )?to ', line)) for line in lines)
    listed = sum(bool(re.match(r' {4}\d+\.\d+ (s )?to ', x)) for x in whole.splitlines())
    assert listed == count + shown


def test_a_worst_value_stands_beside_its_own_time() -> None:
    """Not beside the time at which its alert was raised, seconds earlier."""
    text = ' '.join(ugv('evaluate', FAIL, '-v').stdout.split())
    assert '24.71 s to the end CAUTION TIP_OVER 35 deg past tipping: RIGHT at 28.15 s' in text
    assert (
        '10.80 s to 13.39 s DANGER TORQUE_LIMIT shoulder_joint 110 % of its limit at 12.21 s'
        in (text)
    )


def test_of_several_recordings_the_verdicts_stand_together_at_the_end(tmp_path: Path) -> None:
    """A line each, in the order given; one that cannot be read is among them."""
    nothing = tmp_path / 'nothing'
    done = ugv('evaluate', PASS, nothing, FAIL)
    assert done.returncode == 1
    last = [re.split(r'  +', line)[0] for line in done.stdout.splitlines()[-3:]]
    assert last == ['[OK] PASS', '[!] BAD INPUT', '[X] FAIL']


def test_every_file_is_said_to_be_written_where_no_pipe_is_disturbed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One form for all verbs, on standard error; a file that was not asked for is not named."""
    monkeypatch.chdir(tmp_path)
    papers = {
        '--json': 'r.json', '--csv': 'm.csv', '--report': 'r.html', '--junit': 'r.xml',
        '--init-criteria': 'c.yaml', '--annotate': 'a.mcap',
    }  # fmt: skip
    urdf = BAGS.parent / 'urdf' / 'packbot.urdf'
    verbs: dict[tuple[object, ...], list[str]] = {
        ('evaluate', PASS, *(x for pair in papers.items() for x in pair)): [*papers.values()],
        ('plan', '--short', '-o', 'p.yaml', '--card', 'c.html'): ['p.yaml', 'c.html'],
        ('map', 'drag', '--steps', '5', '--out', 'm.npz'): ['m.npz'],
        ('simulate', 'gentle', '-s', '1', '-o', 'made'): ['made'],
        ('campaign', PASS, '-o', 'all', '--workers', '1'): [
            *('all/runs', 'all/campaign.json', 'all/campaign.html')
        ],
        ('init', urdf, '-o', 'i.yaml', '--picture', 'i.html'): ['i.yaml', 'i.html'],
    }
    for words, files in verbs.items():
        done = ugv(*words)
        told = [line.removeprefix('Wrote ') for line in done.stderr.splitlines() if 'Wrote' in line]
        assert sorted(told) == sorted(files), (words, done.stderr)
        assert all(Path(file).exists() for file in files)
        assert 'Wrote' not in done.stdout


def test_a_result_on_standard_output_is_alone_there() -> None:
    """`--json -` can be read by a program; the words for people go to standard error."""
    command = [sys.executable, '-c', MAIN, 'evaluate', str(FAIL), '--json', '-']
    known = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    done = subprocess.run(command, env=known, capture_output=True, text=True, check=False)
    assert json.loads(done.stdout)['verdict'] == 'FAIL'
    assert done.stderr.count('[X] FAIL') == 2


def test_what_differs_from_a_result_is_told_first_and_last(tmp_path: Path) -> None:
    """With the differences between; one that agrees has one line."""
    file = tmp_path / 'r.json'
    ugv('evaluate', PASS, '--json', file)
    done = ugv('verify', file)
    assert done.stdout.startswith('[OK] VERIFIED')
    file.write_text(file.read_text().replace('"verdict": "PASS"', '"verdict": "FAIL"', 1))
    done = ugv('verify', file)
    assert done.returncode == 1
    text = done.stdout.rstrip()
    head = text[: text.index('verdict:')].strip()
    assert head.startswith('[X] DIFFERS')
    assert text.endswith(head)


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (('evaluate', '--nothing'), 'evaluate: No such option: --nothing'),
        (('evaluate',), 'evaluate: Missing argument'),
        (('simulate',), '--bag'),
        (('nonsense',), "No such command 'nonsense'"),
    ],
)
def test_a_wrong_usage_is_one_line_and_names_the_help(words: tuple[str, ...], told: str) -> None:
    """As every other error: the program, what is wrong, and where it says more."""
    done = ugv(*words)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith('ugv-acceptance: ')
    assert told in line
    assert '--help` says more' in line
