"""`ugv-acceptance watch [BAG]`: the console in a terminal, such as over SSH."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance.cli.ros_arguments import CONTEXT, ros_arguments

if TYPE_CHECKING:
    from ugv_acceptance.config import Config
    from ugv_acceptance.console.recording import RecordingFeed

__all__ = ['CONTEXT', 'watch']


def watch(
    context: typer.Context,
    bag: Annotated[
        Path | None, typer.Argument(help='Recording to show; without one, the live robot.')
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option('--config', '-c', help='YAML file, or the name of one that ships: packbot.'),
    ] = None,
    urdf: Annotated[
        Path | None, typer.Option(help='URDF in place of the one the YAML names.')
    ] = None,
) -> None:
    """Show verdict, alerts and margins in the terminal, in the words of the console. q leaves.

    \b
    Examples:
      ugv-acceptance watch
      ugv-acceptance watch bags/packbot_fail
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    # Where no bag is given, click takes --ros-args for it.
    if bag is not None and str(bag) == '--ros-args':
        context.args, bag = [str(bag), *context.args], None
    ros = ros_arguments(context)
    from ugv_acceptance.config import load
    from ugv_acceptance.console.terminal import Terminal

    loaded = load(config, urdf=urdf)
    if bag is not None:
        Terminal(recording_feed(bag, loaded)).run()
        return
    from ugv_acceptance.nodes.console import live_feed

    with live_feed(loaded, ros) as feed:
        Terminal(feed).run()


def recording_feed(bag: Path, config: 'Config') -> 'RecordingFeed':
    """Return a recording, judged, as a feed."""
    from ugv_acceptance.bag.reader import choose_topics, open_bag
    from ugv_acceptance.console.recording import RecordingFeed, judge_for_console

    opened, names = open_bag(bag), config.topics
    topics = choose_topics(opened, names.joint_states.name, names.imu.name, names.payload.name)
    return RecordingFeed(judge_for_console(opened, topics, config.settings))
