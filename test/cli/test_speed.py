"""`ugv-acceptance speed`: the acceptable joint speed of a robot."""

import json
import math

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.speed import speed
from ugv_acceptance.config import load
from ugv_acceptance.studies.postures import random_postures, sweeps
from ugv_acceptance.studies.validity import critical_value

app = typer.Typer()
app.command('speed')(speed)


def found(*arguments: str) -> dict[str, float | None]:
    """Return the speeds (deg/s) by joint."""
    result = CliRunner().invoke(app, [*arguments, '--json'], catch_exceptions=False)
    values: dict[str, float | None] = json.loads(result.output)['speed_deg_s']
    return values


def test_the_paper_s_posture_gives_the_paper_s_speed() -> None:
    """The elbow turns at theta_1 = 30 deg: 34.6 deg/s at 1.227, 35.9 at the computed value."""
    posture = ('--posture', 'shoulder_joint=30deg')
    assert found(*posture, '--critical', '1.227')['elbow_joint'] == pytest.approx(34.60, abs=0.01)
    assert found(*posture)['elbow_joint'] == pytest.approx(35.88, abs=0.01)


def test_less_load_allows_more_speed() -> None:
    """Without a payload every loaded joint may move faster."""
    with_load, without = found(), found('--payload', '0')
    for name in ('turret_joint', 'shoulder_joint', 'elbow_joint'):
        assert (without[name] or 0.0) > (with_load[name] or math.inf)


def test_a_joint_that_loads_nothing_may_move_at_any_speed() -> None:
    """The flippers are balanced about no other joint: null in JSON, "any" in the table."""
    assert found()['flipper_joint'] is None
    text = CliRunner().invoke(app, []).output
    assert text.splitlines()[-1].split() == ['flipper_joint', 'any']
    assert f'F < {critical_value():.4f}' in text


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (('--reference', '0'), '--reference: expected an error > 0 N m'),
        (('--critical', '0.5'), '--critical: expected a value > 1'),
        (('--payload', '-2'), '--payload: expected a mass >= 0 kg'),
    ],
)
def test_wrong_options_are_named(arguments: tuple[str, ...], words: str) -> None:
    """One line: the option, what was expected, what came."""
    with pytest.raises(BadConfig, match=words):
        CliRunner().invoke(app, list(arguments), catch_exceptions=False)


def test_postures_stay_in_range() -> None:
    """Random postures and sweeps keep each joint's range; a sweep moves one joint."""
    robot = load().settings.robot
    ranges = np.array([robot.joint(name).travel() for name in robot.joint_names])
    postures = random_postures(robot, 500, seed=1)
    assert (postures >= ranges[:, 0]).all()
    assert (postures <= ranges[:, 1]).all()
    for k, sweep in enumerate(sweeps(robot, [0.1] * 4, 11)):
        assert np.ptp(sweep[:, k]) == pytest.approx(2.0 * math.pi)
        assert np.ptp(np.delete(sweep, k, axis=1), axis=0) == pytest.approx(0.0)
