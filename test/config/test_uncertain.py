"""The keys of `uncertainty:` and what they move."""

import math
from dataclasses import replace

import pytest

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.evaluation.criteria.uncertainty import Source

CONFIG = load()


def source(name: str, value: float) -> Source:
    """Return what one key moves."""
    (found,) = sources_from(replace(CONFIG, uncertainty=((name, value),)))
    return found


@pytest.mark.parametrize(
    ('name', 'value', 'expected'),
    [
        ('arm_link_1.mass_kg', 0.1, ('arm_link_1', 'mass', 0.1, 0)),
        ('chassis_link.cog_z_mm', 5.0, ('chassis_link', 'cog', 0.005, 2)),
        ('turret_joint.x_m', 0.15, ('turret_joint', 'place', 0.15, 0)),
        ('elbow_joint.offset_deg', 1.0, ('elbow_joint', 'offset', math.radians(1.0), 0)),
        ('elbow_joint.limit_nm', 2.0, ('elbow_joint', 'limit', 2.0, 0)),
        ('payload.cog_y_m', 0.1, ('payload', 'cog', 0.1, 1)),
        ('contacts.y_m', 0.005, ('contacts', 'place', 0.005, 1)),
        ('imu.pitch_deg', 0.5, ('imu', 'pitch', math.radians(0.5), 0)),
    ],
)
def test_a_key_names_a_number_and_its_unit(
    name: str, value: float, expected: tuple[str, str, float, int]
) -> None:
    """Subject, what of it, its +/- in SI, and the axis of a vector."""
    subject, what, size, axis = expected
    found = source(name, value)
    assert found.value == pytest.approx(size)
    assert found == Source(name, subject, what, found.value, axis)


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('arm_link_9.mass_kg', 'did you mean arm_link_'),
        ('arm_link_1.mas_kg', 'did you mean mass'),
        ('arm_link_1.mass', 'with a unit'),
        ('arm_link_1.mass_m', 'expected a unit of mass, got m'),
        ('mass_kg', 'expected a link, joint, payload, contacts or imu'),
    ],
)
def test_a_key_that_fits_nothing_is_refused(name: str, words: str) -> None:
    """The error names the file and the key."""
    with pytest.raises(BadConfig, match=words) as caught:
        source(name, 1.0)
    assert f'uncertainty.{name}' in str(caught.value)


def test_every_key_of_the_robots_that_ship_is_known() -> None:
    """packbot.yaml states what is uncertain, and all of it counts."""
    assert len(sources_from(CONFIG)) == len(CONFIG.uncertainty) > 10
