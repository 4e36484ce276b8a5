"""Imports MuJoCo; AcceptanceError says how to install it where it is missing."""

from ugv_acceptance import AcceptanceError, pip_install

try:
    import mujoco
except ImportError as error:
    raise AcceptanceError(
        f'no simulation: expected MuJoCo ({pip_install("sim")}), got: {error}'
    ) from None

__all__ = ['mujoco']
