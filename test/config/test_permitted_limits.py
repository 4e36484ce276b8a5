"""Limits that would disarm an alert: refused in a file, or taken and told with their reason."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from config.robot_files import YAML, write_robot
from evaluation.streams import T0

from ugv_acceptance import BadConfig
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.cli.verify import again, compare
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.inputs.timeouts import WINDOW, InputTimeout
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.permitted_limits import RANGES, Permitted, limits_hash, relaxed
from ugv_acceptance.evaluation.settings import Delays
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.judge import judge
from ugv_acceptance.report.format import doubts_of

MS, S = 1_000_000, 1_000_000_000
WHY = 'bench test, robot tied down'
each = pytest.mark.parametrize('of', RANGES, ids=lambda of: of.name)


def yaml_of(of: Permitted, value: float, extra: str = '') -> str:
    """Return a robot's file with one value, in its unit, and with what makes the pair fit."""
    pairs = {of.name.rpartition('.')[2]: value}
    if of.key in {'tip_warn', 'tip_error'}:
        pairs = {'tip_warn_deg': value, 'tip_error_deg': value}
    if of.key in {'torque_warn', 'torque_error'}:
        pairs = {'torque_warn': value, 'torque_error': value}
    lines = ''.join(f'  {key}: {number!r}\n' for key, number in pairs.items())
    if len(of.path) == 1:
        return f'{YAML}{of.name}: {value!r}\n{extra}'
    return f'{YAML}{of.path[0]}:\n{lines}{extra}'


def beyond(of: Permitted) -> list[float]:
    """Return values outside the range that a reason permits."""
    found = [(of.most + of.ceiling) / 2.0] if of.ceiling > of.most else []
    return found + ([(of.least + of.floor) / 2.0] if of.floor < of.least else [])


@each
def test_a_file_with_a_value_beyond_its_range_is_refused(of: Permitted, tmp_path: Path) -> None:
    """One line says file, key, range, that unsafe_limits would permit it, and what came."""
    assert beyond(of)
    for value in beyond(of):
        with pytest.raises(BadConfig) as error:
            load(write_robot(tmp_path, yaml_of(of, value)))
        text = str(error.value)
        assert re.search(r'two\.yaml:\d+: ', text)
        # tip_warn and tip_error, torque_warn and torque_error come together: the first is named.
        assert of.path[-1].partition('_')[0] in text
        assert f'{of.least:g} to {of.most:g}' in text
        assert 'unsafe_limits' in text
        assert f'got {value:g}' in text
        assert '\n' not in text


@each
def test_with_a_reason_it_is_taken_and_warned_of(of: Permitted, tmp_path: Path) -> None:
    """The value is in force, and a warning names it with the reason."""
    for value in beyond(of):
        reason = f'unsafe_limits: {WHY}\n'
        config = load(write_robot(tmp_path, yaml_of(of, value, reason)))
        assert of.value(config.settings) == pytest.approx(value)
        assert of.name in {breach.name for breach in relaxed(config.settings)}
        assert any(of.name in text and WHY in text for text in config.warnings)


@each
def test_no_reason_permits_what_cannot_be_meant(of: Permitted, tmp_path: Path) -> None:
    """A value beyond the second range is refused even with a reason in unsafe_limits."""
    text = yaml_of(of, 2.0 * of.ceiling, f'unsafe_limits: {WHY}\n')
    with pytest.raises(BadConfig, match='unsafe_limits'):
        load(write_robot(tmp_path, text))


@each
def test_the_ends_of_a_range_are_inside_it(of: Permitted, tmp_path: Path) -> None:
    """Files whose limits are inside the ranges need no reason and give no warning."""
    for value in (of.least, of.most):
        settings = load(write_robot(tmp_path, yaml_of(of, value))).settings
        assert relaxed(settings) == []
        assert of.value(settings) == pytest.approx(value)


@pytest.mark.parametrize('reason', ['""', '"  "', '"a\\nb"', f'"{"x" * 201}"', '1', 'true'])
def test_a_reason_that_says_nothing_is_refused(reason: str, tmp_path: Path) -> None:
    """A reason that is empty, blank, too long, of several lines or no text is refused."""
    with pytest.raises(BadConfig, match=r'two\.yaml:\d+: unsafe_limits: ') as error:
        load(write_robot(tmp_path, f'{YAML}unsafe_limits: {reason}\n'))
    assert '\n' not in str(error.value)


def test_what_ships_is_inside_the_ranges() -> None:
    """The configuration that ships relaxes no limit."""
    assert relaxed(load().settings) == []


@pytest.mark.parametrize('period', [1, 20, 100, 700, 1000, 30_000, 10_000_000])
@pytest.mark.parametrize('after', [0.1, 2.0])
@pytest.mark.parametrize('periods', [1.0, 3.0, 100.0, 1000.0])
def test_silence_above_two_seconds_is_always_stale(
    period: int, after: float, periods: float
) -> None:
    """An input silent for more than 2 s is stale, whatever its period, live and of columns."""
    one, many = (InputTimeout(Delays(stale_after=after, stale_periods=periods)) for _ in range(2))
    times = T0 + np.arange(2 * WINDOW) * period * MS
    for now in times.tolist():
        one.message(now)
    many.messages(times)
    assert one.limit == many.limit
    assert after * S <= one.limit <= 2 * S


def test_other_delays_count_at_once() -> None:
    """New delays count at once for a period that is already known."""
    fresh = InputTimeout(Delays())
    for k in range(WINDOW + 1):
        fresh.message(T0 + k * 100 * MS)
    assert fresh.limit == 300 * MS
    fresh.judge_by(Delays(stale_after=1.5))
    assert fresh.limit == 1500 * MS


def record(folder: Path, seconds: float = 5.0) -> Path:
    """Record a robot that stands still."""
    with BagWriter(folder) as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState', Qos())
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu', Qos())
        for k in range(int(seconds * 100)):
            now = T0 + k * 10 * MS
            names, q = ('lift', 'slide'), (0.0, 0.0)
            writer.write('/joint_states', now, joint_state_cdr(now, '', names, q))
            force = (0.0, 0.0, 9.81)
            writer.write(
                '/imu/data', now, imu_cdr(now, '', (0.0, 0.0, 0.0, 1.0), (0.0,) * 3, force)
            )
    return folder


def wide(folder: Path) -> Path:
    """Return a robot's file with relaxed limits; 34 N m of 30 are within them."""
    folder.mkdir()
    limits = 'limits:\n  torque_error: 5\n  tip_error_deg: -5\ndelays:\n  fault_on_s: 30\n'
    return write_robot(folder, f'{YAML}{limits}unsafe_limits: {WHY}\n')


def judged(folder: Path, config: Path) -> dict[str, Any]:
    """Return the result of a recording, as it is written."""
    result = evaluate(record(folder), config=config).result
    return dict(json.loads(json.dumps(result)))


def test_a_pass_under_relaxed_limits_says_so(tmp_path: Path) -> None:
    """A PASS under relaxed limits names them and the reason, in result, doubts and alerts."""
    result = judged(tmp_path / 'run', wide(tmp_path / 'robot'))
    assert result['verdict'] == 'PASS'
    assert any(WHY in reason for reason in result['reasons'])
    assert any(WHY in doubt for doubt in doubts_of(result))
    told = result['limits_relaxed']
    assert told['reason'] == WHY
    names = ('limits.torque_error', 'limits.tip_error_deg', 'delays.fault_on_s')
    for name in names:
        assert any(text.startswith(name) for text in told['limits'])
    alerts = {a['subject']: a for a in result['alerts'] if a['code'] == 'LIMITS_RELAXED'}
    assert set(alerts) == set(names)
    for alert in alerts.values():
        assert (alert['level'], alert['start_s'], alert['end_s']) == ('WARN', 0.0, None)
        assert WHY in alert['message']


def test_a_run_inside_the_ranges_says_nothing_of_it(tmp_path: Path) -> None:
    """With limits inside their ranges a result holds only the limits' hash."""
    (tmp_path / 'robot').mkdir()
    result = judged(tmp_path / 'run', write_robot(tmp_path / 'robot'))
    assert result['limits_relaxed'] is None
    assert re.fullmatch('[0-9a-f]{16}', result['limits_hash'])
    assert not [a for a in result['alerts'] if a['code'] == 'LIMITS_RELAXED']


def test_relaxed_limits_are_told_live_as_of_a_bag(tmp_path: Path) -> None:
    """Relaxed limits raise the same alerts live and of a recording."""
    bag = open_bag(record(tmp_path / 'run'))
    settings = load(wide(tmp_path / 'robot')).settings
    offline = judge(Recording(bag), settings)[1].evaluator.watch.log
    live = LiveEvaluator(settings)
    live.start(bag.start_ns)
    for k in range(500):
        now = T0 + k * 10 * MS
        live.joint_state(now, now, ('lift', 'slide'), (0.0, 0.0), (), ())
        live.imu(now, now, (0.0, 0.0, 0.0, 1.0), 0.0, (0.0,) * 3, (0.0, 0.0, 9.81))
    live.tick(bag.end_ns)

    def told(log: list[Alert]) -> list[Any]:
        found = [(a.rule.code, a.rule.subject, a.start, a.end, a.peak) for a in log]
        return sorted(a for a in found if a[0] == 'LIMITS_RELAXED')

    assert len(told(live.watch.log)) == 3
    assert told(live.watch.log) == told(offline)


def test_a_result_of_before_is_still_verified(tmp_path: Path) -> None:
    """`verify` accepts a result from before the limits' hash; another hash is a difference."""
    (tmp_path / 'robot').mkdir()
    result = judged(tmp_path / 'run', write_robot(tmp_path / 'robot'))
    old = {k: v for k, v in result.items() if not k.startswith('limits_')}
    places = (tmp_path, None, None, None, None)
    assert compare(old, again(old, *places)) == []
    other = result | {'limits_hash': '0' * 16}
    assert [x.partition(':')[0] for x in compare(other, again(other, *places))] == ['limits_hash']


@each
def test_the_hash_tells_each_limit(of: Permitted) -> None:
    """The limits' hash changes with every limit, delay and threshold."""
    if of.part == 'robot':
        return
    settings = load().settings
    section = getattr(settings, of.part)
    value = getattr(section, of.key)
    other = 0.5 if math.isinf(value) else value * 1.01 + 0.001
    changed = replace(settings, **{of.part: replace(section, **{of.key: other})})
    assert limits_hash(changed) != limits_hash(settings)
    back = replace(changed, **{of.part: section})
    assert limits_hash(back) == limits_hash(settings)


def test_the_hash_tells_each_joints_limit_and_no_rounding() -> None:
    """The limits' hash changes with a joint's limit, but not with a number's last digits."""
    settings = load().settings
    found = {limits_hash(settings)}
    for j in range(len(settings.limits.torque)):
        torque = tuple(33.0 if i == j else x for i, x in enumerate(settings.limits.torque))
        found.add(limits_hash(replace(settings, limits=replace(settings.limits, torque=torque))))
    assert len(found) == 1 + len(settings.limits.torque)
    near = replace(settings.limits, tip_warn=math.nextafter(settings.limits.tip_warn, 1.0))
    assert limits_hash(replace(settings, limits=near)) == limits_hash(settings)


def test_a_deadband_never_keeps_an_alert_for_ever() -> None:
    """A deadband larger than the limit counts as half of it: less torque than that clears."""
    settings = load().settings
    limits = replace(settings.limits, torque_deadband=1000.0)
    watch = LiveEvaluator(replace(settings, limits=limits)).watch
    signals = [s for pair in watch.torque for s in pair] + watch.prediction.effort
    rules = [s.rule for s in signals if math.isfinite(s.rule.on)]
    assert rules
    assert all(rule.off == rule.on / 2.0 for rule in rules)
