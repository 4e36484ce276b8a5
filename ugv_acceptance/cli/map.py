"""`ugv-acceptance map`: draws torque, tilt left, payload or pull over two joints."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance.cli.completion import (
    MAPS,
    ORIENTATIONS,
    joints_like,
    map_files_like,
    poses_like,
    words_like,
)
from ugv_acceptance.cli.options import Overwrite, PayloadMass, RobotFile
from ugv_acceptance.cli.outputs import Output, check_outputs, inputs_of

if TYPE_CHECKING:
    from ugv_acceptance.config import Config
    from ugv_acceptance.report.map_data import Scene
    from ugv_acceptance.type_aliases import Floats


def map(  # noqa: A001 - the verb's name; one parameter an option
    kind: Annotated[
        str,
        typer.Argument(help='torque, rollover, payload or drag.', autocompletion=words_like(*MAPS)),
    ],
    out: Annotated[
        list[Path] | None,
        typer.Option(
            help='File to write: .svg, .png, .csv or .npz; may be given again.',
            autocompletion=map_files_like,
        ),
    ] = None,
    config: RobotFile = None,
    x: Annotated[
        str,
        typer.Option(
            help='Joint of the horizontal axis: JOINT or JOINT=0deg:180deg; by default the first '
            'of the arm that lifts.',
            autocompletion=joints_like,
        ),
    ] = '',
    y: Annotated[
        str,
        typer.Option(
            help='Joint of the vertical axis: JOINT or JOINT=0deg:360deg; by default the second.',
            autocompletion=joints_like,
        ),
    ] = '',
    posture: Annotated[
        str,
        typer.Option(
            help='Posture of the other joints: joint=30deg,...', autocompletion=poses_like
        ),
    ] = '',
    orientation: Annotated[
        str,
        typer.Option(
            help='How the ground lies: level, right, left, nose-up, nose-down, nose-up-right, ...',
            autocompletion=words_like(*ORIENTATIONS),
        ),
    ] = 'level',
    slope: Annotated[str, typer.Option(help='How far it is tilted: 30deg.')] = '30deg',
    payload: PayloadMass = '',
    limit: Annotated[
        str, typer.Option(help='Torque limits instead of the configured ones: joint="50 N m",...')
    ] = '',
    caution: Annotated[
        str, typer.Option(help='Caution from here on: 80 (% of torque), 10deg, 4 (kg), 50 (N).')
    ] = '',
    failure: Annotated[
        str, typer.Option(help='Failure from here on, as --caution: 100, 0deg, 2, 25.')
    ] = '',
    friction: Annotated[
        float, typer.Option(help='Friction coefficient of the tracks on the ground, for drag.')
    ] = 0.7,
    steps: Annotated[int, typer.Option(min=2, max=5001, help='Cells along each axis.')] = 361,
    from_bag: Annotated[
        list[Path] | None, typer.Option(help='Recorded run to draw over the map; may be split.')
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Draw a map over two joints: torque, tilt left, payload or pull; at rest, on rigid ground.

    \b
    Examples:
      ugv-acceptance map torque
      ugv-acceptance map rollover --orientation right --posture flipper_joint=180deg
      ugv-acceptance map payload --limit elbow_joint=70 --out payload.png
      ugv-acceptance map rollover --x flipper_joint=0deg:180deg --out tip.csv
      ugv-acceptance map rollover --from-bag bags/packbot_pass
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from rich.markup import escape

    from ugv_acceptance.bag.atomic_files import whole
    from ugv_acceptance.bag.recording import open_recording
    from ugv_acceptance.cli import output_kinds as kinds
    from ugv_acceptance.cli.map_scene import Wanted, scene_from, with_levels
    from ugv_acceptance.cli.robot_description import payload_doubts, warn
    from ugv_acceptance.cli.terminal_output import result_console, say, wrote
    from ugv_acceptance.config import load
    from ugv_acceptance.offline.own_robot import robot_of
    from ugv_acceptance.report.map_data import map_of
    from ugv_acceptance.report.map_figure import assumptions, write_map
    from ugv_acceptance.studies.maps import CLASSES, area_fraction, classes

    loaded = robot_of(open_recording(from_bag), config) if from_bag else load(config)
    paths = out or [Path(f'{kind}_map.svg')]
    outputs = [Output('--out', path, kinds.MAP) for path in paths]
    check_outputs(outputs, inputs_of(loaded, from_bag or ()), overwrite=overwrite)
    wanted = Wanted(x, y, posture, orientation, slope, payload, limit, friction, steps)
    scene = scene_from(loaded, wanted)
    data = with_levels(map_of(kind, scene), caution, failure)
    warn(payload_doubts(scene.robot, payload))
    track = _track(loaded, scene, from_bag) if from_bag else None
    console = result_console(*paths)
    say(console, escape(f'{scene.robot.name}: {data.what}; {assumptions(scene, kind)}'))
    found = classes(data.margin, data.levels.caution, data.levels.failure)
    for k, name in enumerate(CLASSES):
        share = 100.0 * area_fraction(found == k, scene.grid)
        console.print(f'  {name:8}{share:6.1f} % of the map')
    for path in paths:
        with whole(path) as file:
            write_map(file, path.suffix.lower(), scene, data, track)
        wrote(path)


def _track(loaded: 'Config', scene: 'Scene', paths: list[Path]) -> 'Floats':
    """Return the path of a recorded run: positions (n, 2) of the two joints (rad, m)."""
    import numpy as np

    from ugv_acceptance import BadBag
    from ugv_acceptance.offline.evaluate import evaluate
    from ugv_acceptance.offline.judge import Options

    parts: list[Floats] = []
    take = Options(takers=(lambda rows: parts.append(rows.q),))
    evaluate(paths, config=loaded, options=take)
    track = np.concatenate(parts)[:, [scene.grid.first, scene.grid.second]]
    track = track[np.isfinite(track).all(axis=1)]
    if not len(track):
        raise BadBag(f'{paths[0]}: expected positions of both joints of the map, found none')
    return track[:: max(1, len(track) // 20_000)]
