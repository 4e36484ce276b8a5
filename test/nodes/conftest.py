"""rclpy once a test process, and a fresh set of nodes a test."""

from collections.abc import Iterator

import pytest
from nodes.live_case import Live, live_nodes, ros_context


@pytest.fixture(scope='session', autouse=True)
def _ros() -> Iterator[None]:
    with ros_context():
        yield


@pytest.fixture
def live() -> Iterator[Live]:
    """Return an executor for the nodes of one test."""
    with live_nodes() as nodes:
        yield nodes
