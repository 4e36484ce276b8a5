"""Layouts for the viewers: every topic, field and name they hold is there in a real monitor."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from defusedxml.ElementTree import parse
from nodes.live_case import Driver, Live
from rclpy.node import Node

from ugv_acceptance.config import load
from ugv_acceptance.monitoring.footprint import TILTS
from ugv_acceptance.nodes.bag_player import message_type

JOINTS = load().settings.robot.joint_names
# Panels both viewers have, by the name in their code.
PANELS = {'3D', 'DiagnosticSummary', 'RawMessages', 'StateTransitions', 'Plot'}


@pytest.fixture
def robot(live: Live) -> Driver:
    """Return a driver beside a running monitor."""
    monitor, driver = live.monitor(), live.driver()
    live.until(driver.connected)
    live.until(lambda: {p.topic_name for p in monitor.publishers} <= topics(driver).keys())
    return driver


def topics(node: Node) -> dict[str, str]:
    """Return the topics of the graph with their types."""
    return {name: types[0] for name, types in node.get_topic_names_and_types()}


def panels(tree: object) -> Iterator[str]:
    """Yield the panels that a layout's tree names."""
    if isinstance(tree, str):
        yield tree
    elif isinstance(tree, dict):
        yield from panels(tree['first'])
        yield from panels(tree['second'])


def resolve(path: str, known: dict[str, str]) -> None:
    """Walk a message path of Foxglove: /topic.field.field[0]; fail where it leads nowhere."""
    topic, *names = re.split(r'\.(?=[a-z])', path)
    assert topic in known, f'{path}: no such topic'
    kind: Any = message_type(known[topic])
    for name in names:
        fields = kind.get_fields_and_field_types()
        bare = name.partition('[')[0]
        assert bare in fields, f'{path}: {kind.__name__} has no {bare}'
        kind = fields[bare]


@pytest.mark.parametrize('viewer', ['foxglove', 'lichtblick'])
def test_every_path_of_a_layout_leads_somewhere(
    robot: Driver, repository: Path, viewer: str
) -> None:
    """Each panel shown is configured, of a kind both viewers have, and on a topic that exists."""
    layout = json.loads((repository / 'layouts' / f'{viewer}.json').read_text())
    known, config = topics(robot), layout['configById']
    assert set(panels(layout['layout'])) == set(config)
    assert {name.partition('!')[0] for name in config} == PANELS
    paths = [p['value'] for panel in config.values() for p in panel.get('paths', [])]
    paths += [
        panel[k] for panel in config.values() for k in ('topicPath', 'topicToRender') if k in panel
    ]
    paths += list(config['3D!scene']['topics'])
    assert len(paths) >= 10
    for path in paths:
        resolve(path, known)


def test_every_curve_of_plotjuggler_is_a_series(robot: Driver, repository: Path) -> None:
    """Curves are named topic/name/field, as PlotJuggler names the series of a JointState."""
    curves = [
        c.get('name') for c in parse(repository / 'layouts' / 'plotjuggler.xml').iter('curve')
    ]
    known = topics(robot)
    assert len(curves) == 8
    for curve in curves:
        topic, name, field = str(curve).rsplit('/', 2)
        assert known[topic] == 'sensor_msgs/msg/JointState'
        assert name in (TILTS if topic.endswith('stability') else JOINTS)
        assert field in {'position', 'effort'}


def test_rviz_shows_the_markers(robot: Driver, repository: Path) -> None:
    """RViz's fixed frame and marker topic are the monitor's."""
    text = (repository / 'rviz' / 'ugv_acceptance.rviz').read_text()
    manager = yaml.safe_load(text)['Visualization Manager']
    shown = [d['Topic']['Value'] for d in manager['Displays'] if 'Topic' in d]
    assert [topics(robot)[topic] for topic in shown] == ['visualization_msgs/msg/MarkerArray']
    assert manager['Global Options']['Fixed Frame'] == 'base_link'


def test_every_status_has_an_analyzer(live: Live, robot: Driver, repository: Path) -> None:
    """Each status on /diagnostics belongs to exactly one analyzer, and each analyzer has one."""
    live.until(lambda: len(robot.diagnostics) >= 7, robot.send)
    text = (repository / 'config' / 'diagnostic_aggregator.yaml').read_text()
    parameters = yaml.safe_load(text)['/**']['ros__parameters']
    words = [a['contains'][0] for a in parameters.values() if isinstance(a, dict)]
    owners = {name: [w for w in words if w in name] for name in robot.diagnostics}
    assert all(len(owner) == 1 for owner in owners.values()), owners
    assert {owner[0] for owner in owners.values()} == set(words)
