"""A Chromium and consoles for the tests of the page; what is missing fails in CI."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from console.browser import Browser, Page, chromium, program
from console.servers import Live, console, live_console

HERE = Path(__file__).parent


def missing(what: str) -> None:
    """Fail in CI, skip elsewhere: a page that was not looked at has not passed."""
    text = f'not tested: {what}'
    if os.environ.get('CI'):
        pytest.fail(text)
    pytest.skip(text)


@pytest.fixture(scope='session')
def chrome() -> Iterator[Browser]:
    """Return a running browser."""
    if program() is None:
        missing('the page, for want of a Chromium (Debian: apt-get install chromium)')
    with chromium() as browser:
        yield browser


@pytest.fixture
def page(chrome: Browser) -> Iterator[Page]:
    """Return a new tab that is closed afterwards."""
    with chrome.page() as tab:
        yield tab


@pytest.fixture(scope='module')
def bag_url(repository: Path) -> Iterator[str]:
    """Return the address of a console that shows a recording with alerts."""
    with console(str(repository / 'bags' / 'packbot_fail')) as (url, _):
        yield url


@pytest.fixture(scope='module')
def robot() -> Iterator[Live]:
    """Return a driver, a monitor and a console."""
    with live_console() as live:
        yield live


@pytest.fixture(scope='session')
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the source of axe-core, as the lock file pins it."""
    npm = shutil.which('npm')
    if npm is None:
        missing('accessibility, for want of npm')
    folder = tmp_path_factory.mktemp('axe')
    for name in ('package.json', 'package-lock.json'):
        shutil.copy(HERE / name, folder)
    command = [str(npm), 'ci', '--ignore-scripts', '--no-audit', '--no-fund', '--silent']
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        missing(f'accessibility, for npm ci failed: {done.stderr[-200:]}')
    return (folder / 'node_modules' / 'axe-core' / 'axe.min.js').read_text()
