"""A real S3 server on loopback for the tests of campaigns, and what was asked of it."""

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest

BUCKET = 'acceptance'
_ASKED = re.compile(r'"(?:\x1b\S*?m)?([A-Z]+) /(\S*)')


@dataclass(frozen=True, slots=True)
class Bucket:
    """A bucket of moto's S3 server in this process, its URL, and its objects as moto holds them."""

    url: str
    held: Any

    def put(self, folder: Path, at: str) -> str:
        """Put all files of a folder into the bucket as of an hour ago; return their URL."""
        for file in sorted(p for p in folder.rglob('*') if p.is_file()):
            self.write(f'{at}/{file.relative_to(folder).as_posix()}', file.read_bytes())
        return f'{self.url}/{at}'

    def write(self, name: str, content: bytes, age_s: float = 3600.0) -> None:
        """Write an object that was last modified so long ago (s)."""
        self.held.put_object(BUCKET, name, content)
        self.date(name, age_s)

    def date(self, name: str, age_s: float) -> None:
        """Date the last modification of an object, in whole seconds as S3 does."""
        moment = datetime.now(timezone.utc) - timedelta(seconds=age_s)
        self.held.get_object(BUCKET, name).last_modified = moment.replace(
            microsecond=0, tzinfo=None
        )


@contextmanager
def s3_server() -> Iterator[Bucket]:
    """Serve a bucket; fsspec of this process and its children finds it meanwhile."""
    server_module = pytest.importorskip('moto.server', reason='moto is not installed')
    pytest.importorskip('s3fs', reason='extra cluster is not installed')
    fsspec = pytest.importorskip('fsspec')
    models = pytest.importorskip('moto.s3.models')
    server = server_module.ThreadedMotoServer(ip_address='127.0.0.1', port=0, verbose=False)
    server.start()
    patch = pytest.MonkeyPatch()
    try:
        host, port = server.get_host_and_port()
        for name, value in (
            ('FSSPEC_S3_ENDPOINT_URL', f'http://{host}:{port}'),
            ('FSSPEC_S3_KEY', 'nobody'),
            ('FSSPEC_S3_SECRET', 'secret'),
            ('NO_PROXY', '127.0.0.1'),
            ('AWS_EC2_METADATA_DISABLED', 'true'),
        ):
            patch.setenv(name, value)
        access = {'endpoint_url': f'http://{host}:{port}', 'key': 'nobody', 'secret': 'secret'}
        patch.setitem(fsspec.config.conf, 's3', access)
        held = models.s3_backends['123456789012']['aws']
        if BUCKET not in held.buckets:  # moto keeps it when a server stops
            held.create_bucket(BUCKET, 'us-east-1')
        yield Bucket(f's3://{BUCKET}', held)
    finally:
        patch.undo()
        server.stop()


class Asked(logging.Handler):
    """The requests that the server answered, as pairs of a method and a path."""

    def __init__(self) -> None:
        """Begin with none."""
        super().__init__()
        self.requests: list[tuple[str, str]] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep the request of a line of the server's log."""
        if found := _ASKED.search(record.getMessage()):
            self.requests.append((found[1], found[2]))


@contextmanager
def asked() -> Iterator[list[tuple[str, str]]]:
    """Collect the requests that are answered meanwhile."""
    log, handler = logging.getLogger('werkzeug'), Asked()
    before = log.level
    log.setLevel(logging.INFO)
    log.addHandler(handler)
    try:
        yield handler.requests
    finally:
        log.removeHandler(handler)
        log.setLevel(before)
