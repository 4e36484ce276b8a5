"""Criteria from YAML: every key, every refusal, and the example of the documentation."""

import hashlib
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.config.criteria import load_criteria
from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AlertDemand,
    CriteriaSet,
    Criterion,
    DataDemand,
    Demand,
    MapDemand,
    Value,
)

HEAD = 'version: 1\nname: n\n'
SETTINGS = load().settings


def read(folder: Path, text: str) -> CriteriaSet:
    """Return the criteria of a text."""
    path = folder / 'criteria.yaml'
    path.write_text(text, 'utf-8')
    return load_criteria(path, SETTINGS)


def one(folder: Path, body: str) -> Criterion:
    """Return the criterion of a file with one."""
    return read(folder, f'{HEAD}criteria: {{it: {{{body}}}}}\n').criteria[0]


@pytest.mark.parametrize(
    ('body', 'demand'),
    [
        (
            'value: torque_utilisation, of: shoulder_joint, below: 0.9',
            Value('torque_utilisation', 'shoulder_joint', below=True, limit=0.9),
        ),
        (
            'value: tip_angle, above_deg: 10, longest_violation_s: 0.2',
            Value('tip_angle', ANY, below=False, limit=math.radians(10), longest_violation=0.2),
        ),
        (
            'value: torque, of: elbow_joint, below: 30 N m, share_in_violation: 0.1',
            Value('torque', 'elbow_joint', below=True, limit=30.0, share_in_violation=0.1),
        ),
        (
            'value: position, of: elbow_joint, above_deg: -90, dwell: 500 ms',
            Value('position', 'elbow_joint', below=False, limit=-math.pi / 2, dwell=0.5),
        ),
        (
            'value: speed, below_degps: 36, time_in_violation_s: 1',
            Value('speed', ANY, below=True, limit=math.radians(36), time_in_violation=1.0),
        ),
        (
            'value: tilt, below_deg: 20',
            Value('tilt', 'robot', below=True, limit=math.radians(20)),
        ),
        (
            'alert: TIP_OVER, of: right, level: ERROR, expect: raised',
            AlertDemand(raised=True, code='TIP_OVER', of='right', level='ERROR'),
        ),
        ('alert: any, expect: absent', AlertDemand(raised=False)),
        ('data: coverage, at_least: 0.9', DataDemand('coverage', least=0.9)),
        (
            'data: longest_gap, of: imu, at_most_s: 0.2, otherwise: FAIL',
            DataDemand('longest_gap', 'imu', most=0.2, fails=True),
        ),
    ],
    ids=str,
)
def test_a_criterion_is_read(tmp_path: Path, body: str, demand: Demand) -> None:
    """Criteria take units from keys or texts; degrees become radians."""
    found = one(tmp_path, body).demand
    if isinstance(found, Value) and isinstance(demand, Value):
        assert found.limit == pytest.approx(demand.limit, rel=1e-15)
        found = replace(found, limit=demand.limit)
    assert found == demand


def test_a_map_takes_its_ranges_from_the_urdf(tmp_path: Path) -> None:
    """A map criterion's ranges are the joints' limits, or a full turn without any."""
    body = 'map: [shoulder_joint, elbow_joint], cell_deg: 30, at_least: 0.1'
    demand = one(tmp_path, body).demand
    assert isinstance(demand, MapDemand)
    assert demand.least == 0.1
    assert demand.cell == pytest.approx((math.pi / 6, math.pi / 6))
    for (low, high), name in zip(demand.ranges, demand.joints, strict=True):
        joint = SETTINGS.robot.joint(name)
        whole = math.isinf(joint.upper)
        assert (low, high) == ((-math.pi, math.pi) if whole else (joint.lower, joint.upper))


def test_what_is_common_to_all_is_read(tmp_path: Path) -> None:
    """Window, requirement, reference and uncertainty; the file's hash is that of its bytes."""
    text = (
        'version: 1\nname: Site\nuncertainty: worst_case\ncoverage: 0.8\ncriteria:\n'
        '  a: {value: tilt, below_deg: 9, between_s: [2, 20], requirement: r, reference: s}\n'
        '  b: {value: tilt, below_deg: 9, uncertainty: ignored}\n'
    )
    found = read(tmp_path, text)
    assert (found.name, found.coverage, found.uncertainty) == ('Site', 0.8, 'worst_case')
    assert found.sha256 == hashlib.sha256(text.encode()).hexdigest()
    a, b = found.criteria
    assert (a.name, a.window, a.requirement, a.reference) == ('a', (2.0, 20.0), 'r', 's')
    assert (found.uncertainty_of(a), found.uncertainty_of(b)) == ('worst_case', 'ignored')


REFUSED = [
    ('value: torqe, below: 1', 'value: expected a known name, got "torqe"; did you mean torque?'),
    ('value: torque, of: shouldr_joint, below: 1', 'of: .* did you mean shoulder_joint'),
    ('value: torque_margin, of: turret_joint, above: 1', 'turret_joint has none'),
    ('value: torque, below: 1, above: 2', 'expected one of below and above, got 2'),
    ('value: torque', 'expected one of below and above, got 0'),
    (
        'value: torque, below_deg: 3',
        'below_deg: expected a torque .* for torque, got a unit of angle',
    ),
    ('value: tip_angle, above_nm: 3', 'above_nm: expected an angle .* got a unit of torque'),
    (
        'value: torque_utilisation, below_nm: 3',
        'below_nm: expected a bare number .* got a unit of torque',
    ),
    ('value: torque, below: .nan', 'below: expected a finite number'),
    ('value: torque, below: much', 'below: expected'),
    ('value: torque, below: 3, alert: any', 'expected one of value, alert, data, map, got 2'),
    ('below: 3', 'expected one of value, alert, data, map, got 0'),
    ('value: torque, below: 3, expect: absent', 'expect: this key does not belong'),
    ('value: torque, below: 3, belw: 3', 'belw: unknown key; did you mean below?'),
    ('value: torque, below: 3, dwell_s: 0', 'dwell_s: expected greater than 0'),
    ('value: torque, below: 3, share_in_violation: 2', 'share_in_violation: expected less'),
    ('value: torque, below: 3, between_s: [3, 2]', 'between_s: expected a start'),
    ('value: torque, below: 3, between_s: 3', 'between_s: expected a list of two times'),
    ('alert: TIP_OVR, expect: absent', 'did you mean TIP_OVER'),
    ('alert: TIP_OVER', 'expected "expect: raised" or "expect: absent"'),
    ('data: coverage', 'expected at_least, at_most or both'),
    ('data: coverage, at_least: 1, between_s: [0, 1]', 'between_s: .* the whole recording'),
    ('data: coverage, at_least: 95', 'at_least: expected a share from 0 to 1, got 95'),
    ('data: protected, at_most: -1', 'at_most: expected a share from 0 to 1, got -1'),
    (
        'map: [shoulder_joint, elbow_joint], cell_deg: 3, at_least: 5',
        'at_least: expected a share from 0 to 1, got 5',
    ),
    ('data: rate, of: imus, at_least: 1', 'of: .* did you mean imu'),
    ('map: [shoulder_joint], at_least: 1, cell_deg: 3', 'map: expected the names of two joints'),
    ('map: [shoulder_joint, elbow_joint], cell_deg: 3', 'expected at_least'),
    ('map: [shoulder_joint, elbow_joint], at_least: 1', 'cell: expected one cell size'),
]


@pytest.mark.parametrize(('body', 'words'), REFUSED, ids=[body for body, _ in REFUSED])
def test_a_wrong_criterion_is_refused_with_its_place(tmp_path: Path, body: str, words: str) -> None:
    """A wrong criterion is refused with file, line, field, what was expected and what came."""
    with pytest.raises(BadConfig) as caught:
        one(tmp_path, body)
    text = str(caught.value)
    assert re.search(words, text), text
    assert 'criteria.yaml:3: criteria.it' in text
    assert '\n' not in text


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('version: 2\nname: n\ncriteria: {}\n', 'version: expected 1'),
        (HEAD + 'criteria: {}\n', 'criteria: expected at least one criterion'),
        (HEAD, 'criteria: expected this key'),
        (HEAD + 'criteria: {a: {}, a: {}}\n', 'key given twice'),
        ('[1, 2', 'expected YAML'),
        ('', 'expected this key'),
    ],
)
def test_a_file_that_is_no_criteria_is_refused(tmp_path: Path, text: str, words: str) -> None:
    """A file of criteria has version 1, at least one criterion, and no name twice."""
    with pytest.raises(BadConfig, match=words):
        read(tmp_path, text)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    """The error names it."""
    with pytest.raises(BadConfig, match=r'none\.yaml: expected a file of criteria'):
        load_criteria(tmp_path / 'none.yaml', SETTINGS)


def test_the_example_of_the_documentation_is_valid(tmp_path: Path, repository: Path) -> None:
    """docs/criteria.md shows a file that works."""
    text = (repository / 'docs' / 'criteria.md').read_text('utf-8')
    match = re.search(r'```yaml\n(.*?)```', text, re.DOTALL)
    assert match is not None
    assert len(read(tmp_path, match[1]).criteria) == 6
