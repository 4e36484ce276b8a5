"""Parses the faults of a simulated robot as they are written on a command line.

A fault is written KIND[:SUBJECT][=AMOUNT][@START[-END]]: frozen-encoder:shoulder_joint@5-9,
imu-bias=2, dropped:imu=0.3, wrong-mounting=30deg. Times in seconds; without them it lasts the
whole run.
"""

import math
import re

from ugv_acceptance import BadConfig
from ugv_acceptance.config import quantity
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.simulation.faults import INPUTS, KINDS, PHYSICAL, Fault, Kind

_FORM = re.compile(
    r'(?P<kind>[a-z-]+)(:(?P<subject>[^=@]+))?(=(?P<amount>[^@]+))?'
    r'(@(?P<start>[.\d]+)(-(?P<end>[.\d]+))?)?'
)


def fault_from(text: str, robot: Robot) -> Fault:
    """Return the fault that a text describes. Raises BadConfig with what was expected."""
    match = _FORM.fullmatch(text)
    if match is None:
        raise BadConfig(f'fault {text!r}: expected KIND[:SUBJECT][=AMOUNT][@START[-END]]')
    name, subject = match['kind'], match['subject'] or ''
    kind = KINDS.get(name)
    if kind is None:
        raise BadConfig(f'fault {text!r}: expected one of {", ".join(KINDS)}, got {name}')
    allowed = {'joint': robot.joint_names, 'input': INPUTS}.get(kind.subject, ())
    if subject not in ('', *allowed) or (kind.subject == 'joint' and not subject):
        expected = ', '.join(allowed) or 'no subject'
        raise BadConfig(f'fault {text!r}: expected {expected} after the colon, got {subject!r}')
    amount = _amount(text, match['amount'], kind)
    if not kind.low <= amount <= kind.high:
        raise BadConfig(
            f'fault {text!r}: expected an amount from {kind.low:g} to {kind.high:g}, got {amount:g}'
        )
    start, end = _number(text, match['start'], 0.0), _number(text, match['end'], math.inf)
    if not start < end:
        raise BadConfig(f'fault {text!r}: expected an end after the start, got {start:g}-{end:g}')
    if name in PHYSICAL and match['start']:
        raise BadConfig(f'fault {text!r}: expected no times: {name} lasts the whole run')
    return Fault(name, subject, amount, start, end)


def _number(text: str, part: str | None, default: float) -> float:
    try:
        return default if part is None else float(part)
    except ValueError:
        raise BadConfig(f'fault {text!r}: expected a number, got {part!r}') from None


def _amount(text: str, part: str | None, kind: Kind) -> float:
    """Return the amount of a fault as a number; an angle in degrees. Raises BadConfig."""
    if part is None or not kind.angle:
        return _number(text, part, kind.amount)
    return math.degrees(quantity(part, 'angle', f'fault {text!r}'))
