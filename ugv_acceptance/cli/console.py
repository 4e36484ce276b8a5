"""`ugv-acceptance console [BAG]`: serves the operator's page, of a recording or a live robot."""

from typing import Annotated

import typer

from ugv_acceptance.cli.options import CONTEXT
from ugv_acceptance.cli.watch import Recording, RobotFile, Urdf, feed_of, need

__all__ = ['CONTEXT', 'console']

PORT = 8770


def console(
    context: typer.Context,
    bag: Recording = None,
    config: RobotFile = None,
    urdf: Urdf = None,
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
    need('starlette', 'uvicorn', 'websockets')
    from ugv_acceptance.console.hub import Hub
    from ugv_acceptance.console.security import check_address
    from ugv_acceptance.console.server import serve

    # A launch file's default is empty.
    token = token or None
    check_address(host, token)
    with feed_of(context, bag, config, urdf) as (feed, asked):
        serve(Hub(feed), host, port, token, lambda at: _announce(at, token), asked)


def _announce(address: str, token: str | None) -> None:
    typer.echo(f'Console on {address}{f"#{token}" if token else ""} (Ctrl-C ends)')
