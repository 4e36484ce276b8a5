"""The SROS 2 policy names every topic and service of the nodes, and nobody's but their own."""

import os
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pytest
from framed_robot import robot_files
from nodes.live_case import PATIENCE, Live, live_nodes, ros_context, session_of
from nodes.test_imu_mounting import send
from nodes.tf2_type import provide_tf2_msgs
from rclpy.node import Node, NodeNameNonExistentError

from ugv_acceptance.bag.recorder import Recorder
from ugv_acceptance.config import load
from ugv_acceptance.nodes.console_feed import ConsoleNode
from ugv_acceptance.nodes.operator_client import OperatorClient, _say_load
from ugv_acceptance.nodes.recorder import RecorderNode
from ugv_acceptance.nodes.runner_world import Guard

provide_tf2_msgs()
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
    # `ros2 security` takes every child for an enclave: a comment there ends it with a traceback.
    children = ET.parse(POLICY, ET.XMLParser(target=ET.TreeBuilder(insert_comments=True)))  # noqa: S314
    assert {child.tag for child in children.find('enclaves') or ()} == {'enclave'}
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


@dataclass
class Site:
    """The nodes of a robot in their own namespace, of which a spectator asks the ROS graph."""

    live: Live
    spectator: Node

    def uses(self, node: str) -> dict[tuple[str, str], set[str]]:
        """Return the names a node uses now, by kind and right, as if in the root namespace."""
        look = self.spectator
        tells = {
            ('topics', 'publish'): look.get_publisher_names_and_types_by_node,
            ('topics', 'subscribe'): look.get_subscriber_names_and_types_by_node,
            ('services', 'reply'): look.get_service_names_and_types_by_node,
            ('services', 'request'): look.get_client_names_and_types_by_node,
        }
        found = {}
        for key, tell in tells.items():
            found[key] = set[str]()
            with suppress(NodeNameNonExistentError):  # ROS does not know the node yet
                found[key] = {name.removeprefix(OWN) for name, _ in tell(node, OWN)}
        return found

    def agree(self, node: str) -> None:
        """Wait until a node uses what it may by the policy, all of it and nothing else.

        What ROS tells of a node comes piece by piece, so it is waited for.
        """
        may = {
            (kind, right): allowed(node, kind, right)
            for kind, rights in KINDS.items()
            for right in rights
        }
        assert any(may.values()), f'{node} is not in the policy'
        end, uses = time.monotonic() + PATIENCE, self.uses(node)
        while uses != may and time.monotonic() < end:
            self.live.spin(0.1)
            uses = self.uses(node)
        for key, names in may.items():
            assert uses[key] - names == set(), f'{node} may not {key}'
            assert names - uses[key] == set(), f'{node} does not need {key}'


@pytest.fixture(scope='module')
def site() -> Iterator[Site]:
    """Give an executor and a spectator."""
    with ros_context(), live_nodes() as live:
        yield Site(live, live.add(Node('spectator')))


def test_the_monitor(site: Site, tmp_path: Path) -> None:
    """With /clock, and with /tf_static, which is heard while only that tells where the IMU is."""
    clock = '-p', 'use_sim_time:=true'
    config = str(robot_files(tmp_path, 'base_footprint'))
    space = ('-r', f'__ns:={OWN}')
    monitor = site.live.monitor(config=config, arguments=(*space, *clock))
    driver = site.live.driver(namespace=OWN)
    site.live.until(
        lambda: session_of(monitor).evaluator.mount.seeks, lambda: send(driver, 'nobody_knows')
    )
    site.agree('acceptance_monitor')


def test_the_console(site: Site) -> None:
    """Also after an operator declared a load, which it then says on its topic."""
    console = ConsoleNode(load(), namespace=OWN)
    try:
        console._operator._carry(1.0, (0.0, 0.0, 0.0))
        site.agree('acceptance_console')
    finally:
        console.close()


def test_tell(site: Site) -> None:
    """Also when it says a load that the monitor took on its topic."""
    node = site.live.add(Node('acceptance_tell', namespace=OWN))
    OperatorClient(node)
    values = {'topic': f'{OWN}/payload', 'cog_m': '0,0,0', 'mass_kg': '1', 'link': 'hand'}
    _say_load(node, values, lambda _: None)
    site.agree('acceptance_tell')


def test_the_runner(site: Site) -> None:
    """Of a plan on a real robot, without what it asks of a simulated one alone."""
    site.live.add(Guard(load(), lambda _: None, namespace=OWN))
    site.agree('acceptance_runner')


def test_the_recorder(site: Site, tmp_path: Path) -> None:
    """With all that it records if somebody publishes it: other tests' nodes do not count."""
    recorder = Recorder(tmp_path / 'recording')
    site.live.add(RecorderNode(recorder, load().topics, namespace=OWN))
    site.agree('acceptance_recorder')
    recorder.close()


def test_the_doctor(site: Site) -> None:
    """While it listens, in a process of its own."""
    code = 'from ugv_acceptance.cli import main; main()'
    doctor = [sys.executable, '-c', code, 'doctor', '--seconds', '60', '--ros-args']
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    out = subprocess.DEVNULL
    process = subprocess.Popen([*doctor, '-r', f'__ns:={OWN}'], env=env, stdout=out, stderr=out)
    try:
        site.agree('doctor')
    finally:
        process.kill()
        process.wait()


def test_nobody_but_the_driver_may_publish_the_inputs() -> None:
    """Neither the monitor nor the console nor the runner may publish joint states or the IMU."""
    for node in ('acceptance_monitor', 'acceptance_console', 'acceptance_runner'):
        assert not allowed(node, 'topics', 'publish') & {'/joint_states', '/imu/data'}
    monitor = allowed('acceptance_monitor', 'topics', 'publish')
    assert not monitor & {'/cmd_vel', '/arm_controller/joint_trajectory'}
