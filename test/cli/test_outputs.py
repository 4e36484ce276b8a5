"""What a verb writes never costs anybody a file: no input, no other output, nothing of others."""

import inspect
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, get_type_hints

import pytest
import typer
import yaml
from typer.testing import CliRunner, Result

from ugv_acceptance import AcceptanceError
from ugv_acceptance.cli import VERBS

REPOSITORY = Path(__file__).parents[2]
MAIN = 'from ugv_acceptance.cli import main; main()'
SITE = """\
version: 1
name: site
criteria: {no error: {alert: any, level: ERROR, expect: absent}}
"""
# Verb and option that writes a file, the endings it takes, the option for another format.
EVALUATE = {
    '--json': '.json',
    '--csv': '.csv',
    '--report': '.html',
    '--pdf': '.pdf',
    '--junit': '.xml',
    '--parquet': '.parquet',
    '--init-criteria': '.yaml',
    '--annotate': '.mcap',
}
FILES = {
    **{('evaluate', option): ending for option, ending in EVALUATE.items()},
    ('info', '--json'): '.json',
    ('plan', '--out'): '.yaml',
    ('plan', '-o'): '.yml',
    ('plan', '--card'): '.html',
    ('map', '--out'): '.svg',
    ('init', '--out'): '.yaml',
    ('init', '--picture'): '.png',
    ('drill', '--out'): '.json',
}
MAPS = ('.svg', '.png', '.csv', '.npz')
FOLDERS = {
    ('campaign', '--out'), ('paper', '--out'), ('simulate', '--bag'), ('run', '--out'),
    ('record', '--out'),
}  # fmt: skip
# Paths that verbs read; whatever else is a path is written, and stands in one of the tables above.
READ = {
    'config', 'urdf', 'bag', 'bags', 'criteria', 'result_file', 'failures', 'mission', 'existing',
    'from_bag', 'plan', 'sources', 'meshes', 'check', 'drill', 'script', 'trajectory',
}  # fmt: skip
# Parameters that are called otherwise than their options.
NAMES = {'json_file': '--json', 'csv_file': '--csv', 'init_criteria': '--init-criteria'}


def verb(name: str) -> Callable[..., Any]:
    """Return the function of a verb."""
    found: Callable[..., Any] = getattr(import_module(f'ugv_acceptance.cli.{name}'), name)
    return found


def run(name: str, *arguments: object) -> Result:
    """Run a verb in this process; its errors are raised."""
    app = typer.Typer()
    app.command(name, context_settings=getattr(
        import_module(f'ugv_acceptance.cli.{name}'), 'CONTEXT', None))(verb(name))  # fmt: skip
    return CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)


def process(*arguments: object, **more: Any) -> 'subprocess.CompletedProcess[str]':
    """Run the command in a process of its own."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    command = [sys.executable, '-c', MAIN, *map(str, arguments)]
    return subprocess.run(
        command, env=environment, stderr=subprocess.PIPE, text=True, check=False,
        **{'stdout': subprocess.PIPE, **more},
    )  # fmt: skip


def contents(folder: Path) -> dict[str, bytes | str]:
    """Return everything in a folder: bytes of files, targets of links."""
    return {
        str(p.relative_to(folder)): str(p.readlink()) if p.is_symlink() else p.read_bytes()
        for p in folder.rglob('*')
        if p.is_symlink() or p.is_file()
    }


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the working folder: a recording, a robot's files, criteria, an identity, a plan."""
    shutil.copytree(REPOSITORY / 'bags' / 'packbot_pass', tmp_path / 'run')
    (tmp_path / 'flat').mkdir()
    shutil.copy(tmp_path / 'run' / 'packbot_pass_0.mcap', tmp_path / 'flat' / 'alone.mcap')
    shutil.copy(REPOSITORY / 'urdf' / 'packbot.urdf', tmp_path / 'packbot.urdf')
    text = (REPOSITORY / 'msg_configs' / 'packbot.yaml').read_text()
    (tmp_path / 'robot.yaml').write_text(text.replace('../urdf/', ''))
    (tmp_path / 'site.yaml').write_text(SITE)
    (tmp_path / 'who.yaml').write_text('operator: A. Smith\n')
    shutil.copy(REPOSITORY / 'bags' / 'packbot_short_plan.yaml', tmp_path / 'mine.yaml')
    (tmp_path / 'answers.txt').write_text('all: ignore\n')
    (tmp_path / 'failures.yaml').write_text('failures: []\n')
    monkeypatch.chdir(tmp_path)
    return tmp_path


# What each verb reads here: its arguments, and its inputs by their names in messages.
GIVEN: dict[str, tuple[list[str], dict[str, str]]] = {
    'evaluate': (
        ['run', '-c', 'robot.yaml', '--criteria', 'site.yaml', '--identity', 'who.yaml'],
        {
            'the recording': 'run/packbot_pass_0.mcap',
            'the configuration': 'robot.yaml',
            'the URDF': 'packbot.urdf',
            'the criteria': 'site.yaml',
            'the identity': 'who.yaml',
        },
    ),
    'info': (
        ['run', '-c', 'robot.yaml'],
        {
            'the recording': 'run/packbot_pass_0.mcap',
            'the configuration': 'robot.yaml',
            'the URDF': 'packbot.urdf',
        },
    ),
    'plan': (
        ['--from', 'mine.yaml', '-c', 'robot.yaml'],
        {
            'the plan': 'mine.yaml',
            'the configuration': 'robot.yaml',
            'the URDF': 'packbot.urdf',
        },
    ),
    'init': (
        ['packbot.urdf', 'run'],
        {'the description': 'packbot.urdf', 'the recording': 'run/packbot_pass_0.mcap'},
    ),
    'drill': (['--script', 'answers.txt'], {'the script': 'answers.txt'}),
    'map': (
        ['torque', '--steps', '11', '-c', 'robot.yaml', '--from-bag', 'flat/alone.mcap'],
        {
            'the recording': 'flat/alone.mcap',
            'the configuration': 'robot.yaml',
            'the URDF': 'packbot.urdf',
        },
    ),
}


def refused(name: str, *arguments: object, option: str = '', path: object = '') -> str:
    """Run a verb that must refuse: one line that names option and file, nothing touched."""
    before = contents(Path())
    with pytest.raises(AcceptanceError) as error:
        run(name, *arguments)
    text = str(error.value)
    assert '\n' not in text
    assert text.startswith(f'{option} {path}')
    assert contents(Path()) == before
    return text


@pytest.mark.parametrize('name', VERBS)
def test_no_verb_has_an_output_that_is_not_asked_about_here(name: str) -> None:
    """Each option that is a path is read, or stands in a table of this file; it can overwrite."""
    hints = get_type_hints(verb(name))
    paths = {
        NAMES.get(k, f'--{k}')
        for k in inspect.signature(verb(name)).parameters
        if 'Path' in str(hints.get(k))
        and k not in READ - ({'bag'} if name == 'simulate' else set())
    }
    told = {option for of, option in (*FILES, *FOLDERS) if of == name and option != '-o'}
    assert paths == told
    # A recording is never replaced, so those that only record cannot be asked to.
    assert ('overwrite' in hints) == bool(told and name not in {'simulate', 'run', 'record'})


@pytest.mark.parametrize('spelling', ['itself', 'dotted', 'symbolic link', 'hard link'])
@pytest.mark.parametrize(
    ('name', 'option', 'what'),
    [(name, option, what) for name, option in FILES for what in GIVEN[name][1]],
)
def test_an_output_is_never_an_input(
    place: Path, name: str, option: str, what: str, spelling: str
) -> None:
    """By no name, for no kind of input, not even with --overwrite."""
    arguments, inputs = GIVEN[name]
    source = place / inputs[what]
    alias = Path(f'alias{FILES[name, option]}')
    target = {'itself': Path(inputs[what]), 'dotted': Path('run', '..', inputs[what])}.get(
        spelling, alias
    )
    if spelling == 'symbolic link':
        alias.symlink_to(source)
    elif spelling == 'hard link':
        alias.hardlink_to(source)
    text = refused(
        name, *arguments, option, target, '--overwrite', option=_long(option), path=target
    )
    assert f'{what} itself' in text


def _long(option: str) -> str:
    return {'-o': '--out'}.get(option, option)


@pytest.mark.parametrize('bag', ['run', 'run/packbot_pass_0.mcap', 'run/'])
@pytest.mark.parametrize(('name', 'option'), [k for k in FILES if k[0] in {'evaluate', 'map'}])
def test_nothing_is_written_into_the_folder_of_a_recording(
    place: Path, name: str, option: str, bag: str
) -> None:
    """Whether the folder was named or a file in it; nor into a folder below it."""
    (place / 'run' / 'below').mkdir()
    arguments = [bag] if name == 'evaluate' else ['torque', '--from-bag', bag]
    for folder in ('run', 'run/below'):
        target = Path(folder) / f'new{FILES[name, option]}'
        text = refused(name, *arguments, option, target, '--overwrite', option=option, path=target)
        assert 'outside the folder of the recording' in text


@pytest.mark.parametrize('link', ['symbolic', 'hard', 'to nothing yet'])
@pytest.mark.parametrize(
    ('name', 'one', 'other'),
    [
        *(('evaluate', one, other) for one in EVALUATE for other in EVALUATE if one < other),
        ('plan', '-o', '--card'),
        ('map', '--out', '--out'),
    ],
)
def test_two_outputs_are_never_one_file(
    place: Path, name: str, one: str, other: str, link: str
) -> None:
    """Neither by a link, nor one that leads to what will be there only afterwards."""
    endings = ('.svg', '.png') if name == 'map' else (FILES[name, one], FILES[name, other])
    first, second = (Path(f'out{n}{ending}') for n, ending in enumerate(endings))
    if link != 'to nothing yet':
        first.touch()
    if link == 'hard':
        second.hardlink_to(first)
    else:
        second.symlink_to(place / first)
    arguments = [*GIVEN[name][0], one, first, other, second, '--overwrite']
    before = contents(place)
    with pytest.raises(AcceptanceError, match=f'this one is also the output of {_any()}'):
        run(name, *arguments)
    assert contents(place) == before


def _any() -> str:
    return '--[a-z-]+$'


def test_the_same_name_twice_is_refused(place: Path) -> None:
    """Spelt in two ways."""
    assert place.is_dir()
    text = refused('map', 'torque', '--out', 'a.svg', '--out', 'run/../a.svg', option='--out')
    assert 'this one is also the output of --out' in text


@pytest.mark.parametrize(('name', 'option'), FILES)
@pytest.mark.parametrize('content', [b'mine', b'{"version": 1}', b'<html></html>', b'# a: 1\n'])
def test_a_file_of_others_stays(place: Path, name: str, option: str, content: bytes) -> None:
    """Without --overwrite, which the error names."""
    target = Path(f'old{FILES[name, option]}')
    (place / target).write_bytes(content)
    arguments = GIVEN[name][0]
    text = refused(name, *arguments, option, target, option=_long(option), path=target)
    assert 'it exists' in text
    assert '--overwrite' in text


@pytest.mark.parametrize('ending', MAPS)
def test_a_map_of_others_stays(place: Path, ending: str) -> None:
    """Whatever its format."""
    (place / f'old{ending}').write_bytes(b'mine')
    refused('map', 'torque', '--out', f'old{ending}', option='--out', path=f'old{ending}')


WRONG = {
    ('evaluate', '--report'): [('m.pdf', 'expected .html or .htm; for PDF use --pdf')],
    ('evaluate', '--pdf'): [('m.html', 'expected .pdf; for HTML use --report')],
    ('evaluate', '--json'): [('m.csv', 'expected .json; for CSV use --csv')],
    ('evaluate', '--csv'): [
        ('m.parquet', 'expected .csv; for Parquet use --parquet'),
        ('m', 'expected .csv'),
    ],
    ('evaluate', '--parquet'): [('m.csv', 'expected .parquet; for CSV use --csv')],
    ('evaluate', '--junit'): [('m.json', 'expected .xml; for JSON use --json')],
    ('evaluate', '--annotate'): [('m.xml', 'expected .mcap; for JUnit XML use --junit')],
    ('evaluate', '--init-criteria'): [('m.txt', 'expected .yaml or .yml')],
    ('info', '--json'): [('m.csv', 'expected .json')],
    ('plan', '--card'): [('m.yml', 'expected .html or .htm; for YAML use --out')],
    ('plan', '--out'): [('m.html', 'expected .yaml or .yml; for HTML use --card')],
    ('plan', '-o'): [('m.json', 'expected .yaml or .yml')],
    ('map', '--out'): [('m.gif', 'expected .svg, .png, .csv or .npz')],
    ('init', '--out'): [('m.png', 'expected .yaml or .yml; for pictures use --picture')],
    ('drill', '--out'): [('m.xml', 'expected .json')],
    ('init', '--picture'): [('m.yaml', 'expected .png, .html or .htm; for YAML use --out')],
}


@pytest.mark.parametrize(
    ('name', 'option', 'target', 'told'),
    [(*key, target, told) for key, rows in WRONG.items() for target, told in rows],
)
def test_an_ending_that_does_not_fit_is_told(
    place: Path, name: str, option: str, target: str, told: str
) -> None:
    """With those that do, and the option for that format."""
    assert place.is_dir()
    assert set(WRONG) == set(FILES)
    text = refused(name, *GIVEN[name][0], option, target, option=_long(option), path=target)
    assert text == f'{_long(option)} {target}: {told}'


@pytest.mark.parametrize(
    'words',
    [
        ['evaluate', 'run', '--json', 'run/packbot_pass_0.mcap'],
        ['plan', '--from', 'mine.yaml', '--card', 'mine.yaml'],
        ['map', 'torque', '-c', 'robot.yaml', '--out', 'robot.yaml'],
        ['paper', '--out', 'flat'],
        ['campaign', 'run', '--out', 'flat'],
        ['simulate', 'gentle', '--bag', 'flat'],
        ['record', '--out', 'flat'],
        ['run', 'mine.yaml', '--sim', '--fast', '--out', 'flat'],
    ],
)
def test_it_is_one_line_and_exit_code_2(place: Path, words: list[str]) -> None:
    """As a person meets it: nothing but that line, and all files as they were."""
    before = contents(place)
    done = process(*words)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert words[-1] in done.stderr
    assert done.stdout == ''
    assert contents(place) == before


def test_what_evaluate_wrote_it_replaces(place: Path) -> None:
    """The same command twice: every kind of file is known again, but a recording is not risked."""
    pytest.importorskip('pyarrow', reason='extra table is not installed')
    pytest.importorskip('weasyprint', reason='extra pdf is not installed')
    options = [x for o, e in EVALUATE.items() if o != '--annotate' for x in (o, f'out{e}')]
    for word in ('', 'A. Smith'):
        done = run('evaluate', 'run', *options, '--identity', f'operator={word}')
        assert done.exit_code == 0, done.output
    assert 'A. Smith' in Path('out.html').read_text()
    assert json.loads(Path('out.json').read_text())['identity'] == {'operator': 'A. Smith'}
    assert run('evaluate', 'run', '--annotate', 'out.mcap').exit_code == 0
    refused('evaluate', 'run', '--annotate', 'out.mcap', option='--annotate', path='out.mcap')
    assert not [p for p in contents(place) if p.endswith('.part')]


def test_results_of_several_and_of_unreadable_bags_are_known_again(place: Path) -> None:
    """A list of results, and one that says only what is wrong with its recording."""
    (place / 'broken.mcap').write_bytes(b'no recording')
    for _ in range(2):
        assert (
            run('evaluate', 'broken.mcap', '--json', 'one.json', '--junit', 'one.xml').exit_code
            == 2
        )
        assert run('evaluate', 'broken.mcap', 'run', '--json', 'two.json').exit_code == 2


@pytest.mark.parametrize('ending', MAPS)
def test_a_map_is_known_again(place: Path, ending: str) -> None:
    """In each format; a map is no table of margins."""
    target = f'map{ending}'
    for steps in (5, 6):
        assert run('map', 'torque', '--steps', steps, '--out', target).exit_code == 0
    if ending == '.csv':
        refused('evaluate', 'run', '--csv', target, option='--csv', path=target)
    assert (place / target).stat().st_size


def test_another_kind_of_ours_is_a_file_of_others(place: Path) -> None:
    """A card is no report; the result of a campaign is none of a recording."""
    assert run('plan', '--short', '--card', 'card.html').exit_code == 0
    refused('evaluate', 'run', '--report', 'card.html', option='--report', path='card.html')
    assert run('campaign', 'run', '--out', 'out', '--workers', '1').exit_code == 0
    target = Path('out') / 'campaign.json'
    refused('evaluate', 'run', '--json', target, option='--json', path=target)
    assert place.is_dir()


@pytest.mark.parametrize(
    'edit',
    [
        lambda text: text.replace('hold_s: 3', 'hold_s: 4', 1) + '# mine\n',
        lambda text: text.replace('\n', '\n# mine\n', 1),
        lambda text: text[: len(text) // 2],
        lambda text: text.replace('purpose: ', 'purpose: my ', 1),
    ],
)
def test_a_plan_that_somebody_edited_stays(place: Path, edit: Callable[[str], str]) -> None:
    """One that nobody edited is replaced; a comment is an edit too."""
    plan = place / 'plan.yaml'
    for _ in range(2):
        assert run('plan', '--short', '-o', 'plan.yaml').exit_code == 0
    assert yaml.safe_load(plan.read_text())['steps']
    plan.write_text(edit(plan.read_text()))
    text = refused('plan', '--short', '-o', 'plan.yaml', option='--out', path='plan.yaml')
    assert 'edited' in text
    assert run('plan', '--short', '-o', 'plan.yaml', '--overwrite').exit_code == 0
    assert 'my' not in plan.read_text().split()


def test_criteria_that_somebody_edited_stay(place: Path) -> None:
    """The proposal itself is replaced, and is a file of criteria."""
    words = ['evaluate', 'run', '--init-criteria', 'new.yaml']
    assert run(*words).exit_code == 0
    assert run(*words).exit_code == 0
    assert run('evaluate', 'run', '--criteria', 'new.yaml').exit_code == 0
    file = place / 'new.yaml'
    file.write_text(file.read_text().replace('coverage: 0.95', 'coverage: 0.9', 1))
    assert 'edited' in refused(*words, option='--init-criteria', path='new.yaml')
    assert run(*words, '--overwrite').exit_code == 0
    assert 'coverage: 0.95' in file.read_text()


def test_overwrite_replaces_what_is_no_input(place: Path) -> None:
    """Asked for in so many words."""
    (place / 'old.json').write_text('mine')
    assert run('evaluate', 'run', '--json', 'old.json', '--overwrite').exit_code == 0
    assert json.loads((place / 'old.json').read_text())['verdict'] == 'PASS'


def test_an_empty_file_is_nothing_to_lose(place: Path) -> None:
    """As mktemp leaves it."""
    (place / 'new.json').touch()
    assert run('evaluate', 'run', '--json', 'new.json').exit_code == 0


def test_a_link_is_followed(place: Path) -> None:
    """The link stays a link, and the file it leads to is asked about."""
    (place / 'far').mkdir()
    (place / 'latest.json').symlink_to('far/result.json')
    for _ in range(2):
        assert run('evaluate', 'run', '--json', 'latest.json').exit_code == 0
    assert (place / 'latest.json').is_symlink()
    (place / 'far' / 'result.json').write_text('mine')
    refused('evaluate', 'run', '--json', 'latest.json', option='--json', path='latest.json')


@pytest.mark.parametrize(
    'option', ['--json', '--csv', '--parquet', '--annotate', '--init-criteria']
)
def test_a_file_beside_the_output_stays(place: Path, option: str) -> None:
    """Even one whose name is that of the output and .part, such as half of a download."""
    if option == '--parquet':
        pytest.importorskip('pyarrow', reason='extra table is not installed')
    target = f'new{EVALUATE[option]}'
    beside = place / f'{target}.part'
    shutil.copy(place / 'flat' / 'alone.mcap', beside)
    before = beside.read_bytes()
    assert run('evaluate', beside.name, option, target).exit_code == 0
    assert beside.read_bytes() == before
    assert (place / target).stat().st_size


# Folders


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('campaign', ['flat', '--out']),
        ('paper', ['--no-simulate', '--out']),
        ('simulate', ['gentle', '--seconds', '1', '--bag']),
        ('run', ['mine.yaml', '--sim', '--fast', '--out']),
    ],
)
def test_a_folder_of_others_is_not_filled(place: Path, name: str, words: list[str]) -> None:
    """Nor emptied: it is refused before anything is done; so is a file, and a place below one."""
    (place / 'theirs').mkdir()
    (place / 'theirs' / 'notes.txt').write_text('mine')
    before = contents(place)
    for target in ('theirs', 'site.yaml', 'site.yaml/below'):
        with pytest.raises(AcceptanceError, match=target):
            run(name, *words, target)
        assert contents(place) == before


@pytest.mark.parametrize(
    ('name', 'words', 'config'),
    [
        ('campaign', ['flat'], 'out/campaign.json'),
        ('campaign', ['flat'], 'out/runs/robot.json'),
        ('paper', ['--no-simulate'], 'out/figure.svg'),
        ('run', ['mine.yaml', '--sim', '--fast', '--resume'], 'out/result.json'),
    ],
)
def test_a_folder_never_takes_the_place_of_an_input(
    place: Path, name: str, words: list[str], config: str
) -> None:
    """Not even with --overwrite."""
    (place / config).parent.mkdir(parents=True)
    (place / 'robot.yaml').rename(place / config)
    shutil.move(place / 'packbot.urdf', (place / config).parent)
    more = [] if name == 'run' else ['--overwrite']
    text = refused(name, *words, '-c', config, '--out', 'out', *more, option='--out', path='out')
    assert 'the configuration' in text


def test_a_campaign_is_not_written_into_a_recording(place: Path) -> None:
    """Nor in the place of one; beside the recordings of a folder it may be."""
    for target in ('run', 'run/campaign'):
        words = ['.', '--out', target, '--overwrite', '--workers', '1']
        assert 'the recording' in refused('campaign', *words, option='--out', path=target)
    assert run('campaign', '.', '--out', 'flat/campaign', '--workers', '1').exit_code == 0
    assert (place / 'flat' / 'campaign' / 'campaign.json').is_file()


def test_a_campaign_goes_on_in_its_own_folder(place: Path) -> None:
    """One that is whole, and one that was ended before its statement; not one of recordings."""
    words = ['flat', '--out', 'out', '--workers', '1']
    assert run('campaign', *words).exit_code == 0
    assert run('campaign', *words).exit_code == 0
    for name in ('campaign.json', 'campaign.html'):
        (place / 'out' / name).unlink()
    assert run('campaign', *words).exit_code == 0
    (place / 'theirs').mkdir()
    shutil.copytree('flat', 'theirs/runs')
    refused('campaign', 'flat', '--out', 'theirs', option='--out', path='theirs')
    (place / 'out' / 'campaign.json').write_text('{"version": 1}')
    refused('campaign', *words, option='--out', path='out')


def test_a_plan_in_the_folder_of_a_run_stays(place: Path) -> None:
    """A folder with nothing but a plan is no run that was begun."""
    (place / 'plans').mkdir()
    shutil.copy(place / 'mine.yaml', place / 'plans' / 'plan.yaml')
    before = contents(place)
    with pytest.raises(AcceptanceError, match='plans: expected a new or empty folder'):
        run('run', '--sim', '--fast', '--out', 'plans')
    assert contents(place) == before


# Devices and pipes


def test_devices_and_pipes_are_written_as_they_are(place: Path) -> None:
    """Nothing is in their place afterwards, and no ending is asked for."""
    words = [
        'evaluate',
        'run',
        '--json',
        '/dev/stdout',
        '--csv',
        '/dev/null',
        '--junit',
        '/dev/null',
    ]
    done = process(*words)
    assert done.returncode == 0, done.stderr
    result, _ = json.JSONDecoder().raw_decode(done.stdout)
    assert result['verdict'] == 'PASS'
    assert Path('/dev/null').is_char_device()
    assert Path('/dev/stdout').is_symlink()
    done = process('plan', '--short', '-o', '/dev/stdout', '--card', '/dev/stderr')
    assert done.returncode == 0
    assert 'steps:' in done.stdout
    assert 'Operator card' in done.stderr
    assert place.is_dir()


def test_a_map_needs_an_ending(place: Path) -> None:
    """A pipe has none that would say which format is meant."""
    assert place.is_dir()
    words = ('torque', '--out', '/dev/null')
    assert 'expected .svg, .png' in refused('map', *words, option='--out', path='/dev/null')


def test_a_table_and_a_recording_go_through_a_pipe(place: Path) -> None:
    """As a shell's >(command) hands one over."""
    reading, writing = os.pipe()
    with os.fdopen(reading, 'rb') as source, (place / 'got').open('wb') as target:
        child = subprocess.Popen(['cat'], stdin=source, stdout=target)
        words = ['evaluate', 'run', '--annotate', f'/dev/fd/{writing}', '--json', 'r.json']
        done = process(*words, pass_fds=[writing])
        os.close(writing)
        child.wait()
    assert done.returncode == 0, done.stderr
    shutil.move(place / 'got', place / 'got.mcap')
    assert run('evaluate', 'got.mcap').exit_code == 0


def test_standard_output_that_is_a_file_is_one_output_like_others(place: Path) -> None:
    """Two outputs that a shell leads to one file would spoil each other."""
    with (place / 'all.txt').open('wb') as file:
        done = process('plan', '--short', '-o', '/dev/stdout', '--card', '/dev/stdout', stdout=file)
    assert done.returncode == 2
    assert 'this one is also the output of --out' in done.stderr
