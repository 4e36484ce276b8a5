"""The monitor of bench_soak.py: the real one, and a thread that says how many objects it holds.

It is started with a file and ROS arguments. The file gets the number of Python's allocated blocks
of memory, anew every few seconds.
"""

import sys
import time
from pathlib import Path
from threading import Thread

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from ugv_acceptance.nodes.monitor.node import main

EVERY = 5.0  # s


def count(path: Path) -> None:
    """Write the number of blocks for as long as the process lives."""
    while True:
        path.write_text(str(sys.getallocatedblocks()), encoding='ascii')
        time.sleep(EVERY)


Thread(target=count, args=(Path(sys.argv[1]),), daemon=True).start()
main(sys.argv[2:])
