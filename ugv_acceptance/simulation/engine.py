"""Imports MuJoCo; AcceptanceError says how to install it where it is missing."""

import os

from ugv_acceptance import AcceptanceError, pip_install

# Nothing is drawn here. MuJoCo's window library would ask a process of its own for its version as
# it is imported, and a command that is ended just then would leave that one's traceback.
os.environ.setdefault('MUJOCO_GL', 'disable')
try:
    import mujoco
except ImportError as error:
    raise AcceptanceError(
        f'no simulation: expected MuJoCo ({pip_install("sim")}), got: {error}'
    ) from None

__all__ = ['mujoco']
