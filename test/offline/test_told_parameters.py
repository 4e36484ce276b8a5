"""What the live monitor judged by, as it was recorded, is held against what is judged by here."""

from collections.abc import Mapping
from pathlib import Path

import ugv_acceptance as ugv
from ugv_acceptance.bag.encode import inertia_cdr
from ugv_acceptance.bag.raw import messages, offered
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.bag.told_parameters import TYPE, parameters_in, parameters_message
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.offline.evaluation import Evaluation

TOPIC = '/acceptance_monitor/parameters_in_force'
# Those of PackBot's configuration.
SAME = {'limits.torque_warn': 0.8, 'ground.kind': '', 'hand_may_touch': False, 'depth': 1000}
HASH = 'a9bbd539bdddd5da'


def run_with(
    repository: Path,
    folder: Path,
    *told: bytes,
    run: str = 'packbot_pass',
    load: float | None = None,
) -> Path:
    """Copy a recorded run and write messages of the monitor's parameters into it, at its start."""
    source = open_bag(repository / 'bags' / run)
    with BagWriter(folder) as bag:
        for name, topic in source.topics.items():
            bag.add_topic(name, topic.type, Qos(offered(source)[name].reliability))  # type: ignore[arg-type]
        bag.add_topic(TOPIC, TYPE)
        for data in told:
            bag.write(TOPIC, source.start_ns + 10**9, data)
        for message in messages(source, source.topics):
            data = message.data
            if load is not None and message.topic == '/payload':
                data = inertia_cdr(message.log_time, 'gripper_link', load, (0.0,) * 3)
            bag.write(message.topic, message.log_time, data)
    return folder


def parameters(values: Mapping[str, object], limits_hash: str = HASH) -> bytes:
    """Return a message of parameters."""
    return parameters_message('/acceptance_monitor', values, limits_hash)


def remark(judged: Evaluation) -> str:
    """Return what is said of the monitor's parameters; empty: nothing."""
    found = [one['why'] for one in judged.result['not_checked'] if 'monitor' in one['what']]
    return ' '.join(found)


def test_the_same_parameters_need_no_remark(repository: Path, tmp_path: Path) -> None:
    """Nothing changes where the monitor judged by what is judged by here."""
    judged = ugv.evaluate(run_with(repository, tmp_path / 'run', parameters(SAME)))
    assert (judged.verdict, remark(judged)) == ('PASS', '')
    assert judged.result['limits_hash'] == HASH


def test_other_parameters_are_named_with_both_values(repository: Path, tmp_path: Path) -> None:
    """Under NOT CHECKED, for the alerts of the monitor were others: four at most, and how many."""
    others: dict[str, object] = {
        'limits.torque_warn': 0.5,
        'joints.elbow_joint.limit_nm': 20.0,
        'ground.kind': 'stairs',
        'hand_may_touch': True,
        'imu.attitude': 'accelerometer',
    }
    run = run_with(repository, tmp_path / 'run', parameters(SAME | others))
    told = remark(ugv.evaluate(run))
    assert 'limits.torque_warn 0.5, here 0.8' in told
    assert 'joints.elbow_joint.limit_nm 20, here 50' in told
    assert "imu.attitude 'accelerometer', here 'auto'" in told
    assert told.endswith('and 1 more')


def test_another_hash_is_told_where_no_parameter_says_more(
    repository: Path, tmp_path: Path
) -> None:
    """A threshold that is no parameter may be another."""
    run = run_with(repository, tmp_path / 'run', parameters(SAME, '0123456789abcdef'))
    assert f'limits_hash 0123456789abcdef, here {HASH}' in remark(ugv.evaluate(run))


def test_a_load_that_only_the_monitor_knew_keeps_from_a_pass(
    repository: Path, tmp_path: Path
) -> None:
    """Unless it is given for the evaluation."""
    carried = {**SAME, 'payload.mass_kg': 2.75, 'payload.cog_m': [0.0, 0.0, 0.0]}
    run = run_with(repository, tmp_path / 'run', parameters(carried), load=0.0)
    judged = ugv.evaluate(run)
    assert judged.verdict == 'INCONCLUSIVE'
    assert 'the monitor carried 2.75 kg, 0 kg are judged here' in judged.reasons[0]
    told = run_with(repository, tmp_path / 'told', parameters(carried), load=2.75)
    assert 'carried' not in str(ugv.evaluate(told).reasons)


def test_a_fail_stays_one(repository: Path, tmp_path: Path) -> None:
    """Another load makes no FAIL doubtful, but it is said."""
    carried = {**SAME, 'payload.mass_kg': 0.5, 'payload.cog_m': [0.0, 0.0, 0.0]}
    run = run_with(repository, tmp_path / 'run', parameters(carried), run='packbot_fail')
    judged = ugv.evaluate(run)
    assert judged.verdict == 'FAIL'
    assert 'the monitor carried 0.5 kg' in remark(judged)


def test_what_is_no_message_of_parameters_tells_nothing(repository: Path, tmp_path: Path) -> None:
    """Cut, garbled, empty: the verdict is that of the other messages."""
    wrong = (b'', b'\x00\x01\x00\x00', bytes(60), parameters(SAME)[:-9], b'\xff' * 200)
    run = run_with(repository, tmp_path / 'run', *wrong)
    assert not [told for told in parameters_in(open_recording(run)) if told.values]
    assert ugv.evaluate(run).verdict == 'PASS'


def test_values_come_back_as_they_were(repository: Path, tmp_path: Path) -> None:
    """Numbers with all their digits, lists, texts with quotes and umlauts."""
    values = {'a': 0.1 + 0.2, 'b': [1.5, -2.0], 'c': 'a "ü" b', 'd': True, 'e': 7, 'f': ['', 'x']}
    run = run_with(repository, tmp_path / 'run', parameters(values))
    (told,) = parameters_in(open_recording(run))
    assert (dict(told.values), told.limits_hash, told.topic) == (values, HASH, TOPIC)
