"""`ugv-acceptance foxglove`: serves the live topics to Foxglove and Lichtblick, read only."""

from typing import Annotated

import typer

from ugv_acceptance.cli.options import CONTEXT, ros_arguments

__all__ = ['CONTEXT', 'foxglove']


def foxglove(
    context: typer.Context,
    port: Annotated[int, typer.Option(help='Port on 127.0.0.1; 0 takes a free one.')] = 8765,
) -> None:
    """Show the live topics in Foxglove or Lichtblick on this machine (needs foxglove-sdk).

    Read only: nothing can be published, set or called. Open ws://localhost:8765 there, with the
    layout layouts/foxglove.json; of a robot over SSH: ssh -L 8765:localhost:8765 robot
    ugv-acceptance foxglove. Ctrl-C ends.

    \b
    Examples:
      ugv-acceptance foxglove
      ugv-acceptance foxglove --port 0 --ros-args -r __ns:=/robot1
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.nodes.executor import end, ros, spin
    from ugv_acceptance.nodes.foxglove_bridge import Bridge

    with ros(ros_arguments(context)) as stop:
        bridge = Bridge(port)
        typer.echo(f'Foxglove WebSocket on ws://127.0.0.1:{bridge.port} (Ctrl-C ends)')
        spin(bridge, stop)
        end(bridge)
