"""Numbers as people write them in ROS parameters: integers for doubles, lists of both, none."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rclpy
from hypothesis import given
from hypothesis import strategies as st
from nodes.live_case import Live, session_of
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter, get_parameter_value

from ugv_acceptance import BadConfig
from ugv_acceptance.config.yaml_numbers import with_doubles
from ugv_acceptance.nodes.parameter_types import Kind, fitted

MONITOR = 'ugv_acceptance.nodes.monitor.node'
PLAYER = 'ugv_acceptance.nodes.bag_player'
SIMULATOR = 'ugv_acceptance.nodes.packbot_simulator'
AT = '/acceptance_monitor'


@contextmanager
def node(module: str, *arguments: str) -> Iterator['subprocess.Popen[str]']:
    """Run a node as its console script does, and end it."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = f'import sys; from {module} import main; main()'
    process = subprocess.Popen(
        [sys.executable, '-c', code, '--ros-args', *arguments],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)


parameter_from: Any = Parameter.from_parameter_msg


def values_of(live: Live, at: str, *names: str) -> list[Any]:
    """Return parameters as others get them."""
    answer = live.call(GetParameters, f'{at}/get_parameters', GetParameters.Request(names=names))
    return [(v.type, v.double_value or list(v.double_array_value)) for v in answer.values]


def put(live: Live, at: str, **values: str) -> list[tuple[bool, str]]:
    """Set parameters as `ros2 param set` does, from the text of its argument."""
    given = [
        ParameterMessage(name=name.replace('__', '.'), value=get_parameter_value(text))
        for name, text in values.items()
    ]
    request = SetParameters.Request(parameters=given)
    results = live.call(SetParameters, f'{at}/set_parameters', request).results
    return [(result.successful, result.reason) for result in results]


DOUBLE, DOUBLES = ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_DOUBLE_ARRAY
FILE = """
/**:
  ros__parameters:
    publish_rate: 10
    limits: {tip_warn_deg: 12}
    joints.shoulder_joint.limit_nm: 40
    payload: {cog_m: [0, 0.05, 0], mass_kg: 2}
    allowed_publishers: []
"""


def test_a_monitor_starts_with_integers_in_its_file_and_arguments(
    live: Live, tmp_path: Path
) -> None:
    """All of them are doubles to others; `-p` counts before the file, as in ROS."""
    file = tmp_path / 'parameters.yaml'
    file.write_text(FILE, encoding='utf-8')
    given = ['--params-file', str(file), '-p', 'limits.tip_warn_deg:=11', '-p', 'delays.off_s:=2']
    with node(MONITOR, *given):
        names = ('publish_rate', 'limits.tip_warn_deg', 'delays.off_s', 'payload.mass_kg')
        told = values_of(live, AT, *names, 'joints.shoulder_joint.limit_nm', 'payload.cog_m')
        numbers = [(DOUBLE, x) for x in (10.0, 11.0, 2.0, 2.0, 40.0)]
        assert told == [*numbers, (DOUBLES, [0.0, 0.05, 0.0])]


def test_a_simulator_starts_with_integers(live: Live) -> None:
    """Rates and the posture at the start."""
    given = ('rate:=1', 'joint_rate:=50', 'imu_rate:=50', 'home:=[0, 2, -2.5, 2]')
    with node(SIMULATOR, *(word for one in given for word in ('-p', one))):
        told = values_of(live, '/packbot_simulator', 'rate', 'joint_rate', 'imu_rate', 'home')
        numbers = [(DOUBLE, x) for x in (1.0, 50.0, 50.0)]
        assert told == [*numbers, (DOUBLES, [0.0, 2.0, -2.5, 2.0])]


def test_a_player_takes_an_integer_rate(live: Live, repository: Path) -> None:
    """`rate:=1` is a number."""
    bag = f'bag:={repository / "bags" / "packbot_pass"}'
    with node(PLAYER, '-p', bag, '-p', 'rate:=1', '-p', 'loop:=true'):
        watcher = live.add(rclpy.create_node('watcher'))
        live.until(lambda: watcher.count_publishers('joint_states'))


@pytest.mark.parametrize(
    ('module', 'argument', 'said'),
    [
        (MONITOR, 'publish_rate:=fast', "parameter publish_rate: expected a number, got 'fast'"),
        (MONITOR, 'use_sim_time:=1', "'use_sim_time' to '1'"),
        (MONITOR, 'payload.cog_m:=[0, b]', 'payload.cog_m:=[0, b]'),
        (PLAYER, 'rate:=true', 'parameter rate: expected a number, got true'),
        (SIMULATOR, 'seed:=1.5', 'parameter seed: expected an integer, got 1.5'),
    ],
)
def test_a_wrong_type_at_the_start_is_one_line(module: str, argument: str, said: str) -> None:
    """It names the parameter, what was expected and what came; exit code 2, no traceback."""
    with node(module, '-p', argument) as process:
        assert process.stderr
        lines = process.stderr.read().splitlines()
        assert process.wait(60) == 2
    # rcl logs a line of its own about arguments that it cannot read.
    (last,) = [line for line in lines if not line.startswith('[ERROR]')]
    assert last.startswith('ugv-acceptance: ')
    assert said in last


@pytest.mark.parametrize(
    ('argument', 'said'),
    [
        ('publish_rate:=-1', 'parameter publish_rate: expected 0 to 10000, got -1'),
        ('depth:=0', 'parameter depth: expected 1 to 100000, got 0'),
        ('config:=7', 'parameter config: expected a text, got 7, an integer'),
        ('payload.cog_m:=[a, b]', 'parameter payload.cog_m: expected a list of numbers'),
        ('payload.cog_m:=[]', 'parameter payload.cog_m: expected a list of numbers, got an empty'),
        ('payload.cog_m:=[0, 1]', 'payload.cog_m: expected three finite numbers'),
        ('limits.tip_warn_deg:=no', 'limits.tip_warn_deg: expected a number, got false'),
        ('allowed_publishers:=/driver', 'allowed_publishers: expected a list of texts'),
        ('joints.shoulder_joint.limit_nm:=true', 'limit_nm: expected a number, got true'),
    ],
)
def test_a_value_that_does_not_fit_its_parameter_is_a_bad_configuration(
    live: Live, argument: str, said: str
) -> None:
    """Of parameters of the node and of the robot: said with the name."""
    with pytest.raises(BadConfig, match=re.escape(said)):
        live.monitor(arguments=('-p', argument))


def test_integers_are_taken_at_run_time_and_stay_doubles(live: Live) -> None:
    """From `ros2 param set`: an integer, a list of integers, a mixed one, which comes as a text."""
    monitor = live.monitor()
    limits = {'limits__tip_warn_deg': '12', 'joints__shoulder_joint__limit_nm': '40'}
    assert put(live, AT, publish_rate='5', **limits) == [(True, '')] * 3
    for text in ('[0, 0, 1]', '[0, 0.5, 0]', '[0.5, 0.25, -1.0]'):
        assert put(live, AT, payload__cog_m=text) == [(True, '')]
        assert list(session_of(monitor).settings.robot.payload.cog) == json.loads(text)
    names = ['limits.tip_warn_deg', 'publish_rate', 'payload.cog_m']
    told = values_of(live, AT, *names)
    assert told == [(DOUBLE, 12.0), (DOUBLE, 5.0), (DOUBLES, [0.5, 0.25, -1.0])]
    request = DescribeParameters.Request(names=names)
    found = live.call(DescribeParameters, f'{AT}/describe_parameters', request).descriptors
    assert [d.type for d in found] == [DOUBLE, DOUBLE, DOUBLES]


@pytest.mark.parametrize(
    ('name', 'text', 'reason'),
    [
        ('limits__tip_warn_deg', 'true', 'limits.tip_warn_deg: expected a number, got true'),
        (
            'limits__tip_warn_deg',
            'ten',
            "limits.tip_warn_deg: expected a number, got 'ten', a text",
        ),
        (
            'limits__tip_warn_deg',
            '[10]',
            'limits.tip_warn_deg: expected a number, got [10], a list',
        ),
        ('payload__cog_m', '[true, false, true]', 'payload.cog_m: expected a list of numbers'),
        ('payload__cog_m', '[0, a, 1]', 'payload.cog_m: expected a list of numbers'),
        ('payload__cog_m', '7', 'payload.cog_m: expected a list of numbers, got 7'),
        ('hand_may_touch', '1', 'hand_may_touch: expected true or false, got 1'),
        ('frame_prefix', '1', 'frame_prefix: expected a text, got 1'),
        ('allowed_publishers', 'false', 'allowed_publishers: expected a list of texts, got false'),
        ('allowed_publishers', '[1]', 'allowed_publishers: expected a list of texts, got [1]'),
    ],
)
def test_what_is_no_number_is_refused_by_name(
    live: Live, name: str, text: str, reason: str
) -> None:
    """With what was expected and what came; nothing changes."""
    monitor = live.monitor()
    before = session_of(monitor).settings
    told = ParameterMessage(name=name.replace('__', '.'), value=get_parameter_value(text))
    result = monitor.set_parameters_atomically([parameter_from(told)])
    assert not result.successful
    assert result.reason.startswith(f'parameter {reason}')
    assert session_of(monitor).settings == before


EMPTY = [
    get_parameter_value('[]'),
    get_parameter_value("['']"),
    ParameterValue(type=ParameterType.PARAMETER_NOT_SET),
    ParameterValue(type=ParameterType.PARAMETER_BYTE_ARRAY),
    ParameterValue(type=ParameterType.PARAMETER_INTEGER_ARRAY),
    ParameterValue(type=ParameterType.PARAMETER_STRING_ARRAY),
]


def test_an_empty_list_of_any_type_empties_the_allowed_publishers(live: Live) -> None:
    """Clients cannot tell the type of an empty list, so any will do."""
    monitor = live.monitor(allowed_publishers=['/other'])
    for empty in EMPTY:
        told = ParameterMessage(name='allowed_publishers', value=empty)
        result = monitor.set_parameters_atomically([parameter_from(told)])
        assert (result.successful, result.reason) == (True, '')
        assert monitor.get_parameter('allowed_publishers').value == ['']


def test_without_allowed_publishers_nobody_is_foreign(live: Live) -> None:
    """As soon as the list is emptied while the monitor runs."""
    monitor, driver = live.running(allowed_publishers=['/other'])
    live.until(lambda: any('FOREIGN' in a.name for a in driver.alerts), driver.send)
    assert put(live, AT, allowed_publishers='[]') == [(True, '')]
    foreign = 'FOREIGN_PUBLISHER'
    live.until(lambda: all(a.rule.code != foreign for a in session_of(monitor).active), driver.send)


@given(st.one_of(st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False)))
def test_every_number_is_a_number(value: float) -> None:
    """In the type of the parameter, with its value."""
    found = fitted('x', value, Kind.DOUBLE)
    assert (type(found), found) == (float, float(value))


@given(st.one_of(st.booleans(), st.text(), st.none(), st.lists(st.integers())))
def test_nothing_else_is_a_number(value: object) -> None:
    """No bool, no text, no list, not even of one number."""
    with pytest.raises(BadConfig, match=r'^parameter x: expected a number, got '):
        fitted('x', value, Kind.DOUBLE)


@pytest.mark.parametrize(
    ('text', 'read'),
    [
        ('[0, 0.5]', '[0.0, 0.5]'),
        ('a: [1e-3, -2, +3] # [1, 2.5]', 'a: [1e-3, -2.0, +3.0] # [1, 2.5]'),
        ('a:\n  - 1\n  - 2.5\nb: [1, 2]\n', 'a:\n  - 1.0\n  - 2.5\nb: [1, 2]\n'),
        ('[1, 2]', '[1, 2]'),
        ('[0.5, true]', '[0.5, true]'),
        ("[1, '2.5']", "[1, '2.5']"),
        ('[1, 2.5', '[1, 2.5'),
        ('', ''),
    ],
)
def test_only_integers_beside_doubles_are_rewritten(text: str, read: str) -> None:
    """What rcl can read stays byte for byte, and so does what it will complain of."""
    assert with_doubles(text) == read
