"""`ugv-acceptance verify`: computes a result again from its recording and compares everything."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from ugv_acceptance import AcceptanceError
from ugv_acceptance.cli.completion import configs_like
from ugv_acceptance.cli.terminal_output import COLOURS, console_of, say, say_list, while_read

if TYPE_CHECKING:
    from ugv_acceptance.evaluation.ground import Ground
    from ugv_acceptance.model.robot import Payload
    from ugv_acceptance.type_aliases import Json

# Relative difference of numbers that is rounding of another machine's arithmetic.
ROUNDING = 1e-9
MOST_SHOWN = 12
# The safeguard that older results do not have.
SAFEGUARD = 'robot_description'


def verify(
    result_file: Annotated[
        Path, typer.Argument(metavar='RESULT', help='The JSON file that evaluate --json wrote.')
    ],
    bag: Annotated[list[Path] | None, typer.Option(help='The recording, if it was moved.')] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            '--config',
            '-c',
            help="The robot's YAML file, if it was moved.",
            autocompletion=configs_like,
        ),
    ] = None,
    urdf: Annotated[Path | None, typer.Option(help='The URDF, if it was moved.')] = None,
    criteria: Annotated[Path | None, typer.Option(help='The criteria, if they were moved.')] = None,
    drill: Annotated[
        list[Path] | None, typer.Option(help='The records of drills, if they were moved.')
    ] = None,
) -> None:
    """Verify a result: everything is computed again; hashes, verdicts and numbers are compared.

    The exit code is 0 where all agree, 1 where anything differs, 2 for bad input.

    \b
    Examples:
      ugv-acceptance verify result.json
      ugv-acceptance verify result.json --bag /media/usb/run_0.mcap
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    told = read_result(result_file)
    found = again(told, result_file.parent, bag, config, urdf, criteria, drill)
    differences = compare(told, found)
    with while_read():
        print_comparison(differences, result_file, told['verdict'])
    raise typer.Exit(1 if differences else 0)


def print_comparison(differences: list[str], path: Path, verdict: str) -> None:
    """Print the outcome of the comparison; where anything differs, first and last."""
    console = console_of()
    if not differences:
        text = f'{path}: the same hashes, verdicts and numbers ({verdict})'
        say(console, f'[{COLOURS["PASS"]}]\\[OK] VERIFIED[/]  {escape(text)}')
        return
    count = f'{len(differences)} difference{"s" * (len(differences) > 1)}'
    outcome = f'[{COLOURS["FAIL"]}]\\[X] DIFFERS[/]  {escape(f"{path}: {count}")}'
    say(console, outcome)
    say_list(console, differences, MOST_SHOWN, 'differences', 2)
    say(console, outcome)


def read_result(path: Path) -> 'Json':
    """Return a result of one recording. Raises AcceptanceError where the file is none of ours."""
    import json

    from ugv_acceptance.offline.judge import RESULT_VERSION

    try:
        told = json.loads(path.read_text('utf-8'))
    except OSError as error:
        raise AcceptanceError(f'{path}: expected a result, got: {error.strerror}') from None
    except (ValueError, RecursionError):
        raise AcceptanceError(
            f'{path}: expected a result (JSON, from evaluate --json), got no JSON'
        ) from None
    if not isinstance(told, dict):
        raise AcceptanceError(f'{path}: expected the result of one recording, got a list or less')
    if told.get('version') != RESULT_VERSION:
        raise AcceptanceError(
            f'{path}: expected a result of version {RESULT_VERSION}, got '
            f'{told.get("version")!r}; evaluate the recording again (docs/upgrading.md)'
        )
    for key, kind in (('bag', dict), ('robot', dict), ('criteria', dict), ('verdict', str)):
        if not isinstance(told.get(key), kind):
            raise AcceptanceError(f'{path}: {key}: expected a result of evaluate, got none')
    return told


def _near(path: str, folder: Path, option: str) -> Path:
    """Return a file at its recorded path, or else beside the result, as on a USB stick.

    Raises AcceptanceError where it is at neither place; `option` is the option that names it.
    """
    for place in (Path(path), folder / Path(path).name):
        if place.exists():
            return place
    raise AcceptanceError(
        f'{path}: expected this file (seen from {Path.cwd()}) or its name beside the result, '
        f'found neither: give its path with {option}'
    )


def again(
    told: 'Json',
    folder: Path,
    bag: list[Path] | None,
    config: Path | None,
    urdf: Path | None,
    criteria: Path | None,
    drill: list[Path] | None = None,
) -> 'Json':
    """Return the result computed again from the files it names, beside it, or as given."""
    import json

    from ugv_acceptance.bag.recording import open_recording
    from ugv_acceptance.drill.record import training_record
    from ugv_acceptance.offline.evaluate import evaluate
    from ugv_acceptance.offline.judge import Options
    from ugv_acceptance.offline.own_robot import robot_of

    try:
        paths = bag or [_near(path, folder, '--bag') for path in told['bag']['path']]
        robot, named = told['robot'], told['criteria']['path']
        at = config or _near(robot['config'], folder, '--config')
        recorded = urdf is None and robot.get('description') == 'recorded'
        model = None if recorded else urdf or _near(robot['urdf'], folder, '--urdf')
    except (KeyError, TypeError) as error:
        raise AcceptanceError(f'expected a result of evaluate; there is no {error}') from None
    opened = open_recording(paths)
    loaded = robot_of(opened, at, urdf=model)
    if criteria is None and named is not None:
        criteria = _near(named, folder, '--criteria')
    entered = told.get('identity')
    drills = drill or [_near(path, folder, '--drill') for path in _drills(told)]
    options = Options(compare_effort='effort' in told, training=tuple(map(training_record, drills)))
    result = evaluate(
        opened,
        config=loaded,
        criteria=criteria,
        payload=payload_of(told),
        ground=ground_of(told),
        identity=entered if isinstance(entered, dict) else None,
        options=options,
    )
    found: Json = json.loads(result.to_json())
    for key, first in _LATER.items():  # written before results said it
        if first not in told:
            found.pop(key, None)
    _without_later_keys(told, found)
    if 'urdf_sha256' not in told['robot']:
        _without_description(found)
    return found


def _without_later_keys(told: 'Json', found: 'Json') -> None:
    """Take from the alerts of a result what older ones did not say."""
    alerts = told.get('alerts', ())
    if not all('worst_s' in alert for alert in alerts):
        for alert in found['alerts']:
            del alert['worst_s']
    if not any('acknowledged_from' in alert for alert in alerts):
        for alert in found['alerts']:
            alert.pop('acknowledged_from', None)


def _drills(told: 'Json') -> list[str]:
    """Return the files of the drills' records that a result names."""
    try:
        return [str(one['file']) for one in told.get('operator_training', {}).get('records', ())]
    except (AttributeError, KeyError, TypeError) as error:
        raise AcceptanceError(f'operator_training: expected records with files: {error}') from None


def _without_description(found: 'Json') -> None:
    """Take from a result what older ones did not say of the robot's own description."""
    del found['robot']['urdf_sha256'], found['robot']['description']
    fine = [s for s in found['safeguards'] if s['name'] != SAFEGUARD or s['verdict'] != 'PASS']
    found['safeguards'] = fine


# What results did not say once, and the key by whose absence that is seen.
_LATER = {'limits_hash': 'limits_hash', 'limits_relaxed': 'limits_hash', 'ground': 'ground'}


def payload_of(told: 'Json') -> 'Payload | None':
    """Return the payload that was declared when a result was made, None if none was."""
    from ugv_acceptance.model.robot import Payload

    said = told.get('declared_payload')
    try:
        return None if said is None else Payload(float(said['mass_kg']), tuple(said['cog_m']))
    except (KeyError, TypeError, ValueError) as error:
        raise AcceptanceError(f'declared_payload: expected mass_kg and cog_m: {error}') from None


def ground_of(told: 'Json') -> 'Ground | None':
    """Return the ground that was entered when a result was made, None if none was."""
    from ugv_acceptance.evaluation.ground import KINDS, Ground, GroundWindow

    said: Any = told.get('declared_ground')
    try:
        parts = [(w['kind'], float(w['start_s']), float(w['end_s'])) for w in said['windows']]
        always = said['kind']
    except (KeyError, TypeError, ValueError) as error:
        if said is None:
            return None
        raise AcceptanceError(f'declared_ground: expected kind and windows: {error}') from None
    if not {always, *(kind for kind, _, _ in parts)} <= {None, *KINDS}:
        raise AcceptanceError(f'declared_ground: expected kinds {", ".join(KINDS)}')
    return Ground(always, windows=tuple(GroundWindow(*part) for part in parts))


# Where a file lies, what computed it and what a person entered may differ.
_FREE: set[tuple[str, ...]] = {
    ('bag', 'path'),
    ('robot', 'config'),
    ('robot', 'urdf'),
    ('criteria', 'path'),
}
_FREE |= {('software',), ('identity',), ('robot', 'warnings')}


def compare(told: Any, found: Any, path: tuple[str, ...] = ()) -> list[str]:  # noqa: ANN401 - JSON
    """Return one line for each difference between two results; hashes come first."""
    if path in _FREE or (path[:1] == ('operator_training',) and path[-1] == 'file'):
        return []
    where = '.'.join(path) or 'result'
    if isinstance(told, dict) and isinstance(found, dict):
        keys = sorted({*told, *found}, key=str)
        lines = [
            line
            for key in keys
            for line in compare(told.get(key), found.get(key), (*path, str(key)))
        ]
        return sorted(lines, key=lambda line: 'sha256' not in line.split(':', 1)[0])
    if isinstance(told, list) and isinstance(found, list):
        if len(told) != len(found):
            return [f'{where}: {len(told)} in the result, {len(found)} computed again']
        pairs = enumerate(zip(told, found, strict=True))
        return [line for k, (a, b) in pairs for line in compare(a, b, (*path, str(k)))]
    return (
        [] if _same(told, found) else [f'{where}: {told!r} in the result, {found!r} computed again']
    )


def _same(told: object, found: object) -> bool:
    numbers = (int, float)
    if isinstance(told, bool) or isinstance(found, bool):
        return told is found
    if isinstance(told, numbers) and isinstance(found, numbers):
        return abs(told - found) <= ROUNDING * max(1.0, abs(told), abs(found))
    return told == found
