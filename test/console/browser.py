"""A real Chromium, driven through its DevTools protocol: no driver program, no library."""

import base64
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

PROGRAMS = ('chromium', 'chromium-browser', 'google-chrome')
FLAGS = (
    '--headless',
    '--no-sandbox',
    '--disable-gpu',
    '--disable-quic',
    '--no-first-run',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
    '--disable-extensions',
    '--remote-debugging-port=0',
)
# Seconds in which whatever is waited for comes, on a busy machine too.
PATIENCE = 60.0
KEYS = {
    'Tab': ('Tab', 9, ''),
    'Enter': ('Enter', 13, '\r'),
    ' ': ('Space', 32, ' '),
    'ArrowRight': ('ArrowRight', 39, ''),
    'ArrowUp': ('ArrowUp', 38, ''),
}


def program() -> str | None:
    """Return the path of a Chromium; None where there is none."""
    found = [path for name in PROGRAMS if (path := shutil.which(name))]
    return found[0] if found else None


@dataclass
class Page:
    """One tab. `complaints` are errors of the page and everything it asked of other hosts."""

    socket: ClientConnection
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    _number: int = 0

    def call(self, method: str, **parameters: Any) -> Any:
        """Call a method of the DevTools protocol; return its result."""
        self._number += 1
        self.socket.send(json.dumps({'id': self._number, 'method': method, 'params': parameters}))
        while True:
            message = json.loads(self.socket.recv(timeout=PATIENCE))
            if message.get('id') == self._number:
                if 'error' in message:
                    raise AssertionError(f'{method}: {message["error"]}')
                return message['result']
            self._hear(message)

    def _hear(self, message: dict[str, Any]) -> None:
        method, said = message.get('method'), message.get('params', {})
        if method == 'Runtime.exceptionThrown':
            self.complaints.append(json.dumps(said['exceptionDetails'])[:400])
        elif method == 'Log.entryAdded' and said['entry']['level'] == 'error':
            self.complaints.append(said['entry']['text'])
        elif method == 'Network.requestWillBeSent':
            self.requests.append(said['request']['url'])

    def open(self, url: str, width: int = 1280, height: int = 800, *, touch: bool = False) -> None:
        """Go to an address with a screen of this size."""
        for domain in ('Runtime', 'Log', 'Network', 'Page'):
            self.call(f'{domain}.enable')
        self.resize(width, height, touch=touch)
        self.call('Page.navigate', url=url)
        self.wait('location.href !== "about:blank" && document.readyState === "complete"')

    def resize(self, width: int, height: int, *, touch: bool = False) -> None:
        """Give the page another screen."""
        self.call(
            'Emulation.setDeviceMetricsOverride',
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=touch,
        )
        if touch:
            self.call('Emulation.setTouchEmulationEnabled', enabled=True)

    def run(self, code: str) -> Any:
        """Return the value of an expression in the page; a promise is waited for."""
        found = self.call(
            'Runtime.evaluate', expression=code, returnByValue=True, awaitPromise=True
        )
        if 'exceptionDetails' in found:
            raise AssertionError(f'{code}: {found["exceptionDetails"]}')
        return found['result'].get('value')

    def wait(self, code: str, seconds: float = PATIENCE) -> Any:
        """Wait until an expression is true in the page; return its value."""
        end = time.monotonic() + seconds
        while not (value := self.run(code)):
            if time.monotonic() > end:
                shown = self.run('document.getElementById("alerts")?.innerText')
                raise AssertionError(
                    f'not within {seconds} s: {code}; {self.complaints}; alerts shown: {shown!r}'
                )
            time.sleep(0.02)
        return value

    def text(self, selector: str) -> str:
        """Return the text of an element."""
        return str(self.run(f'document.querySelector({json.dumps(selector)}).textContent'))

    def click(self, selector: str) -> None:
        """Press the middle of an element with the mouse, as a person does."""
        where = json.dumps(selector)
        box = self._middle(where)
        for kind in ('mousePressed', 'mouseReleased'):
            self.call(
                'Input.dispatchMouseEvent',
                type=kind,
                x=box[0],
                y=box[1],
                button='left',
                clickCount=1,
            )

    def _middle(self, where: str) -> list[float]:
        """Return the middle of an element once it stands still: a list above it may just grow."""
        look = (
            f'(() => {{ const e = document.querySelector({where});'
            ' e.scrollIntoView({block: "center"}); const b = e.getBoundingClientRect();'
            ' return [b.x + b.width / 2, b.y + b.height / 2]; })()'
        )
        before: list[float] = []
        while before != (box := self.run(look)):
            before = box
            time.sleep(0.1)
        return before

    def key(self, name: str) -> None:
        """Press a key."""
        code, number, text = KEYS[name]
        key = {'key': name, 'code': code, 'windowsVirtualKeyCode': number}
        down = {'type': 'keyDown', 'text': text} if text else {'type': 'rawKeyDown'}
        self.call('Input.dispatchKeyEvent', **down, **key)
        self.call('Input.dispatchKeyEvent', type='keyUp', **key)

    def type(self, letter: str) -> None:
        """Type a letter or a digit."""
        self.call('Input.dispatchKeyEvent', type='keyDown', key=letter, text=letter)
        self.call('Input.dispatchKeyEvent', type='keyUp', key=letter)

    def picture(self) -> bytes:
        """Return the screen as PNG."""
        return base64.b64decode(self.call('Page.captureScreenshot', format='png')['data'])


@dataclass(frozen=True)
class Browser:
    """A running Chromium."""

    port: int

    @contextmanager
    def page(self) -> Iterator[Page]:
        """Open a tab; it is closed at the end."""
        request = urllib.request.Request(
            f'http://127.0.0.1:{self.port}/json/new?about:blank', method='PUT'
        )
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:  # noqa: S310 - our own
            address = json.load(answer)['webSocketDebuggerUrl']
        with connect(
            address, max_size=None, compression=None, ping_interval=None, open_timeout=PATIENCE
        ) as socket:
            page = Page(socket)
            yield page
            page.call('Page.close')


@contextmanager
def chromium() -> Iterator[Browser]:
    """Run a Chromium with a profile of its own that is thrown away."""
    path = program()
    assert path is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [path, *FLAGS, f'--user-data-dir={profile}', 'about:blank'],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            yield Browser(_port(Path(profile, 'DevToolsActivePort'), process))
        finally:
            process.terminate()
            process.wait()


def _port(file: Path, process: 'subprocess.Popen[bytes]') -> int:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        lines = file.read_text().split() if file.exists() else []
        if lines:
            return int(lines[0])
        assert process.poll() is None, 'the browser ended at once'
        time.sleep(0.05)
    raise AssertionError('the browser did not open its DevTools port')
