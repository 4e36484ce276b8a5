"""What a test process needs before rclpy is imported: a ROS domain of its own, a place for logs."""

import fcntl
import os
import random
import socket
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import IO

import hypothesis
import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
DOMAINS = range(1, 102)  # above 101 DDS ports meet those Linux lends to any program


def claim_domain() -> tuple[int, IO[bytes]]:
    """Return a ROS domain that no other test process holds and no program listens on, and its lock.

    The lock lasts as long as the file returned is open.
    """
    for domain in random.SystemRandom().sample(DOMAINS, len(DOMAINS)):
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            path = Path(tempfile.gettempdir(), f'ugv_acceptance_domain_{domain}.lock')
            lock = path.open('wb')
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            probe.bind(('', 7400 + 250 * domain))  # its discovery port: taken if anybody is there
            return domain, lock
    msg = f'expected a free ROS domain in {DOMAINS.start}..{DOMAINS.stop - 1}, all are taken'
    raise RuntimeError(msg)


DOMAIN, _LOCK = claim_domain()
os.environ['ROS_DOMAIN_ID'] = str(DOMAIN)
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
_LOGS = tempfile.TemporaryDirectory(prefix='ugv_acceptance_log_')
os.environ['ROS_LOG_DIR'] = _LOGS.name

# No deadline, and cases may be slow to make: other work on the machine is no fault of the code. CI
# always takes the same cases, fewer than are tried at random here; fewer still where it runs all
# tests again, on another Python.
ANY_SPEED = hypothesis.settings(
    deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.register_profile('here', ANY_SPEED)
hypothesis.settings.register_profile(
    'ci', ANY_SPEED, derandomize=True, max_examples=60, print_blob=True
)
hypothesis.settings.register_profile('again', parent=ANY_SPEED, derandomize=True, max_examples=30)
hypothesis.settings.load_profile('ci' if os.environ.get('CI') else 'here')


@pytest.fixture(scope='session')
def repository() -> Path:
    """Return the root of this checkout."""
    return REPOSITORY


@pytest.fixture(scope='session')
def shared_bags() -> Path:
    """Return the folder of recordings made by others; skip where it is absent."""
    folder = REPOSITORY.parent / 'shared' / 'bags'
    if not folder.is_dir():
        pytest.skip('needs ../shared/bags: recordings of others, no part of this project')
    return folder
