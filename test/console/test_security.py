"""The console's access rules, and a real server that applies them."""

import http.client
import json
import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from console.servers import COMMAND, console, running
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from ugv_acceptance import BadConfig
from ugv_acceptance.console.security import Guard, check_address

STATIC = Path(__file__).parents[2] / 'ugv_acceptance' / 'console' / 'static'
TOKEN = 'a-long-enough-token'  # noqa: S105 - of these tests only
EVERYWHERE = '0.0.0.0'  # noqa: S104 - what must be refused
MINE = {b'host': b'127.0.0.1:80', b'origin': b'http://127.0.0.1:80'}


@pytest.fixture(scope='module')
def guarded_url(repository: Path) -> Iterator[str]:
    """Return the address of a console that asks for a token."""
    with console(str(repository / 'bags' / 'packbot_pass'), '--token', TOKEN) as (url, _):
        yield url.partition('#')[0]


def answer(
    url: str, method: str = 'GET', path: str = '/', **headers: str
) -> http.client.HTTPResponse:
    """Return the answer to one request, read."""
    where = urlsplit(url)
    connection = http.client.HTTPConnection(str(where.hostname), where.port, timeout=60)
    connection.request(method, path, headers={k.replace('_', '-'): v for k, v in headers.items()})
    found = connection.getresponse()
    found.read()
    return found


def live(url: str, query: str = '', origin: str | None = None) -> str:
    """Open the WebSocket as a page of `origin` would; return the kind of its first message."""
    where = url.replace('http', 'ws') + f'live{query}'
    page = None if origin is None else Origin(origin)
    with connect(where, origin=page, open_timeout=60) as socket:
        return str(json.loads(socket.recv(timeout=60))['kind'])


@pytest.mark.parametrize('host', [EVERYWHERE, '192.168.1.5', '::', 'robot.local', ''])
def test_other_addresses_need_a_token(host: str) -> None:
    """Whatever others can reach is refused without a token; this machine is not."""
    with pytest.raises(BadConfig, match='--token'):
        check_address(host, None)
    check_address(host, TOKEN)


def test_a_short_token_is_none() -> None:
    """A token that can be guessed is refused, on this machine too."""
    with pytest.raises(BadConfig, match='at least 8'):
        check_address('127.0.0.1', 'short')


def test_this_machine_needs_no_token() -> None:
    """Loopback addresses are allowed as they are."""
    for host in ('127.0.0.1', 'localhost', '::1', '127.0.0.2'):
        check_address(host, None)


@pytest.mark.parametrize(
    ('host', 'bound', 'status'),
    [
        ('127.0.0.1:8770', '127.0.0.1', None),
        ('localhost:8770', '127.0.0.1', None),
        ('[::1]:8770', '::1', None),
        ('evil.example', '127.0.0.1', 400),
        ('127.0.0.1.evil.example', '127.0.0.1', 400),
        ('', '127.0.0.1', 400),
        ('192.168.1.5:8770', '127.0.0.1', 400),
        ('192.168.1.5:8770', EVERYWHERE, None),
        ('evil.example:8770', EVERYWHERE, 400),
        ('robot.local:8770', 'robot.local', None),
    ],
)
def test_host_must_be_ours(host: str, bound: str, status: int | None) -> None:
    """A request whose Host is another name, as by DNS rebinding, is refused with 400."""
    assert Guard(bound, None).refusal('GET', {b'host': host.encode()}, b'') == status


@pytest.mark.parametrize(
    ('origin', 'status'),
    [(b'http://127.0.0.1:80', None), (b'http://evil.example', 403), (b'null', 403), (b'', 403)],
)
def test_origin_must_be_ours(origin: bytes, status: int | None) -> None:
    """Only the console's own page may open the WebSocket: 403 for others, and for none."""
    headers = MINE | {b'origin': origin}
    assert Guard('127.0.0.1', None).refusal('WEBSOCKET', headers, b'') == status


@pytest.mark.parametrize(
    ('query', 'bearer', 'status'),
    [
        (b'token=a-long-enough-token', b'', None),
        (b'', b'Bearer a-long-enough-token', None),
        (b'token=wrong', b'', 403),
        (b'', b'', 403),
        (b'token=a-long-enough-token', b'Bearer wrong', 403),
    ],
)
def test_a_token_is_needed_where_there_is_one(
    query: bytes, bearer: bytes, status: int | None
) -> None:
    """With a token neither our own page nor a program gets in without it."""
    headers = MINE | {b'authorization': bearer}
    assert Guard('127.0.0.1', TOKEN).refusal('WEBSOCKET', headers, query) == status


def test_the_page_carries_its_rights(bag_url: str) -> None:
    """The page may load nothing from elsewhere, be framed by nobody, and run nothing inline."""
    found = answer(bag_url)
    assert found.status == 200
    assert str(found.getheader('content-security-policy')).startswith("default-src 'self'")
    assert 'unsafe' not in str(found.getheader('content-security-policy'))
    assert found.getheader('x-content-type-options') == 'nosniff'


def test_a_foreign_host_is_400(bag_url: str) -> None:
    """A server on this machine does not answer to other names, not even its files."""
    for path in ('/', '/static/main.js'):
        assert answer(bag_url, path=path, Host='evil.example').status == 400


def test_a_post_without_origin_or_token_is_403(bag_url: str) -> None:
    """Nothing can be posted by a program without token, nor by a foreign page."""
    assert answer(bag_url, 'POST').status == 403
    assert answer(bag_url, 'POST', Origin='http://evil.example').status == 403


@pytest.mark.parametrize('origin', ['http://evil.example', None])
def test_a_foreign_page_gets_no_socket(bag_url: str, origin: str | None) -> None:
    """The WebSocket of another page, or of no page, is refused with 403."""
    with pytest.raises(InvalidStatus) as refused:
        live(bag_url, origin=origin)
    assert refused.value.response.status_code == 403


def test_our_page_gets_its_socket(bag_url: str) -> None:
    """The console's own page is greeted."""
    assert live(bag_url, origin=bag_url.rstrip('/')) == 'hello'


def test_the_token_opens_the_socket(guarded_url: str) -> None:
    """With a token, a program that has it is greeted; our own page without it is not."""
    assert live(guarded_url, f'?token={TOKEN}') == 'hello'
    with pytest.raises(InvalidStatus):
        live(guarded_url, origin=guarded_url.rstrip('/'))


def test_files_outside_are_not_served(bag_url: str) -> None:
    """No path leads out of the folder of static files."""
    for path in ('/static/../server.py', '/static/%2e%2e/server.py', '/static//etc/passwd'):
        assert answer(bag_url, path=path).status == 404


def test_an_open_address_ends_with_one_line(repository: Path) -> None:
    """The command refuses with 2 and a line that says what was expected."""
    bag = str(repository / 'bags' / 'packbot_pass')
    with running(*COMMAND, 'console', bag, '--host', EVERYWHERE) as process:
        said, _ = process.communicate(timeout=60)
    assert process.returncode == 2
    assert said.count('\n') == 1
    assert '--host 0.0.0.0: expected 127.0.0.1, or a --token' in said


def test_names_are_text_never_markup() -> None:
    """No script of the page makes markup of text, runs text, or asks another host."""
    for script in STATIC.glob('*.js'):
        words = (
            r'innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(|new Function|https?://'
        )
        assert not re.search(words, script.read_text()), script.name
    page = (STATIC / 'index.html').read_text()
    assert not re.search(r'<script(?![^>]*src=)|\son\w+=|style=|https?://', page)


def test_the_page_is_small() -> None:
    """Page, style, scripts and icon are below 100 kB together, with nothing of others."""
    files = list(STATIC.iterdir())
    assert sum(file.stat().st_size for file in files) < 100_000
    assert {file.suffix for file in files} == {'.html', '.css', '.js', '.svg'}
