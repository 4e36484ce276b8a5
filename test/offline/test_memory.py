"""What judging a recording keeps in memory."""

import subprocess
import sys
from pathlib import Path

WASTE = """
import gc, sys
from types import FunctionType
import numpy as np
from ugv_acceptance import evaluate
evaluate(sys.argv[1])
gc.collect()
gc.disable()
gc.set_debug(gc.DEBUG_SAVEALL)
evaluate(sys.argv[1])
gc.collect()
print(any(isinstance(held, np.ndarray) for held in gc.get_referents(*gc.garbage)))
print({f'{f.__module__}.{f.__qualname__}' for f in gc.garbage if isinstance(f, FunctionType)})
"""


def test_arrays_are_freed_at_once(repository: Path) -> None:
    """No array waits in a cycle for the garbage collector, which may let it wait for minutes."""
    done = subprocess.run(
        [sys.executable, '-c', WASTE, repository / 'bags' / 'packbot_fail'],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines() == ['False', 'set()']
