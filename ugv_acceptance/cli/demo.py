"""`ugv-acceptance demo`: a recorded run through real DDS into the monitor, then its verdict."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    bag: Annotated[
        Path | None, typer.Option(help='Recording to play; packbot_fail, which ships, by default.')
    ] = None,
    rate: Annotated[float, typer.Option(help='Speed, as a multiple of real time.')] = 1.0,
    console: Annotated[
        bool, typer.Option(help='Serve the page as well, on a free port of this machine.')
    ] = True,
) -> None:
    """Play a recorded run into the live monitor, then evaluate the same recording.

    The address of the console is printed first: open it to see the run as an operator does. All
    runs on its own ROS domain of this machine. The exit code is 0 if everything worked; the run
    that ships fails on purpose, so that there is something to see.

    \b
    Examples:
      ugv-acceptance demo
      ugv-acceptance demo --bag bags/packbot_pass --rate 2 --no-console
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.demonstration import demonstrate

    raise typer.Exit(demonstrate(bag, rate, page=console))
