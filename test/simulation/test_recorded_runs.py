"""The runs of bags/ are what their README says and what their script makes."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import stability
from ugv_acceptance.simulation.scenarios import SCENARIOS
from ugv_acceptance.simulation.stretches import run

RUNS = ('packbot_pass', 'packbot_fail', 'packbot_gap')
SECOND = 1_000_000_000


def read(folder: Path, topic: str) -> tuple[np.ndarray, list[Any]]:
    """Return log times (s) from the start of the bag, and the messages, by rosbags."""
    with AnyReader([folder]) as reader:
        chosen = [c for c in reader.connections if c.topic == topic]
        rows = [
            ((time - reader.start_time) / SECOND, reader.deserialize(raw, connection.msgtype))
            for connection, time, raw in reader.messages(chosen)
        ]
    return np.array([time for time, _ in rows]), [message for _, message in rows]


@pytest.mark.parametrize('name', RUNS)
def test_every_message_of_a_run_can_be_read(repository: Path, name: str) -> None:
    """Reading with rosbags gives as many messages as each topic has, in less than 1 MB."""
    folder = repository / 'bags' / name
    with AnyReader([folder]) as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
        found = [connection.topic for connection, _, _ in reader.messages()]
    assert set(counts) == {'/joint_states', '/imu/data', '/payload'}
    assert {topic: found.count(topic) for topic in counts} == counts
    assert sum(path.stat().st_size for path in folder.iterdir()) < 1_000_000


def test_the_imu_of_the_gap_is_silent_for_three_seconds(repository: Path) -> None:
    """packbot_gap has no IMU message from 8 to 11 s, and no other gap."""
    times, _ = read(repository / 'bags' / 'packbot_gap', '/imu/data')
    gaps = np.diff(times)
    assert gaps.max() == pytest.approx(3.005, abs=0.002)
    assert np.sort(gaps)[-2] < 0.01
    assert times[int(gaps.argmax())] == pytest.approx(7.995, abs=0.002)


def test_a_recorded_run_is_what_the_script_makes(repository: Path) -> None:
    """Simulated again, the first five seconds of packbot_pass are those of the bag."""
    scenario = replace(SCENARIOS['gentle'](), duration=5.0)
    again = run(load().settings.robot, scenario, seed=1)
    _, messages = read(repository / 'bags' / 'packbot_pass', '/joint_states')
    position = np.array([m.position for m in messages[: len(again.joints.stamp)]])
    # Noise is drawn for the whole run: the bag's samples differ by what sensors scatter.
    np.testing.assert_allclose(position, again.joints.position, rtol=0, atol=2e-3)


def test_the_failing_run_loses_its_margin(repository: Path) -> None:
    """In packbot_fail the margin to the right passes 5 deg at 25.2 s and is gone by 26 s."""
    folder, robot = repository / 'bags' / 'packbot_fail', load().settings.robot
    _, joints = read(folder, '/joint_states')
    _, imu = read(folder, '/imu/data')
    q = np.array([m.position for m in joints])[500:]
    turned = [(o.x, o.y, o.z, o.w) for o in (m.orientation for m in imu[1000::2])]
    down = Rotation.from_quat(turned).inv().apply([0.0, 0.0, -9.81])
    right = np.degrees(stability(robot, q, down, Payload(4.0)).angle[3])
    times = 5.0 + np.arange(len(q)) / 100.0
    assert times[np.argmax(right < 5.0)] == pytest.approx(25.2, abs=0.15)
    assert times[np.argmax(right < 0.0)] == pytest.approx(25.8, abs=0.2)
