"""What can be set on a running monitor, and what would disarm it: over DDS, as ros2 param does."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import InertiaStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nodes.live_case import OK, STALE, WARN, Live, parameter, session_of
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically

from ugv_acceptance import BadConfig
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.inputs.timeouts import InputTimeout
from ugv_acceptance.evaluation.permitted_limits import RANGES, Permitted
from ugv_acceptance.nodes.monitor.parameters import knobs_of
from ugv_acceptance.offline.evaluate import evaluate

AT = '/acceptance_monitor'
WHY = 'bench test, robot tied down'
LIVE_RANGES = [of for of in RANGES if of.live]
WIDE = {
    'limits.torque_error': 10.0,
    'limits.tip_error_deg': -90.0,
    'delays.stale_after_s': 60.0,
    'delays.stale_periods': 1000.0,
}
JOINT = 'joints.shoulder_joint.limit_nm'
S = 1_000_000_000


def messages(values: dict[str, Any]) -> list[Any]:
    """Return parameters as they go over DDS."""
    made: list[Any] = [parameter(k, v) for k, v in values.items()]
    return [one.to_parameter_msg() for one in made]


def put(live: Live, **values: Any) -> list[Any]:
    """Set parameters one by one, as `ros2 param set` does; `__` stands for a dot."""
    request = SetParameters.Request(parameters=messages(values))
    return list(live.call(SetParameters, f'{AT}/set_parameters', request).results)


def put_at_once(live: Live, values: dict[str, Any]) -> Any:
    """Set parameters in one set."""
    request = SetParametersAtomically.Request(parameters=messages(values))
    name = f'{AT}/set_parameters_atomically'
    return live.call(SetParametersAtomically, name, request).result


def got(live: Live, *names: str) -> list[Any]:
    """Get numbers as `ros2 param get` does."""
    request = GetParameters.Request(names=list(names))
    answer = live.call(GetParameters, f'{AT}/get_parameters', request)
    return [v.double_value if v.type == 3 else list(v.double_array_value) for v in answer.values]


def values_of(status: Any) -> dict[str, str]:
    """Return what a status says beside its words."""
    return {pair.key: pair.value for pair in status.values}


@pytest.fixture
def one(live: Live) -> tuple[Live, Any]:
    """Return an active monitor that nobody feeds."""
    return live, live.monitor()


def beyond(of: Permitted) -> list[float]:
    """Return values outside the range: just outside, relaxed, and what can never be meant."""
    found = [math.nextafter(of.most, math.inf) + 1e-6 * abs(of.most), of.ceiling, 1e6 * of.ceiling]
    return found if of.ceiling > of.most else [of.least - 1.0, of.floor, 1e6 * of.floor]


@pytest.mark.parametrize('of', LIVE_RANGES, ids=lambda of: of.name)
def test_a_value_beyond_its_range_is_refused(one: tuple[Live, Any], of: Permitted) -> None:
    """In one line that names the range and unsafe_limits; what is judged by stays as it was."""
    live, monitor = one
    before = session_of(monitor).settings
    for value in beyond(of):
        (result,) = put(live, **{of.name: value})
        assert not result.successful
        assert result.reason.startswith(f'{of.name}: expected {of.least:g} to {of.most:g}')
        assert 'unsafe_limits' in result.reason
        assert '\n' not in result.reason
    assert session_of(monitor).settings == before


@pytest.mark.parametrize('value', [0.0, 50.001, 1e9])
def test_a_joints_limit_cannot_be_raised_above_the_configured_one(
    one: tuple[Live, Any], value: float
) -> None:
    """Nor taken away (0: not judged); the line names the configured limit and unsafe_limits."""
    live, monitor = one
    before = session_of(monitor).settings
    (result,) = put(live, **{JOINT: value})
    assert not result.successful
    assert JOINT in result.reason
    assert '50' in result.reason
    assert 'unsafe_limits' in result.reason
    assert session_of(monitor).settings == before


@pytest.mark.parametrize('reason', ['  ', 'a\nb', 'x' * 201])
def test_a_reason_that_says_nothing_is_refused(one: tuple[Live, Any], reason: str) -> None:
    """An empty reason for relaxed limits is refused, alone or with the values."""
    live, monitor = one
    before = session_of(monitor).settings
    for values in ({'unsafe_limits': reason}, {'unsafe_limits': reason, **WIDE}):
        result = put_at_once(live, values)
        assert not result.successful
        assert 'unsafe_limits' in result.reason
    assert not put_at_once(live, {'unsafe_limits': '', **WIDE}).successful
    assert session_of(monitor).settings == before


@pytest.mark.parametrize(
    'of', [o for o in LIVE_RANGES if o.key != 'tip_warn'], ids=lambda o: o.name
)
def test_a_monitor_does_not_start_with_a_value_beyond_its_range(live: Live, of: Permitted) -> None:
    """Given at the start it is refused as well, with the same words."""
    value = of.ceiling if of.ceiling > of.most else of.floor
    given: dict[str, Any] = {of.name: value}
    monitor = live.monitor(up=False, **given)
    with pytest.raises(BadConfig, match='unsafe_limits'):
        monitor.bring_up()


def test_a_stopped_driver_is_stale_within_two_seconds_whatever_was_tried(live: Live) -> None:
    """Everything put as wide as it goes, then the driver stops: STALE in 2 s and some ticks."""
    monitor, driver = live.running()
    for of in LIVE_RANGES:
        put(live, **{of.name: of.ceiling if of.ceiling > of.most else of.floor})
    put(live, delays__stale_after_s=2.0, delays__stale_periods=100.0, delays__fault_on_s=5.0)
    put(live, **{JOINT: 0.0})
    taken = session_of(monitor).counts['imu'].taken
    live.until(lambda: session_of(monitor).counts['imu'].taken > taken + 70, driver.send)
    heard = max(session_of(monitor).counts[name].last for name in ('joint_states', 'imu'))
    live.until(lambda: monitor.verdict().level == STALE)
    log = session_of(monitor).evaluator.watch.log
    stale = [a.start for a in log if a.rule.code == 'INPUT_STALE' and a.end is None]
    assert stale
    assert min(stale) <= heard + 3 * S  # ticks of a busy machine are late; put wide it were 60 s


def test_a_slow_input_that_stops_is_stale_within_two_seconds() -> None:
    """Also with a reason: stale_periods alone never makes silence longer than 2 s."""
    settings = load().settings
    (tunable,) = (k for k in knobs_of(settings) if k.name == 'delays.stale_periods')
    wide = tunable.put(settings, 1000.0)
    fresh = InputTimeout(wide.delays)
    for k in range(40):
        fresh.message(k * S)
    assert fresh.limit == 2 * S


def test_with_a_reason_relaxed_limits_are_taken_and_told(live: Live) -> None:
    """A warning stands in verdict, alerts and diagnostics: which limits, and why."""
    monitor, driver = live.running()
    live.until(lambda: driver.verdicts and driver.verdicts[-1].level[0] == OK, driver.send)
    before = values_of(driver.verdicts[-1])['limits_hash']
    assert put_at_once(live, {'unsafe_limits': WHY, **WIDE}).successful
    live.until(lambda: driver.verdicts[-1].level[0] == WARN, driver.send)
    said = driver.verdicts[-1]
    values = values_of(said)
    assert values['code'] == 'LIMITS_RELAXED'
    assert WHY in said.message
    assert values['unsafe_limits'] == WHY
    assert set(values['limits_relaxed'].split(', ')) == set(WIDE)
    assert values['limits_hash'] != before
    told = {values_of(a)['subject'] for a in driver.alerts if 'LIMITS_RELAXED' in a.name}
    assert told == set(WIDE)
    name = 'acceptance_monitor: Monitor'
    live.until(lambda: driver.diagnostics[name].level[0] == WARN, driver.send)
    shown = values_of(driver.diagnostics[name])
    assert (shown['unsafe_limits'], shown['limits_hash']) == (WHY, values['limits_hash'])
    assert session_of(monitor).settings.limits.torque_error == 10.0


def test_the_warning_stands_until_the_limits_are_back(live: Live) -> None:
    """The reason cannot be taken away before; after that the verdict is OK and the hash as ever."""
    monitor, driver = live.running()
    before = monitor.verdict().values['limits_hash']
    assert put_at_once(live, {'unsafe_limits': WHY, 'limits.tip_error_deg': -5.0}).successful
    live.until(lambda: monitor.verdict().level == WARN, driver.send)
    assert not put(live, unsafe_limits='')[0].successful
    live.spin(1.0, driver.send)
    assert monitor.verdict().values['code'] == 'LIMITS_RELAXED'
    assert put_at_once(live, {'unsafe_limits': '', 'limits.tip_error_deg': 5.0}).successful
    live.until(lambda: monitor.verdict().level == OK, driver.send)
    assert monitor.verdict().values['limits_hash'] == before
    assert 'limits_relaxed' not in monitor.verdict().values


def test_relaxed_limits_are_told_beside_what_is_worse(live: Live) -> None:
    """While the inputs are stale the verdict still says that limits are relaxed, and why."""
    monitor, driver = live.running()
    assert put_at_once(live, {'unsafe_limits': WHY, 'limits.torque_error': 2.0}).successful
    live.spin(0.2, driver.send)
    live.until(lambda: monitor.verdict().level == STALE)
    assert WHY in monitor.verdict().message
    assert 'limits.torque_error' in monitor.verdict().message


def test_the_hash_is_that_of_a_recording_judged_by_the_same_file(
    live: Live, tmp_path: Path
) -> None:
    """Live and from a bag: the same configuration, the same hash; another parameter, another."""
    monitor = live.monitor()
    with BagWriter(tmp_path / 'run') as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState', Qos())
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu', Qos())
        names = load().settings.robot.joint_names
        still = ((0.0, 0.0, 0.0, 1.0), (0.0,) * 3, (0.0, 0.0, 9.81))
        for k in range(200):
            now = 1_700_000_000 * S + k * S // 100
            writer.write('/joint_states', now, joint_state_cdr(now, '', names, (0.0,) * len(names)))
            writer.write('/imu/data', now, imu_cdr(now, 'imu_link', *still))
    result = json.loads(evaluate(tmp_path / 'run').to_json())
    assert monitor.verdict().values['limits_hash'] == result['limits_hash']
    assert put(live, limits__tip_warn_deg=11.0)[0].successful
    assert monitor.verdict().values['limits_hash'] != result['limits_hash']
    assert put(live, limits__tip_warn_deg=10.0)[0].successful
    assert monitor.verdict().values['limits_hash'] == result['limits_hash']


def test_each_alert_carries_the_hash_into_the_black_box(live: Live) -> None:
    """What the black box keeps of alerts says by which limits they were raised."""
    monitor, driver = live.running()
    stretched = (0.0, 0.0, 0.0, 2.0)
    live.until(lambda: driver.alerts, lambda: driver.send(stretched))
    expected = session_of(monitor).limits_hash
    assert {values_of(alert)['limits_hash'] for alert in driver.alerts} == {expected}


LOCKED: list[dict[str, Any]] = [
    *({of.name: of.least} for of in LIVE_RANGES),
    {'unsafe_limits': WHY},
    {JOINT: 40.0},
    {'imu.attitude': 'accelerometer'},
    {'imu.specific_force': True},
    {'allowed_publishers': ['/other']},
    {'lock_parameters': False},
]


def test_locked_parameters_cannot_be_set_while_active(live: Live) -> None:
    """Locked parameters cannot be set while active, except the load's."""
    monitor = live.monitor(lock_parameters=True)
    before = session_of(monitor).settings
    for values in LOCKED:
        (result,) = put(live, **values)
        assert not result.successful, values
        assert 'deactivate' in result.reason
    assert session_of(monitor).settings == before
    assert put(live, payload__mass_kg=3.0)[0].successful
    assert session_of(monitor).settings.robot.payload.mass == 3.0


def test_locked_parameters_can_be_set_while_inactive(live: Live) -> None:
    """A deactivated monitor says STALE and can be changed, the lock too."""
    live.monitor(lock_parameters=True)
    change = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
    assert live.call(ChangeState, f'{AT}/change_state', change).success
    assert put(live, limits__tip_warn_deg=12.0)[0].successful
    assert put(live, lock_parameters=False)[0].successful


def test_the_payload_parameter_says_what_is_in_force(live: Live) -> None:
    """Set by parameter or declared by message: what is got is what margins are computed with."""
    monitor, driver = live.running()
    declare = driver.create_publisher(InertiaStamped, 'payload', 10)
    message = InertiaStamped()
    message.inertia.m, message.inertia.com.x = 2.5, 0.125

    def send() -> None:
        declare.publish(message)
        driver.send()

    live.until(lambda: session_of(monitor).evaluator.payload.mass == 2.5, send)
    live.until(lambda: monitor.get_parameter('payload.mass_kg').value == 2.5, driver.send)
    assert got(live, 'payload.mass_kg', 'payload.cog_m') == [2.5, [0.125, 0.0, 0.0]]
    configured = load().settings.robot.payload.mass
    assert put(live, payload__mass_kg=configured)[0].successful
    assert session_of(monitor).evaluator.payload.mass == configured
    assert got(live, 'payload.mass_kg') == [configured]


def test_another_limit_does_not_bring_the_configured_load_back(live: Live) -> None:
    """Also in the moment before the parameters say what a message declared."""
    monitor, _ = live.running()
    evaluator = session_of(monitor).evaluator
    evaluator.carry(session_of(monitor).clock.now(), 2.5, (0.0, 0.0, 0.0), '')
    assert monitor.set_parameters_atomically([parameter('limits.tip_warn_deg', 12.0)]).successful
    assert evaluator.payload.mass == 2.5
    assert evaluator.settings.robot.payload.mass == 2.5
