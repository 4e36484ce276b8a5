"""The permitted ranges of limits, delays and thresholds, and which values are relaxed beyond them.

A value outside its range would disable a rule: it is refused, in a file and as a parameter alike,
unless a reason is given (`unsafe_limits`). Then it is accepted, and reported as long as it is in
force.
"""

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass

from ugv_acceptance.evaluation.settings import Settings

# The unit a value is shown in -> its size in SI.
UNITS = {'deg': math.pi / 180.0}
# Rounding of a unit's conversion, as a share of the bound.
SLACK = 1e-9
# Most characters of a reason, because every verdict repeats it.
LONGEST_REASON = 200
UNSAFE = 'unsafe_limits'


@dataclass(frozen=True, slots=True)
class Permitted:
    """The permitted range of one setting: `least` to `most`, with a reason `floor` to `ceiling`.

    In `unit` ('': none). `part` and `key` are its fields in Settings, `name` its ROS parameter,
    `path` its keys in a file. `live`: it can be set while the monitor runs; `what` describes it.
    """

    part: str
    key: str
    unit: str
    least: float
    most: float
    floor: float
    ceiling: float
    what: str
    live: bool = True
    written: tuple[str, ...] = ()

    @property
    def path(self) -> tuple[str, ...]:
        """Its keys in a YAML file, without the unit."""
        return self.written or (self.part, self.key)

    @property
    def name(self) -> str:
        """Its name as a parameter: the keys of the file with the unit."""
        return '.'.join(self.path) + (f'_{self.unit}' if self.unit else '')

    @property
    def factor(self) -> float:
        """Factor that converts a value from `unit` to SI."""
        return UNITS.get(self.unit, 1.0)

    @property
    def words(self) -> str:
        """The permitted range in words, for error messages."""
        return (
            f'{self.least:g} to {self.most:g}, or with {UNSAFE} and a reason '
            f'{self.floor:g} to {self.ceiling:g}'
        )

    def value(self, settings: Settings) -> float:
        """Return the value of this setting in `settings`, in `unit`."""
        return float(getattr(getattr(settings, self.part), self.key)) / self.factor


# Part, key, unit, least, most, floor, ceiling, what. One end of a range is where a rule would never
# raise an alert (or, for a deadband, never end one); the other end excludes mistakes.
_LIVE = (
    ('limits', 'torque_warn', '', 0.01, 1.0, 0.01, 10.0, 'share of the limit for CAUTION'),
    ('limits', 'torque_error', '', 0.01, 1.0, 0.01, 10.0, 'share of the limit for DANGER'),
    ('limits', 'torque_deadband', 'nm', 0.0, 1e3, 0.0, 1e6, 'torque below it that clears, N m'),
    ('limits', 'tip_warn', 'deg', 0.0, 90.0, -90.0, 90.0, 'tilt left for CAUTION, deg'),
    ('limits', 'tip_error', 'deg', 0.0, 90.0, -90.0, 90.0, 'tilt left for DANGER, deg'),
    ('limits', 'tip_deadband', 'deg', 0.0, 10.0, 0.0, 90.0, 'tilt above it that clears, deg'),
    ('delays', 'tip_on', 's', 0.0, 5.0, 0.0, 60.0, 'how long before a tip-over alert, s'),
    ('delays', 'torque_on', 's', 0.0, 5.0, 0.0, 60.0, 'how long before a torque alert, s'),
    ('delays', 'fault_on', 's', 0.0, 5.0, 0.0, 60.0, 'how long before an input alert, s'),
    ('delays', 'off', 's', 0.0, 60.0, 0.0, 3600.0, 'how long good before an alert clears, s'),
    ('delays', 'tip_off', 's', 0.0, 60.0, 0.0, 3600.0, 'the same of a tip-over alert, s'),
    ('delays', 'stale_after', 's', 0.001, 2.0, 0.001, 60.0, 'shortest silence that is stale, s'),
    ('delays', 'stale_periods', '', 1.0, 100.0, 1.0, 1000.0, 'own periods of silence, stale'),
    ('imu', 'agreement', 'deg', 0.1, 10.0, 0.1, 180.0, 'orientation may differ from gravity, deg'),
)
_AT_REST = (
    ('limits', 'friction', '', 0.01, 2.0, 0.01, 10.0, 'friction on the ground'),
    ('delays', 'tick', 's', 0.001, 1.0, 0.001, 60.0, 'how often silence is judged, s'),
    ('imu', 'agreement_delay', 's', 0.0, 5.0, 0.0, 60.0, 'how long they may differ, s'),
    ('imu', 'low_pass', 's', 1e-4, 2.0, 1e-4, 60.0, 'time constant of the filter, s'),
    ('imu', 'rest_acceleration', 'mps2', 0.05, 5.0, 1e-3, 100.0, 'what counts as rest'),
    ('imu', 'rest_rate', 'radps', 0.005, 1.0, 1e-4, 100.0, 'what counts as rest'),
    ('robot', 'contact_tolerance', 'm', 1e-9, 0.05, 1e-9, 1.0, 'how near the ground is on it'),
    ('robot', 'gravity', 'mps2', 9.7, 9.9, 0.01, 100.0, 'gravity, m/s2'),
)
# Settings whose keys in a file differ from their fields.
_WRITTEN = {'contact_tolerance': ('ground', 'tolerance'), 'gravity': ('gravity',)}
RANGES = (
    *(Permitted(*row) for row in _LIVE),
    *(Permitted(*row, live=False, written=_WRITTEN.get(row[1], ())) for row in _AT_REST),
)


@dataclass(frozen=True, slots=True)
class Breach:
    """A value outside its permitted range: parameter name, keys in a file, value, expected range.

    `never`: it is refused even with a reason.
    """

    name: str
    path: tuple[str, ...]
    value: float
    expected: str
    never: bool = False

    @property
    def refusal(self) -> str:
        """Say what was expected and what was given, without the name."""
        return f'expected {self.expected}, got {self.value:g}'

    @property
    def words(self) -> str:
        """Say which value is in force, and which range is permitted."""
        return f'{self.name} is {self.value:g} ({self.expected.partition(",")[0]} is permitted)'


def torque_name(settings: Settings, j: int) -> str:
    """Return the parameter name of joint number j's limit, such as joints.elbow.limit_nm."""
    joint = settings.robot.joint_names[j]
    unit = 'n' if settings.robot.joint(joint).slides else 'nm'
    return f'joints.{joint}.limit_{unit}'


def names_of(settings: Settings) -> tuple[str, ...]:
    """Return the parameter names of all settings with a range, joint limits included."""
    joints = range(len(settings.robot.joint_names))
    return (*(p.name for p in RANGES), *(torque_name(settings, j) for j in joints))


def breaches(settings: Settings) -> Iterator[Breach]:
    """Yield every value that is outside its range, whether there is a reason or not."""
    for of in RANGES:
        value = of.value(settings)
        if of.key == 'friction' and math.isinf(value):  # not known, so not judged
            continue
        if not _within(value, of.least, of.most):
            never = not _within(value, of.floor, of.ceiling)
            yield Breach(of.name, of.path, value, of.words, never)
    rated = settings.limits.rated
    for j, (limit, most) in enumerate(zip(settings.limits.torque, rated, strict=False)):
        if limit > most * (1.0 + SLACK):
            name = torque_name(settings, j)
            expected = f'above 0 to {most:g} as configured, or with {UNSAFE} and a reason any'
            path = ('joints', settings.robot.joint_names[j], 'limit')
            yield Breach(name, path, limit if math.isfinite(limit) else 0.0, expected)


def _within(value: float, least: float, most: float) -> bool:
    return least - SLACK * abs(least) <= value <= most + SLACK * abs(most)


def refused(settings: Settings) -> Breach | None:
    """Return the first value that is refused, None if all are accepted."""
    found = (b for b in breaches(settings) if b.never or not settings.unsafe)
    return next(found, None)


def relaxed(settings: Settings) -> list[Breach]:
    """Return the values outside their range that are in force, which only a reason permits."""
    return list(breaches(settings))


def relaxed_words(settings: Settings) -> str:
    """Return which limits are relaxed and why, as one sentence; '' if none is."""
    found = relaxed(settings)
    if not found:
        return ''
    return f'limits are relaxed ({settings.unsafe}): {", ".join(b.words for b in found)}'


def checked_reason(text: str) -> str:
    """Return a reason for relaxed limits, stripped; ValueError if it is empty or too long."""
    reason = text.strip()
    if not reason or len(reason) > LONGEST_REASON or not reason.isprintable():
        raise ValueError(
            f'expected a reason of 1 to {LONGEST_REASON} letters on one line, '
            f'got {text[:60]!r}{"..." if len(text) > 60 else ""}'
        )
    return reason


def limits_hash(settings: Settings) -> str:
    """Return a hash (16 hex digits) of everything alerts are judged by.

    That is limits, delays, the IMU's thresholds, and the kind of ground where it is not flat.
    Numbers count with nine digits, so that rounding in unit conversions does not change it.
    """
    limits, imu = asdict(settings.limits), asdict(settings.imu)
    names = settings.robot.joint_names
    for key in ('torque', 'speed'):
        limits[key] = dict(zip(names, limits[key] or (math.inf,) * len(names), strict=True))
    # The IMU's place is not a threshold.
    for key in ('mounting', 'position', 'frame', 'placed', 'link', 'transforms'):
        del imu[key]
    del limits['rated']
    told = {'limits': limits, 'delays': asdict(settings.delays), 'imu': imu}
    if settings.ground.rough:  # other alerts are raised there
        told['ground'] = {'kind': settings.ground.taken}
    text = json.dumps(_canonical(told), sort_keys=True, separators=(',', ':'))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _canonical(value: object) -> object:
    if isinstance(value, dict):
        return {key: _canonical(item) for key, item in value.items()}
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return f'{value + 0.0:.9g}'
