"""Recordings of a robot whose configuration calls values `unknown`: at best INCONCLUSIVE."""

from pathlib import Path
from typing import Any

import pytest
from offline.test_absent_inputs import STRETCHED, recorded, unchecked

import ugv_acceptance as ugv

INPUTS = ['/joint_states', '/imu/data']
CASES = {
    'tip-over': ('contacts:', 'ground:', 'contacts: unknown\n\n'),
    'load': ('payload:\n  link', 'limits:', 'payload: {link: unknown}\n\n'),
    'torque of turret_joint': ('    limit_nm: null', '    static', '    limit_nm: unknown\n'),
}


def packbot(folder: Path, repository: Path, what: str) -> Path:
    """Return the file of a PackBot of which one value is unknown."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    first, last, put = CASES[what]
    start = text.index(first)
    text = text[:start] + put + text[text.index(last, start) :]
    path = folder / 'packbot.yaml'
    path.write_text(text.replace('../urdf', str(repository / 'urdf')), 'utf-8')
    return path


@pytest.mark.parametrize('what', list(CASES))
def test_no_recording_passes_while_something_is_unknown(
    tmp_path: Path, repository: Path, what: str
) -> None:
    """What passes with the value is INCONCLUSIVE without it, and says what was not checked."""
    run = recorded(tmp_path / 'run', INPUTS)
    assert ugv.evaluate(run, payload=0.0).verdict == 'PASS'
    config = packbot(tmp_path, repository, what)
    result = ugv.evaluate(run, config=config, payload=None if what == 'load' else 0.0)
    assert result.verdict == 'INCONCLUSIVE'
    assert what in unchecked(result)
    assert any(what in reason and 'unknown' in reason for reason in result.reasons)


def test_a_joint_beyond_its_limit_still_fails(tmp_path: Path, repository: Path) -> None:
    """Unknown contact points excuse no torque, and no fall is made of them."""
    config = packbot(tmp_path, repository, 'tip-over')
    result = ugv.evaluate(recorded(tmp_path / 'run', INPUTS, STRETCHED), config=config)
    assert result.verdict == 'FAIL'
    told: Any = result.to_dict()
    assert {alert['code'] for alert in told['alerts']} <= {'TORQUE_LIMIT', 'TORQUE_AHEAD'}
    (tipping,) = (one for one in told['safeguards'] if one['name'] == 'tipping')
    assert (tipping['verdict'], tipping['checked']) == ('INCONCLUSIVE', False)
