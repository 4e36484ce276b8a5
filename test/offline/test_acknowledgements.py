"""Acknowledgements of a monitor, found again in a recording of its alerts topic."""

import shutil
from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.statuses import TYPE
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.offline.acknowledgements import add_acknowledgements

STORE = get_typestore(Stores.ROS2_JAZZY)
S = 10**9
START = 1_700_000_000 * S


def status(**values: object) -> Any:
    """Return a DiagnosticStatus of an alert on the shoulder's torque."""
    told = {'code': 'TORQUE_LIMIT', 'subject': 'shoulder', 'level': 'ERROR', **values}
    pair = STORE.types['diagnostic_msgs/msg/KeyValue']
    return STORE.types['diagnostic_msgs/msg/DiagnosticStatus'](
        level=2, name='', message='', hardware_id='',
        values=[pair(key=key, value=str(value)) for key, value in told.items()],
    )  # fmt: skip


def recorded(folder: Path, *statuses: Any, topic: str = '/acceptance_monitor/alerts') -> Path:
    """Record one message a status, a second apart, from START on."""
    header = STORE.types['std_msgs/msg/Header'](
        stamp=STORE.types['builtin_interfaces/msg/Time'](sec=0, nanosec=0), frame_id=''
    )
    with BagWriter(folder) as bag:
        bag.add_topic(topic, TYPE)
        for k, one in enumerate(statuses):
            message = STORE.types[TYPE](header=header, status=[one])
            bag.write(topic, START + k * S, bytes(STORE.serialize_cdr(message, TYPE)))
    return folder


def alert(start: float, level: str = 'ERROR') -> dict[str, Any]:
    """Return an alert of a result."""
    return {'code': 'TORQUE_LIMIT', 'subject': 'shoulder', 'level': level, 'start_s': start}


RAISED = status(state='raised', start_ns=START + 2 * S, time_ns=START + 2 * S)
SEEN = status(
    state='acknowledged', start_ns=START + 2 * S, time_ns=START + 5 * S, who='Ann', note='seen'
)


def test_an_acknowledgement_is_given_to_its_alert(tmp_path: Path) -> None:
    """By code, subject, level and start; another alert of the same joint was never seen."""
    result = {'alerts': [alert(2.1), alert(9.0), alert(2.1, 'WARN')]}
    add_acknowledgements(result, open_bag(recorded(tmp_path / 'bag', RAISED, SEEN)))
    first, other, warning = result['alerts']
    assert (first['acknowledged_s'], first['acknowledged_by'], first['note']) == (
        5.0,
        'Ann',
        'seen',
    )
    assert other['acknowledged_s'] is None
    assert warning['acknowledged_s'] is None


def test_the_first_acknowledgement_counts(tmp_path: Path) -> None:
    """Whoever acknowledges again does not make the first response later."""
    later = status(state='acknowledged', start_ns=START + 2 * S, time_ns=START + 8 * S, who='Bob')
    result = {'alerts': [alert(2.0)]}
    add_acknowledgements(result, open_bag(recorded(tmp_path / 'bag', later, SEEN)))
    assert result['alerts'][0]['acknowledged_by'] == 'Ann'


def test_the_node_that_sent_it_stands_beside_the_name(tmp_path: Path) -> None:
    """Recordings of monitors that told it have `acknowledged_from`; older ones are read without."""
    told = status(
        state='acknowledged', start_ns=START + 2 * S, time_ns=START + 5 * S, who='Ann',
        **{'from': '/acceptance_tell'},
    )  # fmt: skip
    for name, one, wanted in (('new', told, '/acceptance_tell'), ('old', SEEN, None)):
        result = {'alerts': [alert(2.0)]}
        add_acknowledgements(result, open_bag(recorded(tmp_path / name, RAISED, one)))
        (found,) = result['alerts']
        assert (found['acknowledged_by'], found.get('acknowledged_from')) == ('Ann', wanted)
        assert ('acknowledged_from' in found) == (wanted is not None)


def test_without_the_topic_nothing_is_said(tmp_path: Path) -> None:
    """Without the alerts topic, acknowledgements are unknown, not absent."""
    result = {'alerts': [alert(2.0)]}
    add_acknowledgements(result, open_bag(recorded(tmp_path / 'bag', SEEN, topic='/diagnostics')))
    assert result == {'alerts': [alert(2.0)]}


@pytest.mark.parametrize('wrong', ['', 'soon', '-5', '1e9', '²', '9' * 400, '9' * 5_000])
def test_an_acknowledgement_without_a_time_is_left_out(tmp_path: Path, wrong: str) -> None:
    """An acknowledgement whose times are no numbers is left out."""
    odd = status(state='acknowledged', start_ns=START + 2 * S, time_ns=wrong)
    result = {'alerts': [alert(2.0)]}
    add_acknowledgements(result, open_bag(recorded(tmp_path / 'bag', odd)))
    assert result['alerts'][0]['acknowledged_s'] is None


@pytest.mark.parametrize(('kept', 'seen'), [(2, 5.0), (30, None)])
def test_a_recording_that_breaks_off_gives_what_it_can(
    kept: int, seen: float | None, tmp_path: Path
) -> None:
    """The verdict does not depend on acknowledgements: a broken file is no error here."""
    folder = recorded(tmp_path / 'bag', RAISED, SEEN)
    bag = open_bag(folder)
    (path,) = bag.paths
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // kept])
    result = {'alerts': [alert(2.0)]}
    add_acknowledgements(result, bag)
    assert result['alerts'][0]['acknowledged_s'] == seen
    shutil.rmtree(folder)
