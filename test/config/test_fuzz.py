"""Any text gives a configuration or BadConfig, never another exception."""

import tempfile
from pathlib import Path

import yaml
from config.robot_files import URDF, YAML, write_robot
from hypothesis import given, settings
from hypothesis import strategies as st

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config, load
from ugv_acceptance.config.schema import File

SECTIONS = sorted(File.model_fields)
scalars = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(['30 deg', '1e400', '5 N m', 'base', 'lift', '/', '~', '2001-13-01', '!!int'])
)
keys = st.text(max_size=4) | st.sampled_from(
    ['link', 'mass_kg', 'position_m', 'lift', 'name', 'qos']
)
values = st.recursive(
    scalars, lambda v: st.lists(v, max_size=4) | st.dictionaries(keys, v, max_size=4), max_leaves=8
)


def load_texts(yaml_text: str, urdf_text: str) -> Config | None:
    """Load two texts as files; None where they are refused, by one line."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return load(write_robot(Path(folder), yaml_text, urdf_text))
        except BadConfig as error:
            said = str(error)
    assert len(said.splitlines()) == 1, repr(said)
    return None


def write_over(text: str, at: int, length: int, new: str) -> str:
    """Return a text with a piece of it replaced."""
    at %= len(text)
    return text[:at] + new + text[at + length :]


printable = st.text(st.characters(exclude_categories=['Cs']), max_size=6)


@settings(max_examples=150)
@given(st.integers(0), st.integers(0, 30), printable)
def test_a_damaged_yaml_is_a_configuration_or_bad(at: int, length: int, new: str) -> None:
    """A YAML file with any piece replaced gives a configuration or BadConfig."""
    assert isinstance(load_texts(write_over(YAML, at, length, new), URDF), Config | None)


@settings(max_examples=150)
@given(st.integers(0), st.integers(0, 30), printable)
def test_a_damaged_urdf_is_a_configuration_or_bad(at: int, length: int, new: str) -> None:
    """A URDF with any piece replaced gives a configuration or BadConfig."""
    assert isinstance(load_texts(YAML, write_over(URDF, at, length, new)), Config | None)


LEFTOVERS = (
    '<xacro:property name="a" value="1"/>', '<xacro:if value="1">', '</xacro:if>', '${x}', '<a:b/>',
    '<joint name="f" type="floating"><parent link="base"/><child link="b"/></joint>', ' xmlns="u"',
    '<limit lower="-2" upper="-1" effort="0"/>', '<inertial/>', '<mimic joint="lift"/>', '&#10;',
    '<collision><geometry><mesh filename="x"/></geometry></collision>', '<link name="b"/>', 'inf',
)  # fmt: skip


@settings(max_examples=150)
@given(st.lists(st.tuples(st.integers(0), st.sampled_from(LEFTOVERS)), max_size=3))
def test_a_urdf_with_pieces_of_others_is_a_configuration_or_bad(
    pieces: list[tuple[int, str]],
) -> None:
    """A URDF with pieces that belong elsewhere gives a configuration or BadConfig."""
    urdf = URDF
    for at, piece in pieces:
        urdf = write_over(urdf, at, 0, piece)
    assert isinstance(load_texts(YAML, urdf), Config | None)


@settings(max_examples=150)
@given(st.sampled_from(SECTIONS), values)
def test_any_value_of_a_section_is_a_configuration_or_bad(section: str, value: object) -> None:
    """Every section of a sound file, with anything YAML can say in it."""
    data = yaml.safe_load(YAML) | {section: value}
    assert isinstance(load_texts(yaml.safe_dump(data), URDF), Config | None)


@settings(max_examples=100)
@given(st.text(st.characters(exclude_categories=['Cs'])))
def test_any_text_is_a_configuration_or_bad(text: str) -> None:
    """Any text, as YAML file or as URDF, gives a configuration or BadConfig."""
    assert load_texts(text, URDF) is None
    assert load_texts(YAML, text) is None


@settings(max_examples=100)
@given(st.floats(), st.floats(), st.floats())
def test_any_number_in_a_urdf_is_a_configuration_or_bad(mass: float, x: float, y: float) -> None:
    """Masses and places of any size, tiny and huge ones included."""
    urdf = URDF.replace('"20"', f'"{mass}"').replace('0.5 0 0', f'{x} {y} 0')
    assert isinstance(load_texts(YAML, urdf), Config | None)
