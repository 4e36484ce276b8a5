"""Reads acceptance criteria from a YAML file and validates every key; see docs/criteria.md."""

import hashlib
import math
from collections.abc import Callable
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from ugv_acceptance import BadConfig
from ugv_acceptance.config.build import checked
from ugv_acceptance.config.document import Document, read_document
from ugv_acceptance.config.files import text as text_of
from ugv_acceptance.config.schema import Name, NotNegative, Positive, Reason, Section
from ugv_acceptance.config.units import EXAMPLES, Given, Measure, parse, shown
from ugv_acceptance.evaluation.alerts.messages import RECORDED
from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AcceptedRule,
    AlertDemand,
    CriteriaSet,
    Criterion,
    DataDemand,
    Demand,
    MapDemand,
    Value,
)
from ugv_acceptance.evaluation.criteria.ground_statement import SAFEGUARD as GROUND
from ugv_acceptance.evaluation.criteria.quantities import DATA, INPUTS, SIGNALS, subjects_of
from ugv_acceptance.evaluation.criteria.safeguards import SAFEGUARDS
from ugv_acceptance.evaluation.ground import GroundWindow
from ugv_acceptance.evaluation.settings import ALWAYS, Settings
from ugv_acceptance.model.robot import Joint


def _number(*kinds: str) -> BeforeValidator:
    return BeforeValidator(lambda value: parse(value, kinds).value)


Method = Literal['rss', 'worst_case', 'ignored']
Share = Annotated[float, Field(ge=0, le=1), _number()]
Time = Annotated[NotNegative, _number('time')]


def _limit(value: object) -> Given:
    """Return a limit of any quantity; `_limit_of` checks it against the criterion's signal."""
    return parse(value, tuple(EXAMPLES))


def _window(value: object) -> tuple[float, float]:
    unit = value.unit if isinstance(value, Measure) else None
    items = value.value if isinstance(value, Measure) else value
    if not isinstance(items, list) or len(items) != 2:
        raise ValueError(f'expected a list of two times such as [2, 20], got {shown(items)}')
    start, end = (parse(Measure(x, unit) if unit else x, ('time',)).value for x in items)
    if not 0.0 <= start < end:
        raise ValueError(f'expected a start from 0 on and an end after it, got {shown(items)}')
    return start, end


def _windows(value: object) -> tuple[tuple[float, float], ...]:
    """Return the windows of `hand_may_touch`: true, false, or a list of them."""
    if isinstance(value, bool):
        return ALWAYS if value else ()
    unit = value.unit if isinstance(value, Measure) else None
    items = value.value if isinstance(value, Measure) else value
    if not isinstance(items, list):
        raise ValueError(  # noqa: TRY004 - pydantic reports ValueError only
            f'expected true, or a list of windows such as [[2, 20]], got {shown(items)}'
        )
    return tuple(_window(Measure(item, unit) if unit else item) for item in items)


Limit = Annotated[Given, BeforeValidator(_limit)]
Between = Annotated[tuple[float, float], BeforeValidator(_window)]


class CriterionSection(Section):
    """One criterion: exactly one of value, alert, data and map says what it is about."""

    requirement: str = ''
    reference: str = ''
    between: Between | None = None
    uncertainty: Method | None = None
    value: str | None = None
    alert: str | None = None
    data: str | None = None
    map: list[str] | None = None
    of: str | None = None
    below: Limit | None = None
    above: Limit | None = None
    time_in_violation: Time | None = None
    longest_violation: Time | None = None
    share_in_violation: Share | None = None
    dwell: Annotated[Positive, _number('time')] | None = None
    level: Literal['WARN', 'ERROR', 'STALE'] | None = None
    expect: Literal['raised', 'absent'] | None = None
    at_least: Annotated[float, _number('time')] | None = None
    at_most: Annotated[float, _number('time')] | None = None
    otherwise: Literal['FAIL', 'INCONCLUSIVE'] | None = None
    cell: Annotated[Positive, _number('angle', 'length')] | None = None


class WindowSection(Section):
    """A kind of ground and the times (s) between which a recording was made on it."""

    kind: Literal['flat', 'uneven', 'stairs']
    between: Between


class CriteriaGroundSection(Section):
    """What the ground of the recordings is, and the rule accepted where it is not flat, and why."""

    kind: Literal['flat', 'uneven', 'stairs'] | None = None
    windows: tuple[WindowSection, ...] = ()
    accept: Literal['trend', 'cautious'] | None = None
    reason: Reason | None = None


class CriteriaFile(Section):
    """The keys of a criteria file."""

    version: Literal[1]
    name: Name
    uncertainty: Method = 'rss'
    coverage: Share = 0.95
    waive: dict[str, Reason] = Field(default={})
    ground: CriteriaGroundSection = CriteriaGroundSection()
    hand_may_touch: Annotated[tuple[tuple[float, float], ...], BeforeValidator(_windows)] = ()
    operator_training: Literal['this_robot', 'any_robot'] | None = None
    criteria: dict[str, CriterionSection]


# The keys of each kind of criterion, besides those of every kind.
_KEYS = {
    'value': {
        'of',
        'below',
        'above',
        'time_in_violation',
        'longest_violation',
        'share_in_violation',
        'dwell',
    },
    'alert': {'of', 'level', 'expect'},
    'data': {'of', 'at_least', 'at_most', 'otherwise'},
    'map': {'at_least', 'cell'},
}
_COMMON = {'requirement', 'reference', 'between', 'uncertainty'}
_TIMELESS = ('data',)


class _Reading:
    """The criterion that is being read, for errors with its file, line and key."""

    def __init__(self, document: Document, name: str, settings: Settings) -> None:
        self.document, self.name, self.settings = document, name, settings

    def refuse(self, key: str, text: str) -> BadConfig:
        """Return the BadConfig for a key of the criterion, with file and line."""
        path = ('criteria', self.name, key) if key else ('criteria', self.name)
        return BadConfig(f'{self.document.where(path)}: {text}')

    def known(self, key: str, name: str, names: tuple[str, ...]) -> str:
        """Return `name` if it is one of `names`; else BadConfig with a suggestion."""
        if name in names:
            return name
        near = get_close_matches(name, names, 1, 0.5)
        hint = f'did you mean {near[0]}?' if near else f'known are {", ".join(names)}'
        raise self.refuse(key, f'expected a known name, got {shown(name)}; {hint}')


def load_criteria(path: Path, settings: Settings) -> CriteriaSet:
    """Return the criteria of a file, for the robot of `settings`.

    Raises BadConfig with file, line and field if something is missing, wrong or does not fit.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadConfig(f'{path}: expected a file of criteria, got: {error.strerror}') from None
    document = read_document(text_of(content, path), str(path))
    file = checked(document, CriteriaFile)
    if not file.criteria:
        raise BadConfig(f'{document.where(("criteria",))}: expected at least one criterion')
    for name in file.waive:
        _check_safeguard(document, name)
    criteria = tuple(
        _criterion(_Reading(document, name, settings), section)
        for name, section in file.criteria.items()
    )
    sha256 = hashlib.sha256(content).hexdigest()
    return CriteriaSet(
        file.name,
        file.version,
        criteria,
        sha256,
        str(path),
        file.coverage,
        file.uncertainty,
        tuple(file.waive.items()),
        _accepted(document, file.ground),
        file.ground.kind,
        tuple(GroundWindow(w.kind, *w.between) for w in file.ground.windows),
        file.hand_may_touch,
        file.operator_training,
    )


def _accepted(document: Document, section: CriteriaGroundSection) -> AcceptedRule | None:
    """Return the rule accepted on ground that is not flat; BadConfig without the reason for it."""
    if section.accept is not None and section.reason is not None:
        return AcceptedRule(section.accept, section.reason)
    for key, given, other in (
        ('reason', section.accept, 'a reason why this rule is accepted'),
        ('accept', section.reason, 'the rule accepted for this reason: trend or cautious'),
    ):
        if given is not None:
            raise BadConfig(f'{document.where(("ground", key))}: expected {other}, got none')
    return None


def _check_safeguard(document: Document, name: str) -> None:
    """Raise BadConfig if a waiver names no safeguard, or the one that needs a rule in its place."""
    if name == GROUND:
        raise BadConfig(
            f'{document.where(("waive", name))}: it cannot be waived; say under ground which rule '
            'is accepted (accept: trend or cautious), and the reason'
        )
    if name not in SAFEGUARDS:
        near = get_close_matches(name, SAFEGUARDS, 1, 0.5)
        hint = f'did you mean {near[0]}?' if near else f'known are {", ".join(SAFEGUARDS)}'
        where = document.where(('waive', name))
        raise BadConfig(f'{where}: expected the name of a safeguard, got {shown(name)}; {hint}')


def _criterion(reading: _Reading, section: CriterionSection) -> Criterion:
    kinds = [kind for kind in _KEYS if getattr(section, kind) is not None]
    if len(kinds) != 1:
        raise reading.refuse('', f'expected one of {", ".join(_KEYS)}, got {len(kinds)} of them')
    (kind,) = kinds
    foreign = section.model_fields_set - _KEYS[kind] - _COMMON - {kind}
    if foreign:
        key = min(foreign)
        raise reading.refuse(key, f'this key does not belong to a criterion on {kind}')
    if kind in _TIMELESS and section.between is not None:
        raise reading.refuse('between', f'a criterion on {kind} is about the whole recording')
    return Criterion(
        reading.name,
        _READERS[kind](reading, section),
        section.requirement,
        section.reference,
        section.between,
        section.uncertainty,
    )


def _value(reading: _Reading, section: CriterionSection) -> Demand:
    signal = reading.known('value', str(section.value), tuple(SIGNALS))
    kind = SIGNALS[signal]
    subjects = subjects_of(kind, reading.settings)
    default = 'robot' if kind.subjects == 'robot' else ANY
    of = reading.known('of', section.of or default, (*subjects, ANY))
    _check_judged(reading, signal, of)
    sides = [side for side in ('below', 'above') if getattr(section, side) is not None]
    if len(sides) != 1:
        raise reading.refuse('', f'expected one of below and above, got {len(sides)} of them')
    (side,) = sides
    limit = _limit_of(reading, side, getattr(section, side), signal, of)
    return Value(
        signal,
        of,
        side == 'below',
        limit,
        section.time_in_violation,
        section.longest_violation,
        section.share_in_violation,
        section.dwell,
    )


def _check_judged(reading: _Reading, signal: str, of: str) -> None:
    """Raise BadConfig for a share of a torque limit that the configuration does not give."""
    limits = dict(
        zip(reading.settings.robot.joint_names, reading.settings.limits.torque, strict=True)
    )
    if signal in ('torque_utilisation', 'torque_margin') and not limits.get(of, 0.0) < math.inf:
        raise reading.refuse('of', f'expected a joint with a torque limit, {of} has none')


def _limit_of(reading: _Reading, side: str, given: Given, signal: str, of: str) -> float:
    """Return a limit in SI; BadConfig for degrees of a torque and the like."""
    kinds = SIGNALS[signal].kinds
    kind = kinds[0]
    if len(kinds) > 1 and of != ANY:
        kind = kinds[1] if reading.settings.robot.joint(of).slides else kinds[0]
    if given.kind not in (None, kind):
        example = EXAMPLES.get(kind, 'a bare number')
        raise reading.refuse(side, f'expected {example} for {signal}, got a unit of {given.kind}')
    return given.value


def _alert(reading: _Reading, section: CriterionSection) -> Demand:
    code = reading.known('alert', str(section.alert), (*RECORDED, ANY))
    if section.expect is None:
        raise reading.refuse('', 'expected "expect: raised" or "expect: absent"')
    return AlertDemand(
        section.expect == 'raised', None if code == ANY else code, section.of, section.level
    )


def _data(reading: _Reading, section: CriterionSection) -> Demand:
    quantity = reading.known('data', str(section.data), tuple(DATA))
    if section.of is not None:
        reading.known('of', section.of, INPUTS if DATA[quantity].each_input else ('run',))
    if section.at_least is None and section.at_most is None:
        raise reading.refuse('', 'expected at_least, at_most or both')
    if DATA[quantity].share:
        _check_shares(reading, section)
    least = -math.inf if section.at_least is None else section.at_least
    most = math.inf if section.at_most is None else section.at_most
    of = section.of if DATA[quantity].each_input else None
    return DataDemand(quantity, of, least, most, section.otherwise == 'FAIL')


def _check_shares(reading: _Reading, section: CriterionSection) -> None:
    """Raise BadConfig for a share outside 0 to 1, such as 90 for 90 %: no run could meet it."""
    for key, value in (('at_least', section.at_least), ('at_most', section.at_most)):
        if value is not None and not 0.0 <= value <= 1.0:
            raise reading.refuse(key, f'expected a share from 0 to 1, got {value:g}')


def _map(reading: _Reading, section: CriterionSection) -> Demand:
    robot = reading.settings.robot
    names = section.map or []
    if len(names) != 2 or names[0] == names[1]:
        raise reading.refuse('map', f'expected the names of two joints, got {shown(names)}')
    joints = [robot.joint(reading.known('map', name, robot.joint_names)) for name in names]
    if section.at_least is None:
        raise reading.refuse('', 'expected at_least, the share of the cells to visit')
    _check_shares(reading, section)
    if len({joint.slides for joint in joints}) > 1 or section.cell is None:
        raise reading.refuse('cell', 'expected one cell size, for two joints of one kind')
    x, y = (_range(reading, joint) for joint in joints)
    cell = section.cell
    return MapDemand((names[0], names[1]), (x, y), (cell, cell), section.at_least)


def _range(reading: _Reading, joint: Joint) -> tuple[float, float]:
    if joint.slides and not math.isfinite(joint.lower + joint.upper):
        raise reading.refuse('map', f'expected a joint with limits in the URDF, got {joint.name}')
    return joint.travel()


_READERS: dict[str, Callable[[_Reading, CriterionSection], Demand]] = {
    'value': _value,
    'alert': _alert,
    'data': _data,
    'map': _map,
}
