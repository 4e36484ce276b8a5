"""The monitor under control: lifecycle, services, parameters, its end."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nodes.live_case import ERROR, FOLDED, OK, STALE, WARN, Live, imu, levels, parameter, session_of
from rcl_interfaces.msg import Parameter as Msg
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from ugv_acceptance import BadConfig
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.config import load
from ugv_acceptance.nodes.monitor.publishers import LATCHED
from ugv_acceptance.nodes.runner_world import Guard

STRETCHED = (0.0, 0.0, 0.0, 2.0)


def change(live: Live, transition: int) -> bool:
    """Ask the monitor for a transition as a lifecycle manager does."""
    request = ChangeState.Request(transition=Transition(id=transition))
    return bool(live.call(ChangeState, '/acceptance_monitor/change_state', request).success)


def state(live: Live) -> str:
    """Return the monitor's state as it tells others."""
    return str(live.call(GetState, '/acceptance_monitor/get_state').current_state.label)


def test_a_transition_that_its_state_does_not_have_is_refused(live: Live) -> None:
    """Asked twice to activate, or for a transition that does not exist, the monitor goes on."""
    monitor, driver = live.running()
    for transition in (Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_CLEANUP, 200):
        assert not change(live, transition)
    assert state(live) == 'active'
    heard = len(driver.verdicts)
    live.until(lambda: OK in levels(driver)[heard:], driver.send)
    assert monitor.session is not None


@pytest.mark.parametrize('kind', [0, 3, 77, 255])
def test_a_parameter_of_no_type_is_refused(live: Live, kind: int) -> None:
    """A value without a type, of another, or of one that ROS does not have, ends nothing."""
    live.running()
    value = ParameterValue(type=kind, integer_value=-1)
    for service, how in (
        (SetParameters, 'set_parameters'),
        (SetParametersAtomically, 'set_parameters_atomically'),
    ):
        request = service.Request(parameters=[Msg(name='limits.tip_warn_deg', value=value)])
        answer = live.call(service, f'/acceptance_monitor/{how}', request)
        results = answer.results if how == 'set_parameters' else [answer.result]
        assert not any(result.successful for result in results)


def put(monitor: Any, **values: Any) -> Any:
    """Set parameters at once, as set_parameters_atomically does."""
    parameters = [parameter(k, v) for k, v in values.items()]
    return monitor.set_parameters_atomically(parameters)


def test_a_manager_walks_it_through_its_states(live: Live) -> None:
    """With autostart false a lifecycle manager configures, activates, deactivates, cleans up."""
    monitor = live.monitor(autostart=False)
    assert state(live) == 'unconfigured'
    assert change(live, Transition.TRANSITION_CONFIGURE)
    assert state(live) == 'inactive'
    assert monitor.session is None
    assert change(live, Transition.TRANSITION_ACTIVATE)
    assert state(live) == 'active'
    driver = live.driver()
    live.until(lambda: session_of(monitor).counts['joint_states'].taken, driver.send)
    assert change(live, Transition.TRANSITION_DEACTIVATE)
    assert change(live, Transition.TRANSITION_CLEANUP)
    assert state(live) == 'unconfigured'
    assert not monitor.has_parameter('limits.tip_warn_deg')


def test_a_deactivated_monitor_is_stale_and_not_silent(live: Live) -> None:
    """A deactivated monitor takes no input and publishes STALE every second."""
    monitor, driver = live.running()
    assert change(live, Transition.TRANSITION_DEACTIVATE)
    live.until(lambda: not driver.connected())
    driver.verdicts.clear()
    live.until(lambda: len(driver.verdicts) >= 2, driver.send)
    assert set(levels(driver)) == {STALE}
    assert monitor.session is None


def test_it_can_be_activated_again(live: Live) -> None:
    """A monitor that was deactivated gives margins again after activation."""
    monitor, driver = live.running()
    assert change(live, Transition.TRANSITION_DEACTIVATE)
    assert change(live, Transition.TRANSITION_ACTIVATE)
    live.until(lambda: session_of(monitor).evaluator.margins is not None, driver.send)


def test_a_bad_configuration_is_refused_with_its_reason(live: Live) -> None:
    """Configuring with a file that is not there fails; the verdict says which file."""
    live.monitor(up=False, config='/nowhere/robot.yaml')
    driver = live.driver()
    assert not change(live, Transition.TRANSITION_CONFIGURE)
    live.until(lambda: driver.verdicts and '/nowhere/robot.yaml' in driver.verdicts[-1].message)
    assert state(live) == 'unconfigured'


def test_autostart_with_a_bad_configuration_raises(live: Live) -> None:
    """Brought up by itself it does not go on with a bad configuration."""
    monitor = live.monitor(up=False, config='/nowhere/robot.yaml')
    with pytest.raises(BadConfig, match='/nowhere/robot'):
        monitor.bring_up()


def test_the_verdict_is_latched(live: Live) -> None:
    """Who subscribes late gets the last verdict at once."""
    live.running()
    late = live.add(Node('late'))
    heard: list[Any] = []
    late.create_subscription(DiagnosticStatus, 'acceptance_monitor/verdict', heard.append, LATCHED)
    live.until(lambda: heard)


def overload(live: Live) -> Any:
    """Return a running monitor and its driver while the stretched arm is over its limit."""
    monitor, driver = live.running()
    live.until(
        lambda: driver.verdicts and any(a.values[3].value == 'ERROR' for a in driver.alerts),
        lambda: driver.send(STRETCHED),
    )
    return monitor, driver


def test_a_stretched_arm_is_an_error_with_advice(live: Live) -> None:
    """The paper's arm with 4 kg at full reach tips the robot, and needs 74.77 N m of 50.

    What to do is computed for this posture: the elbow is the way out.
    """
    _, driver = overload(live)
    live.until(
        lambda: any('TORQUE_LIMIT shoulder_joint' in a.name for a in driver.alerts),
        lambda: driver.send(STRETCHED),
    )
    live.until(lambda: driver.verdicts[-1].level[0] == ERROR, lambda: driver.send(STRETCHED))
    live.until(
        lambda: 'raise the elbow by' in driver.verdicts[-1].message,
        lambda: driver.send(STRETCHED),
    )
    torque = 9.81 * (2.5 * 0.55 / 2 + 2.5 * (0.55 + 0.64 / 2) + 4 * (0.55 + 0.64))
    # Cut, not rounded.
    said = f'needs {torque - 0.05:.1f} of 50.0 N m'
    assert any(said in a.message for a in driver.alerts)


def test_a_tip_over_that_is_over_stays_until_acknowledged_and_reset(live: Live) -> None:
    """After an ERROR the verdict is WARN, not OK: not acknowledged, then latched, then OK."""
    _, driver = overload(live)
    live.until(lambda: 'not acknowledged' in driver.verdicts[-1].message, driver.send)
    assert driver.verdicts[-1].level[0] == WARN
    assert live.call(Trigger, '/acceptance_monitor/acknowledge').success
    live.until(lambda: 'latched until reset' in driver.verdicts[-1].message, driver.send)
    assert driver.verdicts[-1].level[0] == WARN
    driver.operate('reset', who='Ada')
    live.until(lambda: driver.verdicts[-1].level[0] == OK, driver.send)


def told(driver: Any, how: str) -> dict[str, str]:
    """Return the values of the newest change of that kind."""
    statuses = [{v.key: v.value for v in a.values} for a in driver.alerts]
    return next((values for values in reversed(statuses) if values['state'] == how), {})


def test_who_acknowledged_and_why_is_told(live: Live) -> None:
    """Name and note of the person are in the change, with the alarm's state."""
    _, driver = overload(live)

    def see() -> None:
        driver.operate('acknowledge', who='Ada', note='seen')
        driver.send(STRETCHED)

    live.until(lambda: told(driver, 'acknowledged'), see)
    values = told(driver, 'acknowledged')
    assert (values['who'], values['note']) == ('Ada', 'seen')
    assert values['alarm'] == 'active, acknowledged'


def test_a_warning_can_be_shelved_and_a_critical_alarm_not(live: Live) -> None:
    """Shelving a warning is told; shelving an ERROR is refused and changes nothing."""
    _, driver = overload(live)
    asked = {'code': 'TIP_OVER', 'subject': 'front', 'seconds': '60'}

    def ask() -> None:
        for level in ('ERROR', 'WARN'):
            driver.operate('shelve', who='Ada', level=level, **asked)
        driver.send(STRETCHED)

    live.until(lambda: told(driver, 'shelved'), ask)
    shelved = [a for a in driver.alerts if a.values[0].value == 'shelved']
    assert {a.values[3].value for a in shelved} == {'WARN'}


def test_near_misses_are_in_the_verdict(live: Live) -> None:
    """The smallest tilt since the start is kept after the robot stands well again."""
    _, driver = overload(live)
    live.until(lambda: driver.verdicts[-1].message.startswith('over now'), driver.send)
    values = {v.key: v.value for v in driver.verdicts[-1].values}
    assert float(values['near_miss_tilt_deg']) < 5.0
    assert values['near_miss_tilt_deg_of'] == 'front'


def test_a_critical_alert_leaves_a_recording(live: Live, tmp_path: Path) -> None:
    """The black box holds both inputs and the alert, and is read as any recording."""
    monitor, driver = live.running(black_box=str(tmp_path))
    counts = session_of(monitor).counts
    live.until(lambda: min(counts['imu'].taken, counts['joint_states'].taken) > 5, driver.send)
    live.until(lambda: list(tmp_path.iterdir()), lambda: driver.send(STRETCHED))
    assert change(live, Transition.TRANSITION_DEACTIVATE)
    (folder,) = tmp_path.iterdir()
    found = open_bag(folder).topics
    assert found['/joint_states'].count > 5
    assert found['/imu/data'].count > 5
    assert found['/acceptance_monitor/alerts'].count >= 1


def test_acknowledging_does_not_clear(live: Live) -> None:
    """An active alert that is acknowledged is still active."""
    _, driver = overload(live)
    live.call(Trigger, '/acceptance_monitor/acknowledge')
    live.until(
        lambda: any(a.values[0].value == 'acknowledged' for a in driver.alerts),
        lambda: driver.send(STRETCHED),
    )
    driver.verdicts.clear()
    live.until(lambda: driver.verdicts, lambda: driver.send(STRETCHED))
    assert driver.verdicts[-1].level[0] == ERROR


def test_reset_begins_a_new_evaluation(live: Live) -> None:
    """A reset begins a new evaluation: nothing is latched, nothing known before new messages."""
    monitor, driver = overload(live)
    live.until(lambda: driver.verdicts[-1].message.startswith('over now'), driver.send)
    assert live.call(Trigger, '/acceptance_monitor/reset').success
    assert monitor.verdict().level == STALE
    live.until(lambda: any(a.values[0].value == 'reset' for a in driver.alerts), driver.send)
    live.until(lambda: driver.verdicts[-1].level[0] == OK, driver.send)


def test_limits_can_be_set_while_it_runs(live: Live) -> None:
    """A lower torque limit raises an alert with the next message."""
    monitor, driver = live.running()
    assert put(monitor, joints__shoulder_joint__limit_nm=0.5).successful
    live.until(lambda: any('TORQUE_LIMIT' in a.name for a in driver.alerts), driver.send)


def test_a_heavier_payload_counts_at_once(live: Live) -> None:
    """The payload's mass set while running changes the torque."""
    monitor, driver = live.running()
    before = session_of(monitor).evaluator.margins.torque[1]
    assert put(monitor, payload__mass_kg=8.0).successful
    evaluated = session_of(monitor).evaluator.evaluated
    live.until(lambda: session_of(monitor).evaluator.evaluated > evaluated + 10, driver.send)
    live.until(lambda: session_of(monitor).evaluator.margins is not None, driver.send)
    assert session_of(monitor).evaluator.margins.torque[1] != before


@pytest.mark.parametrize(
    ('values', 'reason'),
    [
        ({'limits__torque_warn': 1.0, 'limits__torque_error': 0.9}, 'torque_error'),
        ({'limits__tip_warn_deg': 1.0}, 'tip_error_deg'),
        ({'payload__mass_kg': -1.0}, ''),
        ({'payload__cog_m': [0.0, 0.0]}, 'three'),
        ({'imu__attitude': 'magnetometer'}, 'accelerometer'),
        ({'delays__off_s': float('nan')}, ''),
        ({'config': 'other.yaml'}, 'deactivate'),
        ({'limits__tip_error_deg': 4.0, 'limits__torque_error': 0.5}, 'torque_error'),
    ],
)
def test_a_set_that_cannot_be_taken_changes_nothing(
    live: Live, values: dict[str, Any], reason: str
) -> None:
    """It is refused as a whole, with the reason; also the good half of it is not taken."""
    monitor = live.monitor()
    before = session_of(monitor).settings
    result = put(monitor, **values)
    assert not result.successful
    assert reason in result.reason
    assert session_of(monitor).settings == before


VALUES = {
    'limits__torque_warn': st.floats(-1, 12),
    'limits__torque_error': st.floats(-1, 12),
    'limits__tip_warn_deg': st.floats(-100, 100),
    'limits__tip_error_deg': st.floats(-100, 100),
    'delays__off_s': st.floats(),
    'payload__mass_kg': st.floats(),
    'imu__specific_force': st.booleans(),
}


@given(data=st.data())
@settings(
    max_examples=60,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
def test_random_sets_are_wholly_taken_or_wholly_refused(live: Live, data: st.DataObject) -> None:
    """What the parameters say after any set is what the running evaluation judges by."""
    monitor: Any = live.nodes[0] if live.nodes else live.monitor()
    names = data.draw(st.sets(st.sampled_from(sorted(VALUES)), min_size=1))
    values = {name: data.draw(VALUES[name]) for name in names}
    before = {k.name: monitor.get_parameter(k.name).value for k in monitor.parameter_desk.tunables}
    taken = put(monitor, **values).successful
    after = {k.name: monitor.get_parameter(k.name).value for k in monitor.parameter_desk.tunables}
    new = {name.replace('__', '.'): value for name, value in values.items()}
    assert after == (before | new if taken else before)
    used = session_of(monitor).settings
    told = {k.name: k.get(used) for k in monitor.parameter_desk.tunables}
    assert {k: v for k, v in told.items() if v != pytest.approx(after[k])} == {}
    assert used.limits.torque_warn <= used.limits.torque_error


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly_when_asked(number: signal.Signals) -> None:
    """SIGINT, SIGTERM, and a second one meanwhile: exit code 0 and no traceback."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = (
        'import sys; from ugv_acceptance.nodes.monitor.node import Monitor\n'
        'from ugv_acceptance.nodes.executor import run\n'
        'sys.exit(run(lambda: Monitor(lambda *_: print("up", flush=True))))'
    )
    process = subprocess.Popen(
        [sys.executable, '-c', code],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout
    process.stdout.readline()
    process.send_signal(number)
    time.sleep(0.1)
    if process.poll() is None:
        process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 0
    assert b'Traceback' not in errors


def test_margins_are_published_for_every_message(live: Live) -> None:
    """With publish_rate 0 a listener gets margins for each message, by name, in N m and rad."""
    monitor, driver = live.running(publish_rate=0.0)
    torque: list[Any] = []
    tip: list[Any] = []
    at = 'acceptance_monitor'
    driver.create_subscription(JointState, f'{at}/static_torque', torque.append, 100)
    driver.create_subscription(JointState, f'{at}/stability', tip.append, 100)
    live.until(lambda: len(torque) > 20 and len(tip) > 20, driver.send)
    margins = session_of(monitor).evaluator.margins
    assert list(torque[-1].name) == list(session_of(monitor).settings.robot.joint_names)
    assert list(torque[-1].position) == list(FOLDED)
    assert list(torque[-1].effort) == list(margins.torque)
    assert list(tip[-1].name) == ['tilt_front', 'tilt_left', 'tilt_rear', 'tilt_right']
    assert list(tip[-1].position) == list(margins.stability.angle)
    assert list(tip[-1].effort) == list(margins.stability.moment)


def test_stale_inputs_silence_the_margin_topics(live: Live) -> None:
    """No margins are published while an input is missing."""
    monitor, driver = live.running(publish_rate=0.0)
    heard: list[Any] = []
    driver.create_subscription(JointState, 'acceptance_monitor/stability', heard.append, 100)
    live.until(lambda: heard, driver.send)
    live.until(lambda: session_of(monitor).evaluator.margins is None)
    live.spin(0.2)
    heard.clear()
    taken = session_of(monitor).counts['imu'].taken
    live.until(
        lambda: session_of(monitor).counts['imu'].taken > taken + 40,
        lambda: driver.imu.publish(imu()),
    )
    live.spin(0.2)
    assert heard == []


def ground_of(driver: Any) -> str:
    """Return what the newest verdict says of the ground; empty before the first."""
    if not driver.verdicts:
        return ''
    values = {pair.key: str(pair.value) for pair in driver.verdicts[-1].values}
    return values.get('ground', '')


def test_the_kind_of_ground_changes_while_it_runs(live: Live) -> None:
    """The operator sets it, locked or not; the verdict names it, and a kind that is none is not."""
    monitor, driver = live.running(lock_parameters=True)
    live.until(lambda: ground_of(driver) == 'flat (not entered)', driver.send)
    assert put(monitor, **{'ground.kind': 'stairs'}).successful
    live.until(lambda: ground_of(driver) == 'stairs', driver.send)
    live.until(lambda: 'upper bound' in driver.verdicts[-1].message, driver.send)
    refused = put(monitor, **{'ground.kind': 'rubble'})
    assert not refused.successful
    assert 'expected one of flat, uneven, stairs' in refused.reason
    assert put(monitor, **{'ground.kind': 'flat'}).successful
    live.until(lambda: ground_of(driver) == 'flat', driver.send)


def test_a_runner_tells_the_kind_of_ground_of_its_step(live: Live) -> None:
    """Told as an operator tells it; a step without one gives it back."""
    monitor, driver = live.running()
    guard = live.add(Guard(load(), lambda _: None))

    def tell(kind: str | None) -> None:
        thread = threading.Thread(target=guard.commands.tell_ground, args=(kind,), daemon=True)
        thread.start()
        live.until(lambda: not thread.is_alive(), driver.send)

    for kind, told in (('uneven', 'uneven'), (None, '')):
        tell(kind)
        assert monitor.get_parameter('ground.kind').value == told
