"""`ugv-acceptance info`: what is in a recording, does it fit, what could be judged."""

from pathlib import Path
from typing import Annotated

import typer

from ugv_acceptance.cli.completion import recordings_like
from ugv_acceptance.cli.options import ConfigFile, Overwrite, UrdfFile, Verbose, dash

FITS, DOES_NOT = 0, 1


def info(
    bags: Annotated[
        list[Path],
        typer.Argument(
            help='A rosbag2 folder, .mcap, .db3 or ROS 1 .bag file; or the parts of a split one.',
            autocompletion=recordings_like,
        ),
    ],
    config: ConfigFile = None,
    urdf: UrdfFile = None,
    json_file: Annotated[
        Path | None,
        typer.Option('--json', callback=dash, help='Write all of it to this file; -: print it.'),
    ] = None,
    everything: Annotated[
        bool, typer.Option('--all', help='Read a long recording to its end, not its beginning.')
    ] = False,
    verbose: Verbose = False,
    overwrite: Overwrite = False,
) -> None:
    """Show what is in a recording, whether it fits the configuration, and what could be judged.

    It takes a moment, also of a large recording: its index is read, and its beginning is judged to
    see what is missing. The exit code is 0 if a verdict can be reached, 1 if not, 2 if it cannot
    be read.

    \b
    Examples:
      ugv-acceptance info bags/packbot_pass
      ugv-acceptance info run_0.mcap run_1.mcap -c robot.yaml -v
      ugv-acceptance info run --all --json info.json
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.bag.atomic_files import write_json
    from ugv_acceptance.bag.recording import open_recording
    from ugv_acceptance.cli import output_kinds as kinds
    from ugv_acceptance.cli.info_page import print_info
    from ugv_acceptance.cli.outputs import Output, check_outputs, inputs_of
    from ugv_acceptance.cli.terminal_output import progress, result_console, while_read, wrote
    from ugv_acceptance.config import description_topic, load
    from ugv_acceptance.config.files import find
    from ugv_acceptance.inspection.info import info_of

    told_by_robot = description_topic(config, urdf=urdf) is not None
    robot = find(config) if config and told_by_robot else load(config, urdf=urdf)
    output = Output('--json', json_file, kinds.INFO)
    check_outputs([output], inputs_of(robot, bags), overwrite=overwrite)
    recording = open_recording(list(bags))
    with progress('reading', 100.0, '%') as reached:
        told = info_of(
            recording,
            config,
            urdf=urdf,
            everything=everything,
            reached=lambda share: reached(100.0 * share, ''),
        )
    if json_file is not None:
        write_json(json_file, told)
    with while_read():
        print_info(told, bags, result_console(json_file), verbose=verbose)
    wrote(json_file)
    raise typer.Exit(FITS if told['can_be_judged'] else DOES_NOT)
