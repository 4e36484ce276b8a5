"""Checks a set-up: turns what `probe.py` received into findings, each with what to do.

What is found in the messages themselves is in inspection/, for recordings too.
"""

from collections.abc import Iterator

from ugv_acceptance.config import Config
from ugv_acceptance.inspection.checks import check_configuration, check_description, check_inputs
from ugv_acceptance.inspection.heard import FAIL, OK, WARN, Finding, Heard
from ugv_acceptance.nodes.doctor.probe import Surroundings


def examine(around: Surroundings, config: Config) -> Iterator[Finding]:
    """Yield the findings about a set-up; `config` is the robot's."""
    where = f'{around.distribution}, {around.middleware}, domain {around.domain}'
    yield Finding(OK, 'ROS', f'{where}, discovery {around.discovery}')
    if around.robot is not None:
        yield from check_description(around.robot, config)
    yield from check_configuration(config)
    if len(around.monitors) > 1:
        text = f'{len(around.monitors)} monitors of the same name run'
        yield Finding(WARN, 'monitor', text, 'stop all but one, or give them namespaces')
    yield from check_inputs(around.joint_states, around.imu, config, _topic, around.seconds)


def _topic(name: str, heard: Heard) -> Iterator[Finding]:
    if not heard.publishers:
        other = f'topics.{name}.name: {heard.alike[0].lstrip("/")}' if heard.alike else ''
        do = f'set {other} in the configuration, or remap it' if other else 'start its driver'
        if not other:
            do += '; check that ROS_DOMAIN_ID and the network are the same on both sides'
        yield Finding(FAIL, name, f'nobody publishes {heard.topic}', do)
        return
    types = sorted({kind for _, kind, _ in heard.publishers})
    if types != [heard.type]:
        text = f'{heard.topic} carries {", ".join(types)}, expected {heard.type}'
        yield Finding(FAIL, name, text, f'set topics.{name}.name to another topic')
    for node, _, reason in heard.publishers:
        if reason:
            do = f'set topics.{name}.qos to what is offered'
            yield Finding(FAIL, name, f'QoS of {node} does not match: {reason}', do)
    if len(heard.publishers) > 1:
        nodes = ', '.join(sorted(node for node, _, _ in heard.publishers))
        yield Finding(
            WARN, name, f'{heard.topic} has several publishers: {nodes}', 'stop all but one'
        )
