"""Acceptance of unmanned ground vehicles: torque and tip-over margins, live and from bags."""

__version__ = '0.1.0'


class AcceptanceError(Exception):
    """An error a user can act on: says where, what was expected and what came."""


class BadConfig(AcceptanceError):
    """A robot description or configuration that cannot be used."""


class BadBag(AcceptanceError):
    """A recording that cannot be read."""


class BadSample(AcceptanceError):
    """A message whose content cannot be used."""
