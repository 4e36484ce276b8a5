"""A monitor, a console and a listening doctor of robots that have no IMU, or no joint states."""

from pathlib import Path

import pytest
from nodes.live_case import OK, STALE, Driver, Live, imu, joints, levels, session_of

from ugv_acceptance.config import load
from ugv_acceptance.console.frame import frame_of
from ugv_acceptance.monitoring.drawing import figure_of
from ugv_acceptance.nodes.console_feed import ConsoleNode


def without(folder: Path, repository: Path, absent: str) -> Path:
    """Return the file of a PackBot without one of its inputs."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    text = text.replace('../urdf', str(repository / 'urdf'))
    start = text.index(f'  {absent}:\n    name')
    end = text.index('  imu:\n' if absent == 'joint_states' else '  payload:\n', start)
    text = f'{text[:start]}  {absent}: null\n{text[end:]}'
    if absent == 'imu':
        text = text.replace('attitude: auto ', 'attitude: level ')
    else:
        first, last = text.index('\njoints:\n'), text.index('\nimu:\n')
        held = '{turret_joint: 0, shoulder_joint: 2, elbow_joint: -2.5, flipper_joint: 2}'
        text = f'{text[:first]}\nheld: {held}\n{text[last:]}'
        text = text[: text.index('\nuncertainty:')]
    path = folder / f'no_{absent}.yaml'
    path.write_text(text, 'utf-8')
    return path


def send(driver: Driver, absent: str) -> None:
    """Publish what the robot has."""
    if absent == 'imu':
        driver.joints.publish(joints())
    else:
        driver.imu.publish(imu())


@pytest.mark.parametrize(
    ('absent', 'said'),
    [
        ('imu', 'all torque margins kept, tip-over not checked'),
        ('joint_states', 'all tip-over margins kept, no torque checked'),
    ],
)
def test_a_monitor_does_without_an_input_that_the_robot_has_not(
    live: Live, tmp_path: Path, repository: Path, absent: str, said: str
) -> None:
    """It is OK by the other input alone, says what is not checked, and does not miss the absent."""
    monitor = live.monitor(config=str(without(tmp_path, repository, absent)))
    driver = live.driver()
    live.until(lambda: OK in levels(driver), lambda: send(driver, absent))
    assert said in driver.verdicts[-1].message
    session = session_of(monitor)
    live.spin(1.5, lambda: send(driver, absent))
    assert absent not in session.counts
    assert absent not in {a.rule.subject for a in session.evaluator.watch.log}
    publisher = driver.imu if absent == 'imu' else driver.joints
    assert publisher.get_subscription_count() == 0


def test_tip_over_that_is_not_checked_is_never_ok_in_the_diagnostics(
    live: Live, tmp_path: Path, repository: Path
) -> None:
    """Without an IMU the status of tip-over is STALE and says why; those of torques are OK."""
    live.monitor(config=str(without(tmp_path, repository, 'imu')))
    driver, name = live.driver(), 'acceptance_monitor: '
    live.until(lambda: OK in levels(driver), lambda: send(driver, 'imu'))
    live.until(
        lambda: (
            f'{name}Torque elbow_joint' in driver.diagnostics
            and driver.diagnostics[f'{name}Torque elbow_joint'].level[0] == OK
        ),
        lambda: send(driver, 'imu'),
    )
    tip = driver.diagnostics[f'{name}Tip-over']
    assert (tip.level[0], 'no IMU' in tip.message) == (STALE, True)
    assert f'{name}Input imu' not in driver.diagnostics


@pytest.mark.parametrize('absent', ['imu', 'joint_states'])
def test_the_console_shows_what_is_known(
    live: Live, tmp_path: Path, repository: Path, absent: str
) -> None:
    """The console of a robot without an input lists only the others, and what is not checked."""
    path = without(tmp_path, repository, absent)
    live.monitor(config=str(path))
    driver, config = live.driver(), load(path)
    console = ConsoleNode(config)
    figure, frames = figure_of(config.settings.robot), []

    def look() -> None:
        send(driver, absent)
        frames.append(frame_of(console.snapshot(), config.settings, figure))

    try:
        live.until(lambda: bool(frames) and frames[-1]['level'] == 'OK', look)
    finally:
        console.close()
    frame = frames[-1]
    head = frame['headline']
    assert 'checked' in f'{head["what"]} {head["cause"]}'.lower()
    assert absent not in [row['name'] for row in frame['inputs']]
    known = [row['left_deg'] is not None for row in frame['tilt']]
    assert any(known) == (absent != 'imu')
