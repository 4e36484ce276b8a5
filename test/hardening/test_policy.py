"""The SROS 2 policy names every topic and service of the nodes, and nobody's but their own."""

import ast
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from nodes.live_case import Live, live_nodes, ros_context
from rclpy.node import NodeNameNonExistentError

POLICY = Path(__file__).parents[2] / 'sros2' / 'policy.xml'
NODES = Path(__file__).parents[2] / 'ugv_acceptance' / 'nodes'
# Other tests' monitors, killed a moment ago, are still known to ROS; none of them is in here.
OWN = '/policy'
KINDS = {'topics': {'publish', 'subscribe'}, 'services': {'reply', 'request'}}


def allowed(node: str, kind: str, right: str) -> set[str]:
    """Return the full names a node may use so."""
    found = set()
    for profile in ET.parse(POLICY).iter('profile'):  # noqa: S314 (our own file)
        if profile.get('node') != node:
            continue
        for group in profile.findall(kind):
            if group.get(right) == 'ALLOW':
                found |= {full(node, str(item.text)) for item in group}
    return found


def full(node: str, name: str) -> str:
    """Return the full name in the root namespace."""
    name = name.replace('~', f'/{node}')
    return name if name.startswith('/') else f'/{name}'


def test_it_has_the_form_of_a_policy() -> None:
    """Version, enclaves, profiles, and in them rules that allow or deny topics and services."""
    root = ET.parse(POLICY).getroot()  # noqa: S314 (our own file)
    assert (root.tag, root.get('version')) == ('policy', '0.2.0')
    assert [child.tag for child in root] == ['enclaves']
    for enclave in root[0]:
        assert enclave.tag == 'enclave'
        (profile,) = enclave.findall('profiles/profile')
        assert enclave.get('path') == f'/{profile.get("node")}'
        for group in profile:
            assert set(group.attrib) <= KINDS[group.tag]
            assert set(group.attrib.values()) == {'ALLOW'}
            names = [item.text for item in group]
            assert {item.tag for item in group} == {group.tag.removesuffix('s')}
            assert len(names) == len(set(names))


@pytest.fixture
def live() -> Iterator[Live]:
    """Give nodes of a test's own."""
    with ros_context(), live_nodes() as found:
        yield found


def test_the_monitor_uses_just_what_it_may(live: Live) -> None:
    """All topics and services of a running monitor, as ROS tells them, are those of the policy."""
    node = 'acceptance_monitor'
    monitor = live.monitor(publish_rate=0.0, arguments=('-r', f'__ns:={OWN}'))
    tells = {
        ('topics', 'publish'): monitor.get_publisher_names_and_types_by_node,
        ('topics', 'subscribe'): monitor.get_subscriber_names_and_types_by_node,
        ('services', 'reply'): monitor.get_service_names_and_types_by_node,
    }
    live.until(lambda: all(_used(tell, node) for tell in tells.values()))
    for (kind, right), tell in tells.items():
        assert _used(tell, node) <= allowed(node, kind, right)


def _used(tell: Callable[[str, str], list[tuple[str, list[str]]]], node: str) -> set[str]:
    """Return the names ROS tells of a node; none while it does not know the node yet."""
    with suppress(NodeNameNonExistentError):
        return {name.removeprefix(OWN) for name, _ in tell(node, OWN)}
    return set()


def test_every_topic_in_the_code_is_in_the_policy() -> None:
    """Each name given to a publisher or subscription in nodes/ that is a text stands in it."""
    known = set(re.findall(r'<topic>(.*?)</topic>', POLICY.read_text(encoding='utf-8')))
    known |= {name.replace('/acceptance_monitor/', '~/') for name in known}
    missing = []
    for path in NODES.rglob('*.py'):
        if path.name in {'packbot_simulator.py', 'bag_player.py'}:  # tools of a test bench
            continue
        for call in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(call, ast.Call) and getattr(call.func, 'attr', '').startswith(
                ('create_publisher', 'create_subscription')
            ):
                name = call.args[1]
                if isinstance(name, ast.Constant) and name.value not in known:
                    missing.append(f'{path.name}: {name.value!r}')
    assert missing == []


def test_nobody_but_the_driver_may_publish_the_inputs() -> None:
    """Neither the monitor nor the console nor the runner may publish joint states or the IMU."""
    for node in ('acceptance_monitor', 'acceptance_console', 'acceptance_runner'):
        assert not allowed(node, 'topics', 'publish') & {'/joint_states', '/imu/data'}
    monitor = allowed('acceptance_monitor', 'topics', 'publish')
    assert not monitor & {'/cmd_vel', '/arm_controller/joint_trajectory'}
