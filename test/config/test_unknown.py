"""Values that a configuration calls `unknown`: not checked, never OK, never a PASS."""

import math
from pathlib import Path

import pytest
from config.robot_files import YAML, write_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.criteria.not_judged import left_open, unknown_words

POINTS = YAML[YAML.index('contacts:') : YAML.index('payload:')]
NO_POINTS = YAML.replace(POINTS, 'contacts: unknown\n')


def test_unknown_contacts_are_none_and_said_so(tmp_path: Path) -> None:
    """`contacts: unknown` gives no contact point, and tip-over is not judged."""
    settings = load(write_robot(tmp_path, NO_POINTS)).settings
    assert (settings.robot.contacts, settings.unknown) == ((), ('contacts',))
    assert settings.hears_imu
    assert not settings.judges_tilt
    assert [one.what for one in left_open(settings).not_checked] == ['tip-over']


def test_an_unknown_limit_is_none_and_said_so(tmp_path: Path) -> None:
    """A limit that is `unknown`, with or without a unit in its key, is not judged, and no null."""
    for key in ('limit_nm', 'limit'):
        text = YAML.replace('limit_nm: 30', f'{key}: unknown')
        settings = load(write_robot(tmp_path, text)).settings
        assert math.isinf(settings.limits.torque[0])
        assert settings.unknown == ('joints.lift.limit',)
        assert [one.what for one in left_open(settings).not_checked] == ['torque of lift']
    null = load(write_robot(tmp_path, YAML.replace('limit_nm: 30', 'limit_nm: null'))).settings
    assert null.unknown == ()


def test_an_unknown_payload_link_carries_no_load(tmp_path: Path) -> None:
    """`payload: {link: unknown}` is a robot without a payload link; a mass on it is refused."""
    settings = load(write_robot(tmp_path, YAML.replace('link: hand, mass_kg: 1', 'link: unknown')))
    assert settings.settings.robot.payload_link is None
    assert settings.settings.unknown == ('payload.link',)
    with pytest.raises(BadConfig, match=r'payload\.link: expected the link that carries 1 kg'):
        load(write_robot(tmp_path, YAML.replace('link: hand', 'link: unknown')))


def test_a_file_without_the_word_leaves_nothing_open(tmp_path: Path) -> None:
    """Without `unknown` nothing changes; another word in place of the points is refused."""
    settings = load(write_robot(tmp_path)).settings
    assert (settings.unknown, unknown_words(settings)) == ((), '')
    assert settings.judges_tilt
    with pytest.raises(BadConfig, match='expected points by name, or unknown, got "perhaps"'):
        load(write_robot(tmp_path, YAML.replace(POINTS, 'contacts: perhaps\n')))
