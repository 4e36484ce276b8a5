"""Runs a node in a subprocess that ends with its parent, even if the parent is killed.

`python -m ugv_acceptance.nodes.subprocess_node packbot_simulator --ros-args ...`; its input is the
parent's pipe.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module

# Seconds to end by itself before it is killed.
PATIENCE = 5.0


@contextmanager
def child(
    module: str, ros_args: list[str], environment: Mapping[str, str] | None = None
) -> Iterator['subprocess.Popen[bytes]']:
    """Run the node of ugv_acceptance.nodes.MODULE in a process until the block is left.

    It has a session of its own: Ctrl-C reaches only this process, which ends the node.
    """
    # The ROS wheels set this for their own children, whom it makes load the wrong libraries.
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    command = [sys.executable, '-m', 'ugv_acceptance.nodes.subprocess_node', module, *ros_args]
    process = subprocess.Popen(  # noqa: S603 - our own module
        command, stdin=subprocess.PIPE, env={**env, **(environment or {})}, start_new_session=True
    )
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def end_with_parent() -> None:
    """Make this process end as soon as its input, the parent's pipe, is closed."""
    threading.Thread(target=_wait_for_the_end, daemon=True).start()


def _wait_for_the_end() -> None:
    # Not sys.stdin: its lock would be held when the interpreter ends.
    while os.read(0, 1024):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def main() -> None:
    """Run the node that the first argument names."""
    end_with_parent()
    import_module(f'ugv_acceptance.nodes.{sys.argv[1]}').main(sys.argv[2:])


if __name__ == '__main__':
    main()
