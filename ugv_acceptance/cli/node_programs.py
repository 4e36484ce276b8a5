"""The programs that `ros2 run` and launch files start: nodes that Ctrl-C may end at any point.

What a node needs takes seconds to import on a robot's computer. A signal that comes meanwhile ends
the program without a traceback, as it ends a verb; later the node's own handling counts.
"""

import gc
from importlib import import_module

from ugv_acceptance.cli import COLLECT_SELDOM
from ugv_acceptance.cli.termination import ended_by_signals

# The module of each program.
MODULES = {
    'acceptance_monitor': 'ugv_acceptance.nodes.monitor.node',
    'bag_player': 'ugv_acceptance.nodes.bag_player',
    'packbot_simulator': 'ugv_acceptance.nodes.packbot_simulator',
}


def acceptance_monitor() -> None:
    """Run the monitor until it is interrupted; exit code 2 where the configuration is bad."""
    _run('acceptance_monitor')


def bag_player() -> None:
    """Play a recording until its end or an interrupt; exit code 2 for bad input."""
    _run('bag_player')


def packbot_simulator() -> None:
    """Run the simulated robot until it is interrupted; exit code 2 where a file is bad."""
    _run('packbot_simulator')


def _run(program: str) -> None:
    gc.set_threshold(COLLECT_SELDOM)
    with ended_by_signals() as told:
        try:
            main = import_module(MODULES[program]).main
        except Exception:
            # A library being imported may turn the signal into an error of its own.
            if told():
                raise SystemExit(told()) from None
            raise
        main()
