"""Options that several verbs share, and the arguments after --ros-args."""

import typer

# For the verbs that run nodes: what typer does not know is kept for ROS.
CONTEXT = {'allow_extra_args': True, 'ignore_unknown_options': True}


def ros_arguments(context: typer.Context) -> list[str]:
    """Return the arguments for ROS; a usage error for any that is not after --ros-args."""
    if context.args and context.args[0] != '--ros-args':
        raise typer.BadParameter(
            f'got {context.args[0]!r}, which is no option; what is for ROS stands behind --ros-args'
        )
    return list(context.args)
