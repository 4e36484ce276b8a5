"""Pictures of the console in its states, wide and on a phone: `python -m bench.console_pictures`.

A real monitor watches a driver that stands still, stretches its arm, falls silent and falls over; a
real Chromium looks at the page. Writes docs/images/console_STATE_SCREEN.png, small enough to be
kept, and the danger once more by night.
"""

import io
import os
import sys
import time
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / 'test'))

from console.browser import Page, chromium  # noqa: E402 - the tests' helpers
from console.servers import Live, calm, live_console  # noqa: E402 - the same

OUT = ROOT / 'docs' / 'images'
SCREENS = {'wide': (1280, 800, False), 'phone': (390, 844, True)}
# Turret, shoulder, elbow, flippers (rad), and roll.
POSTURES = {
    'ok': (0.0, 2.0, -2.5, 2.0, 0.0),
    'warning': (-1.57, 1.3, -1.9, 2.0, 0.2),
    'critical': (-1.57, 1.2, -1.6, 2.0, 0.2),
    'fallen': (-1.57, 1.2, -1.6, 2.0, 0.9),
}
LEVELS = {'ok': 'OK', 'warning': 'WARN', 'critical': 'ERROR', 'no_data': 'STALE', 'fallen': 'ERROR'}
COLOURS = 96
# Hz of the joint states, and of the IMU.
RATES = '50 100'
# How a posture is reached: steps, in seconds.
STEPS, SECONDS = 120, 8.0


def main() -> None:
    """Take all pictures."""
    OUT.mkdir(exist_ok=True)
    os.environ['DRIVER_RATES'] = RATES
    with live_console() as robot, chromium() as browser, browser.page() as page:
        page.open(robot.url)
        # A sign that flashes would be caught half faded.
        still = {'name': 'prefers-reduced-motion', 'value': 'reduce'}
        page.call('Emulation.setEmulatedMedia', features=[still])
        for state, level in LEVELS.items():
            bring(robot, page, state, level)
            for screen, (width, height, touch) in SCREENS.items():
                page.resize(width, height, touch=touch)
                page.run('scrollTo(0, 0); new Promise(done => setTimeout(done, 700))')
                page.wait(f'document.body.dataset.level === "{level}"')
                save(page.picture(), OUT / f'console_{state}_{screen}.png')
                if (state, screen) == ('critical', 'wide'):
                    page.click('#night')
                    save(page.picture(), OUT / 'console_critical_night.png')
                    page.click('#night')


def bring(robot: Live, page: Page, state: str, level: str) -> None:
    """Bring the robot into a state and wait until the page shows it."""
    if state == 'no_data':
        robot.say('silent')
    else:
        robot.say('speak')
        robot.pose(*POSTURES['ok'][:4], roll=0.0)
        calm(page)
        go(robot, POSTURES[state])
    rates = [f'{hertz} Hz' for hertz in RATES.split()]
    if state == 'no_data':
        rates[1] = '0 Hz'
    cells = (
        '[...document.querySelectorAll("#inputs tr")].slice(0, 2).map(x => x.children[2].innerText)'
    )
    page.wait(
        f'document.body.dataset.level === "{level}" && {cells}.join() === "{",".join(rates)}"'
    )


def go(robot: Live, posture: tuple[float, ...]) -> None:
    """Move slowly to a posture and stay until no prediction of the motion is active."""
    for k in range(1, STEPS + 1):
        pairs = zip(POSTURES['ok'], posture, strict=True)
        *q, roll = (a + (b - a) * k / STEPS for a, b in pairs)
        robot.pose(*q, roll=roll)
        time.sleep(SECONDS / STEPS)
    time.sleep(3.0)


def save(png: bytes, path: Path) -> None:
    """Write a picture with few colours."""
    with Image.open(io.BytesIO(png)) as picture:
        few = picture.convert('RGB').quantize(COLOURS, dither=Image.Dither.NONE)
        few.save(path, optimize=True)
    print(f'{path.relative_to(ROOT)}  {path.stat().st_size / 1024:.0f} kB')


if __name__ == '__main__':
    main()
