"""`ugv-acceptance replay`: publishes a recording on its topics."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance.cli.options import CONTEXT, ros_arguments

if TYPE_CHECKING:
    from ugv_acceptance.nodes.bag_player import Player
    from ugv_acceptance.nodes.executor import Stop

__all__ = ['CONTEXT', 'replay']


def replay(
    context: typer.Context,
    bag: Annotated[Path, typer.Argument(help='rosbag2 folder, .mcap, .db3 or ROS 1 .bag file')],
    rate: Annotated[float, typer.Option(help='Speed, as a multiple of real time.')] = 1.0,
    loop: Annotated[bool, typer.Option('--loop', help='Start again at the end.')] = False,
    topics: Annotated[
        list[str] | None, typer.Option(help='A topic to play; may be given several times.')
    ] = None,
    clock: Annotated[
        bool,
        typer.Option('--clock', help='Publish the time of the recording on /clock.'),
    ] = False,
    restamp: Annotated[
        bool | None,
        typer.Option(
            '--restamp/--no-restamp',
            help='Move header stamps to the time of replay, or leave them as recorded. '
            'Moved by default, but not with --clock.',
            show_default=False,
        ),
    ] = None,
) -> None:
    """Publish a recording with its timing and quality of service, for a live monitor to watch.

    A live monitor compares header stamps with its clock, so they move to the time of replay, those
    of a simulation too; at --rate 2 they advance as fast as real time does. All else is published
    byte for byte. With --clock, set use_sim_time in the monitor: stamps then stay as recorded.

    \b
    Examples:
      ugv-acceptance replay bags/packbot_fail
      ugv-acceptance replay run_0.mcap --rate 2 --topics /imu/data
      ugv-acceptance replay run --clock --loop --ros-args -r __ns:=/robot1
      ugv-acceptance replay run --no-restamp
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.nodes.bag_player import Play, player_of
    from ugv_acceptance.nodes.executor import end, ros

    anew = not clock if restamp is None else restamp
    play = Play(bag, rate, loop, tuple(topics or ()), clock, anew)
    with ros(ros_arguments(context)) as stop:
        player = player_of(play)
        for topic, reason in player.skipped.items():
            typer.echo(f'{topic} is not played: {reason}', err=True)
        player.wait_for_subscribers(stop)
        _play(player, stop)
        end(player.node)
    typer.echo(f'{player.published} messages of {len(player.publishers)} topics published')


def _play(player: 'Player', stop: 'Stop') -> None:
    from ugv_acceptance.cli.terminal_output import progress

    with progress('playing', player.bag.duration_s) as reached:
        player.run(stop, lambda seconds: reached(seconds, ''))
