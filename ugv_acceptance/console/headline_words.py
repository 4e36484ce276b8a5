"""The words of the headline for one alert: what it is about, how much, and what to do."""

import math
import re

from ugv_acceptance.console.alert_cards import name_words
from ugv_acceptance.console.snapshot import AlertRow, Snapshot
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.state_machine import ERROR
from ugv_acceptance.evaluation.least_margins import least_tilt
from ugv_acceptance.evaluation.margin_words import degrees_words, share_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES

# What an alert is called in the headline, where its side, joint or input stands as {name}.
WHATS = {
    'TIP_TREND': 'BEGINS TO TIP {name}',
    'TORQUE_LIMIT': '{name} NEAR ITS LIMIT',
    'ACCELERATION': 'TOO HARD: TIPS {name}',
    'TRACK_LIFT': 'ROCKING TO THE {name}',
    'NO_SUPPORT': 'IT DOES NOT STAND',
    'ARM_ON_GROUND': 'ARM ON THE GROUND',
    'STATIC_MODEL': '{name} TOO FAST',
    'SLIDE': 'CLOSE TO SLIDING',
    'TORQUE_AHEAD': '{name} SOON AT ITS LIMIT',
    'EFFORT_LIMIT': '{name}: MOTOR NEAR ITS LIMIT',
    'MOTOR_WEAK': '{name}: MOTOR WEAK',
    'ENCODER_FROZEN': '{name}: POSITION STUCK',
    'POSITION_LEAP': '{name}: POSITION JUMPS',
    'INPUT_STALE': '{name}: NO MESSAGE',
    'INPUT_SLOW': '{name}: SLOW',
    'INPUT_INCOMPLETE': '{name}: INCOMPLETE',
    'INPUT_INVALID': '{name}: NOT USABLE',
    'INPUT_MALFORMED': '{name}: NOT READABLE',
    'INPUT_QOS': '{name}: NOT RECEIVED',
    'MESSAGES_LOST': '{name}: MESSAGES LOST',
    'JOINTS_REPEATED': '{name}: OLD POSITIONS',
    'CLOCK': '{name}: CLOCK OFF',
    'NO_CLOCK': 'NO CLOCK',
    'IMU_ORIENTATION': 'IMU: ORIENTATION WRONG',
    'IMU_RATES': 'IMU: RATES WRONG',
    'IMU_NO_GRAVITY': 'IMU: TILT NOT KNOWN',
    'IMU_MOUNTING_UNKNOWN': 'IMU: MOUNTING NOT KNOWN',
    'PAYLOAD_INVALID': 'LOAD NOT USABLE',
    'PAYLOAD_DIFFERS': 'OTHER LOAD THAN DECLARED',
    'LIMITS_RELAXED': 'LIMIT RELAXED: {name}',
    'SECOND_PUBLISHER': '{name}: TWO PUBLISHERS',
    'FOREIGN_PUBLISHER': '{name}: FOREIGN PUBLISHER',
    'FOREIGN_OPERATOR': 'COMMAND REFUSED',
    'CONFIG_DIFFERS': 'NOT THE CONFIGURED ROBOT',
    'EFFORT_SIGN': '{name}: SIGN OF EFFORT',
    'MARGIN_UNCERTAIN': '{name}: TOO CLOSE TO TELL',
    'MONITOR_FAULT': 'FAULT OF THE MONITOR',
}
# Alerts about the tilt left to a side, and about the share of a joint's limit.
TIPS = frozenset({'TIP_OVER', 'TIP_AHEAD', 'TIP_MOVING', 'TIP_TREND'})
SHARES = frozenset({'TORQUE_LIMIT', 'TORQUE_AHEAD', 'MARGIN_UNCERTAIN'})
# Any other alert about the IMU.
_IMU_WHAT = 'IMU NOT TO BE TRUSTED'
# Alerts that no operator can mend: STOP where they are dangers, else the integrator is told.
FOR_INTEGRATOR = frozenset({
    'ENCODER_FROZEN', 'POSITION_LEAP', 'INPUT_STALE', 'INPUT_SLOW', 'INPUT_INCOMPLETE',
    'INPUT_INVALID', 'INPUT_MALFORMED', 'INPUT_QOS', 'MESSAGES_LOST', 'JOINTS_REPEATED', 'CLOCK',
    'NO_CLOCK', 'SECOND_PUBLISHER', 'FOREIGN_PUBLISHER', 'CONFIG_DIFFERS', 'EFFORT_SIGN',
    'MONITOR_FAULT',
})  # fmt: skip
# Other alerts about what margins are computed from: while they last, margins may not be known.
BLINDING = frozenset({'PAYLOAD_INVALID', 'ARM_ON_GROUND'})
# Advice that a model worked out: "lower the elbow by 16 deg: ...", "swing it by 5 deg back: ...".
_AMOUNT = re.compile(r'(?P<do>[^:;,]*?) (?P<by>by [\d.]+ \w+)(?P<way>[^:;,]*)(?P<rest>.*)')
_CLAUSE = re.compile(r'(?P<do>[^:;,]*)')
# What the advice after a fall begins with: the headline says it already.
_TIPPED = STAND_CLEAR.partition('stand')[0]
# The side in the text of an alert that is about the robot.
_SIDE = re.compile(rf'(?:to the|:) ({"|".join(SIDES)})\b', re.IGNORECASE)


def blinds(row: AlertRow) -> bool:
    """Return whether an alert is about what margins are computed from."""
    return for_integrator(row) or row.code in BLINDING


def for_integrator(row: AlertRow) -> bool:
    """Return whether an alert is one that no operator can mend."""
    return row.code in FOR_INTEGRATOR or row.code.startswith('IMU_')


def what_of(row: AlertRow, snapshot: Snapshot, settings: Settings) -> tuple[str, str]:
    """Return what an active alert is about, in capitals, and its number now ('': it has none)."""
    if row.code in TIPS or (row.code == 'MARGIN_UNCERTAIN' and row.subject in SIDES):
        return _tipping(row, snapshot)
    default = _IMU_WHAT if row.code.startswith('IMU_') else row.code.replace('_', ' ')
    what, number = WHATS.get(row.code, default), ''
    if row.code in SHARES:
        share = _share(row.subject, snapshot, settings)
        number = share_words(share) if math.isfinite(share) else ''
        what = what.replace(' NEAR ', ' AT ') if share >= 1.0 else what
    return what.format(name=name_words(row.subject).upper()), number


def _tipping(row: AlertRow, snapshot: Snapshot) -> tuple[str, str]:
    """Return that a robot comes near to tipping or tips, to which side, and the tilt left now."""
    side = _side_of(row, snapshot)
    angle = float(snapshot.angle[SIDES.index(side)]) if side else math.nan
    words = degrees_words(angle)
    number = '' if words == '-' else '<= ' * snapshot.rough + words
    name = side.upper()
    if row.code == 'TIP_TREND':
        return WHATS[row.code].format(name=name).rstrip(), number
    past = angle <= 0.0 or (row.code == 'TIP_MOVING' and row.level == ERROR)
    return f'TIPPING {name}' if past else f'TO TIPPING: {name}', number


def _side_of(row: AlertRow, snapshot: Snapshot) -> str:
    """Return the side an alert is about: its subject, that in its text, or that of least tilt."""
    if row.subject in SIDES:
        return row.subject
    named = {side.lower() for side in _SIDE.findall(row.text)}
    return named.pop() if len(named) == 1 else least_tilt(snapshot.angle)[0]


def _share(joint: str, snapshot: Snapshot, settings: Settings) -> float:
    names = settings.robot.joint_names
    if joint not in names or not snapshot.torque:
        return math.nan
    at = names.index(joint)
    return abs(snapshot.torque[at]) / settings.limits.torque[at]


def order_of(advice: str) -> tuple[str, str]:
    """Return what to do in a few capitals, and the rest of the sentence as it is.

    "lower the elbow by 16 deg: 11 deg further from tipping" is LOWER THE ELBOW; by 16 deg: 11 ...
    """
    found = _AMOUNT.fullmatch(advice)
    if found:
        return (found['do'] + found['way']).upper(), found['by'] + found['rest']
    advice = advice.removeprefix(_TIPPED)
    clause = _CLAUSE.match(advice)
    do = clause['do'] if clause else ''
    return do.strip().upper(), advice[len(do) :].lstrip(':;, ')
