"""Whatever stands in a file of criteria: criteria, or one line that says what is wrong."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import hypothesis
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.config.criteria import CriterionSection, load_criteria

SETTINGS = load().settings
KEYS = [*CriterionSection.model_fields, 'below_deg', 'above_nm', 'between_s', 'cell_deg', 'odd']
WORDS = ['torque', 'tip_angle', 'zmp', 'any', 'right', 'shoulder_joint', 'TIP_OVER', 'ERROR']
WORDS += ['raised', 'absent', 'rate', 'coverage', 'imu', 'FAIL', 'rss', '30 deg', '5 N m', '']
scalars = st.one_of(
    st.sampled_from(WORDS), st.none(), st.booleans(), st.integers(-3, 99), st.floats(), st.text()
)
values = st.one_of(scalars, st.lists(scalars, max_size=3))
criteria = st.dictionaries(st.sampled_from(KEYS), values, max_size=6)
files = st.fixed_dictionaries(
    {
        'version': st.sampled_from([1, 1, 1, 2, '1', None]),
        'name': st.one_of(st.just('n'), scalars),
        'criteria': st.one_of(st.dictionaries(st.text(max_size=5), criteria, max_size=2), values),
    }
)


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder for all examples."""
    return tmp_path_factory.mktemp('criteria')


@hypothesis.settings(max_examples=300)
@given(files)
def test_any_structure_is_read_or_refused_in_one_line(folder: Path, data: Any) -> None:
    """Any YAML structure gives criteria or one BadConfig line that names the file."""
    path = folder / 'c.yaml'
    path.write_text(yaml.safe_dump(data, allow_unicode=True), 'utf-8')
    refused = ''
    try:
        assert load_criteria(path, SETTINGS).criteria
    except BadConfig as error:
        refused = str(error)
    assert not refused or refused.startswith(str(path))
    assert '\n' not in refused


@hypothesis.settings(max_examples=200)
@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(folder: Path, content: bytes) -> None:
    """Any bytes give criteria or BadConfig, also if they are no YAML or no text."""
    path = folder / 'b.yaml'
    path.write_bytes(content)
    with suppress(BadConfig):
        load_criteria(path, SETTINGS)
