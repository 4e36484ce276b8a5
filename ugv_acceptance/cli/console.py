"""`ugv-acceptance console [BAG]`: the operator's page, of a recording or of the live robot."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ugv_acceptance.cli.ros_arguments import CONTEXT, ros_arguments

if TYPE_CHECKING:
    from ugv_acceptance.console.feed import Feed

__all__ = ['CONTEXT', 'console']

PORT = 8770


def console(
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
    host: Annotated[
        str, typer.Option(help='Address to listen on; others than 127.0.0.1 need a token.')
    ] = '127.0.0.1',
    port: Annotated[int, typer.Option(help='Port; 0 takes a free one.')] = PORT,
    token: Annotated[
        str | None, typer.Option(help='Word that a browser must bring: http://.../#WORD')
    ] = None,
) -> None:
    """Show margins, alerts and the safe map in a browser. Ctrl-C ends.

    \b
    Examples:
      ugv-acceptance console bags/packbot_fail
      ugv-acceptance console
      ugv-acceptance console --host 0.0.0.0 --token some-long-word
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.config import load
    from ugv_acceptance.console.security import check_address

    # Where no bag is given, click takes --ros-args for it.
    if bag is not None and str(bag) == '--ros-args':
        context.args, bag = [str(bag), *context.args], None
    ros = ros_arguments(context)
    check_address(host, token)
    loaded = load(config, urdf=urdf)

    def show(feed: 'Feed') -> None:
        from ugv_acceptance.console.hub import Hub
        from ugv_acceptance.console.server import serve

        serve(Hub(feed), host, port, token, lambda at: _announce(at, token))

    if bag is None:
        from ugv_acceptance.nodes.console import live_feed

        with live_feed(loaded, ros) as feed:
            show(feed)
        return
    from ugv_acceptance.cli.watch import recording_feed

    show(recording_feed(bag, loaded))


def _announce(address: str, token: str | None) -> None:
    typer.echo(f'Console on {address}{f"#{token}" if token else ""} (Ctrl-C ends)')
