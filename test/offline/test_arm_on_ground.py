"""Recordings in which the arm comes down to the ground: what the verdict says of them."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from offline.joint_runs import FOLDED, NS, Run, judged, moved, rest

import ugv_acceptance as ugv
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats

RAD = math.radians
DOWN = 'no margin is valid'


def at(shoulder: float, elbow: float = 0.0) -> Run:
    """Return a run of ten seconds at rest with the arm at angles (deg)."""
    run = rest()
    run = moved(run, 1, lambda t: np.full_like(t, RAD(shoulder) - FOLDED[1]))
    return moved(run, 2, lambda t: np.full_like(t, RAD(elbow) - FOLDED[2]))


def picks() -> Run:
    """Return a run whose hand comes down to 3 cm below the ground at 5 s, and goes up from 6 s."""

    def elbow(t: Floats) -> Floats:
        down = np.clip((t - 2.0) / 3.0, 0.0, 1.0) - np.clip((t - 6.0) / 3.0, 0.0, 1.0)
        # The elbow is 0.19 + 0.55 sin(50 deg) = 0.61 m high; from there the hand hangs 0.64 m down.
        found: Floats = RAD(-50.0) - RAD(90.0) * down
        return found

    return moved(at(50.0), 2, elbow)


def criteria(folder: Path, *lines: str) -> Path:
    """Write criteria that ask little, with more keys of the file."""
    told = [
        'version: 1',
        'name: picking',
        *lines,
        'criteria:',
        '  stands: {value: tip_angle, above_deg: 5}',
    ]
    told.append('  shoulder: {value: torque_utilisation, of: shoulder_joint, below: 1.0}')
    path = folder / 'criteria.yaml'
    path.write_text('\n'.join(told), 'utf-8')
    return path


def unchecked(found: ugv.Evaluation) -> dict[str, Any]:
    """Return what was not checked: seconds by what it is."""
    return {one['what']: one['seconds'] for one in found.result['not_checked']}


def test_an_arm_through_the_floor_is_no_pass(tmp_path: Path) -> None:
    """The shoulder at -50 degrees puts the gripper 0.7 m below the floor: INCONCLUSIVE."""
    found = judged(tmp_path, at(-50.0, 0.0), payload=0.0)
    assert found.verdict == 'INCONCLUSIVE'
    assert DOWN in found.result['reasons'][0]
    low = 0.19 - 1.19 * math.sin(RAD(50.0)) - 0.025 * math.cos(RAD(50.0))
    assert found.result['clearance']['min_m'] == pytest.approx(low, abs=1e-3)
    assert found.result['stability']['min_angle_deg'] is None
    (alert,) = (a for a in found.alerts if a.code == 'ARM_ON_GROUND')
    assert alert.level == 'ERROR'
    assert alert.peak == pytest.approx(low, abs=1e-3)


def test_an_arm_that_hangs_low_but_free_passes(tmp_path: Path) -> None:
    """Ten centimetres above the ground nothing is said."""
    found = judged(tmp_path, at(0.0, -5.0), payload=0.0)
    assert found.verdict == 'PASS'
    assert found.result['clearance']['min_m'] > 0.09


def test_picking_something_up_passes_where_it_is_permitted(tmp_path: Path) -> None:
    """Without permission INCONCLUSIVE; in a window that holds it, or always, PASS."""
    run = picks()
    assert judged(tmp_path, run, payload=0.0).verdict == 'INCONCLUSIVE'
    for k, told in enumerate(('hand_may_touch_s: [[3, 9]]', 'hand_may_touch: true')):
        folder = tmp_path / f'criteria{k}'
        folder.mkdir()
        found = judged(tmp_path, run, payload=0.0, criteria=criteria(folder, told))
        assert found.verdict == 'PASS', found.result['reasons']
        assert 0.5 < unchecked(found)['torques'] < 3.0
        assert found.result['clearance']['min_m'] < 0.0
        window = [[3.0, 9.0], [0.0, None]][k]
        assert found.result['clearance']['may_touch_s'] == [window]


def test_outside_its_window_the_hand_may_not_touch(tmp_path: Path) -> None:
    """A window that is over before the hand comes down permits nothing."""
    told = criteria(tmp_path, 'hand_may_touch_s: [[0, 2]]')
    found = judged(tmp_path, picks(), payload=0.0, criteria=told)
    assert found.verdict == 'INCONCLUSIVE'
    assert DOWN in found.result['reasons'][0]


def test_what_the_hand_holds_down_is_still_judged_by_its_tilt(tmp_path: Path) -> None:
    """With permission tip-over is judged as if nothing supported the arm."""
    far = at(-8.0, -4.0)  # stretched forward and down: past tipping with 8 kg, if nothing holds it
    told = criteria(tmp_path, 'hand_may_touch: true')
    found = judged(tmp_path, far, payload=8.0, criteria=told)
    assert found.result['clearance']['min_m'] < 0.02
    assert found.verdict == 'FAIL'
    assert 'past tipping: ' in found.result['reasons'][0]
    assert found.result['torque']['shoulder_joint']['max_abs'] is None


def test_clearance_is_a_value_for_criteria(tmp_path: Path) -> None:
    """A criterion may demand a height of the arm above the ground."""
    told = tmp_path / 'clear.yaml'
    told.write_text(
        'version: 1\nname: clear\ncriteria:\n  high: {value: clearance, above_m: 0.2}\n', 'utf-8'
    )
    assert judged(tmp_path, at(60.0, 30.0), payload=0.0, criteria=told).verdict == 'FAIL'
    told.write_text(told.read_text('utf-8').replace('0.2', '0.1'), 'utf-8')
    assert judged(tmp_path, at(60.0, 30.0), payload=0.0, criteria=told).verdict == 'PASS'


@pytest.mark.parametrize('wrong', ['hand_may_touch: 3', 'hand_may_touch_s: [[9, 3]]'])
def test_windows_that_are_none_are_refused(tmp_path: Path, wrong: str) -> None:
    """A number, or a window that ends before it begins, is refused with file and line."""
    with pytest.raises(ugv.AcceptanceError, match=r'criteria\.yaml:3: hand_may_touch'):
        judged(tmp_path, rest(2.0), criteria=criteria(tmp_path, wrong))


def test_efforts_of_a_hand_on_the_ground_are_no_saturation(tmp_path: Path) -> None:
    """Torque efforts that drop while the ground carries the arm are no contradiction."""
    run, robot = picks(), ugv.load_config('packbot').settings.robot
    effort = static_torque(robot, run.position, (0.0, 0.0, -9.81), Payload())
    seconds = (run.stamp - run.stamp[0]) / NS
    on_ground = (seconds > 4.7) & (seconds < 6.3)
    effort[on_ground] *= 0.1
    told = criteria(tmp_path, 'hand_may_touch: true')
    found = judged(tmp_path, run.changed(effort=effort), payload=0.0, criteria=told)
    alerts = {alert.code for alert in found.alerts}
    assert not alerts & {'ENCODER_FROZEN', 'MOTOR_WEAK', 'EFFORT_LIMIT', 'ARM_ON_GROUND'}
    residual = next(one for one in found.result['safeguards'] if one['name'] == 'residual')
    assert residual['verdict'] == 'PASS'
