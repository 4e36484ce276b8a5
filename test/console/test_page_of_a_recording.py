"""The page in a real browser, with a recording."""

import json
import re
from pathlib import Path

import pytest
from console.browser import Page
from console.servers import console

DANGER = 26.0
HOSTILE = '<img src=x onerror=window.hacked=1>'
# Impacts of axe-core's findings that are not let pass.
GRAVE = ('serious', 'critical')
LEVEL = 'document.body.dataset.level'


def seek(page: Page, seconds: float) -> None:
    """Pause the recording at a time and wait until the page shows it."""
    page.wait('!!window.console_page?.frame')
    for words in ({'do': 'pause'}, {'do': 'seek', 'to_s': seconds}):
        page.run(f'console_page.socket.send({json.dumps(json.dumps(words))})')
    at = 'console_page.frame.playback.position_s'
    page.wait(
        f'Math.abs({at} - {seconds}) < 0.01 && console_page.painted === console_page.frame.number'
    )


@pytest.fixture
def shown(page: Page, bag_url: str) -> Page:
    """Return a page that shows the recording."""
    page.open(bag_url)
    page.wait('!!window.console_page?.hello && document.body.dataset.level !== "STALE"')
    return page


def test_it_loads_without_a_complaint_and_asks_nobody_else(shown: Page, bag_url: str) -> None:
    """No error, no request to another host, the robot's name in the title."""
    shown.run('new Promise(done => setTimeout(done, 300))')
    assert shown.complaints == []
    assert [url for url in shown.requests if not url.startswith((bag_url, 'ws://'))] == []
    assert shown.text('#title') == 'packbot: packbot_fail_0.mcap'


def test_numbers_move(shown: Page) -> None:
    """While the recording plays, the numbers on the page change."""
    seek(shown, 4.0)
    before = shown.text('#tilt')
    shown.click('#play')
    shown.wait('console_page.frame.playback.position_s > 5')
    assert shown.text('#tilt') != before


def test_the_verdict_has_word_shape_and_colour(shown: Page) -> None:
    """OK and DANGER differ in word, in shape and in colour."""
    looks = []
    for seconds, level in ((1.0, 'OK'), (DANGER, 'ERROR')):
        seek(shown, seconds)
        look = (
            '[word.textContent, document.getElementById("sign-shape").getAttribute("d"),'
            ' getComputedStyle(verdict).backgroundColor]'
        )
        # Where frames are late, the page says NO DATA for a moment.
        looks.append(shown.wait(f'{LEVEL} === "{level}" && {look}'))
    assert [look[0] for look in looks] == ['OK', 'DANGER']
    assert all(a != b for a, b in zip(*looks, strict=True))


def test_an_alert_says_what_and_what_to_do(shown: Page) -> None:
    """In danger the first alert is about tipping over, with advice; on the verdict too."""
    seek(shown, DANGER)
    assert 'tip' in shown.text('#alerts li.ERROR .what')
    said = '[document.querySelector("#alerts li.ERROR .do").textContent, advice.textContent]'
    alert, verdict = shown.wait(f'{LEVEL} === "ERROR" && {said}')
    assert alert == verdict != ''
    assert (
        shown.run('getComputedStyle(document.querySelector(".side-left.ERROR b")).display')
        == 'block'
    )


def test_a_listed_alert_is_gone_to(shown: Page) -> None:
    """Pressing an alert of the recording goes to its beginning."""
    shown.click('#play')
    shown.click('#jumps li:last-child button')
    starts = shown.run('console_page.hello.timeline.alerts.at(-1).from_s')
    shown.wait(f'Math.abs(console_page.frame.playback.position_s - {starts}) < 2')


def test_a_click_on_the_map_tells_what_would_be_there(shown: Page) -> None:
    """A pressed point of the safe map is answered with the margins there."""
    seek(shown, 1.0)
    # A point within the map's edges is painted once the map has come.
    shown.wait('map.getContext("2d").getImageData(80, 30, 1, 1).data[3] > 0')
    shown.click('#map')
    shown.wait('document.getElementById("probe").textContent.startsWith("At shoulder")')
    assert 'degrees' in shown.text('#probe') or '°' in shown.text('#probe')


def test_other_joints_can_be_mapped(shown: Page) -> None:
    """Choosing another joint gives a map over it."""
    shown.run(
        'console_page.socket.addEventListener("message", event => {'
        ' const said = JSON.parse(event.data); if (said.kind === "map") window.across = said.x; })'
    )
    choose = (
        '(() => { const s = document.getElementById("axis-x"); s.value = "turret_joint";'
        ' s.dispatchEvent(new Event("change")); })()'
    )
    shown.run(choose)
    shown.wait('window.across === "turret_joint"')
    shown.click('#map')
    shown.wait('document.getElementById("probe").textContent.startsWith("At turret")')


def test_it_can_be_used_by_keyboard_alone(shown: Page) -> None:
    """Tab reaches every control and shows where it is; keys pause, and ask the map."""
    seek(shown, 1.0)
    wanted = set(
        shown.run(
            '[...document.querySelectorAll("button, select, input, #map")]'
            '.filter(x => x.offsetParent && !x.disabled && !x.closest("#jumps")).map(x => x.id)'
        )
    )
    reached: list[str] = []
    shown.run('document.body.focus()')
    for _ in range(200):
        shown.key('Tab')
        reached.append(str(shown.run('document.activeElement.id')))
        if reached[-1] == 'play' and reached.count('play') == 1:
            shown.key(' ')
        if reached[-1] == 'map':
            outline = 'getComputedStyle(document.activeElement).outlineStyle'
            assert shown.run(outline) == 'solid'
            shown.key('ArrowRight')
            shown.wait('document.getElementById("probe").textContent.startsWith("At ")')
        if wanted <= set(reached):
            break
    assert wanted <= set(reached)
    shown.wait('console_page.frame.playback.position_s > 1.2')


@pytest.mark.parametrize('width', [320, 360, 768, 1280, 2560])
def test_it_fits_every_screen(shown: Page, width: int) -> None:
    """From 320 to 2560 pixels nothing sticks out sideways and the verdict is in sight."""
    shown.resize(width, 640, touch=width < 800)
    seek(shown, DANGER)
    assert shown.run('document.documentElement.scrollWidth') <= width
    box = shown.run(
        '(() => { const b = word.getBoundingClientRect();'
        ' return [b.x, b.y, b.right, b.bottom]; })()'
    )
    assert box[0] >= 0
    assert box[1] >= 0
    assert box[2] <= width
    assert box[3] <= 320


def test_fingers_hit_the_controls(shown: Page) -> None:
    """On a phone every button and choice is at least 44 pixels high, gloves or not."""
    shown.resize(360, 640, touch=True)
    seek(shown, DANGER)
    heights = shown.run(
        '[...document.querySelectorAll("button, select")].filter(x => x.offsetParent)'
        '.map(x => x.getBoundingClientRect().height)'
    )
    assert heights
    assert min(heights) >= 44


@pytest.mark.parametrize('seconds', [1.0, 24.9, DANGER])
def test_axe_finds_nothing_serious(shown: Page, axe: str, seconds: float) -> None:
    """In OK, CAUTION and DANGER the accessibility checker has no serious or critical finding."""
    seek(shown, seconds)
    assert grave_findings(shown, axe) == []


def test_axe_finds_nothing_serious_without_data(page: Page, axe: str, repository: Path) -> None:
    """NO DATA is as accessible as the rest."""
    with console(str(repository / 'bags' / 'packbot_gap')) as (url, _):
        page.open(url)
        page.wait('!!window.console_page?.hello')
        seek(page, 9.5)
        assert page.run('document.body.dataset.level') == 'STALE'
        assert grave_findings(page, axe) == []


def grave_findings(page: Page, axe: str) -> list[str]:
    """Return axe-core's serious and critical findings."""
    # The expression's value would be the library itself.
    page.run(f'{axe}; 0')
    found = page.run(
        'axe.run(document).then(r => r.violations.map(v => '
        '[v.impact, v.id + ": " + v.nodes.map(n => n.target.join(" ")).join(", ")]))'
    )
    return [text for impact, text in found if impact in GRAVE]


def test_names_are_shown_as_text(page: Page, repository: Path, tmp_path: Path) -> None:
    """A joint whose name is markup is shown as it is written, and runs nothing."""
    urdf = (repository / 'urdf' / 'packbot.urdf').read_text()
    escaped = HOSTILE.replace('<', '&lt;').replace('>', '&gt;')
    (tmp_path / 'robot.urdf').write_text(urdf.replace('"elbow_joint"', f'"{escaped}"'))
    yaml = (repository / 'msg_configs' / 'packbot.yaml').read_text()
    yaml = yaml.replace('../urdf/packbot.urdf', 'robot.urdf').replace(
        '  elbow_joint:', f'  "{HOSTILE}":'
    )
    yaml = yaml.replace(
        f'"{HOSTILE}":\n    topic_name: {HOSTILE}', f'"{HOSTILE}":\n    topic_name: elbow_joint'
    )
    # A name with a dot would be one of a part of the robot.
    yaml = re.sub(r'^ *elbow_joint\.(offset|limit).*\n', '', yaml, flags=re.MULTILINE)
    (tmp_path / 'robot.yaml').write_text(yaml)
    bag = str(repository / 'bags' / 'packbot_fail')
    with console(bag, '--config', str(tmp_path / 'robot.yaml')) as (url, _):
        page.open(url)
        page.wait('!!window.console_page?.hello && document.body.dataset.level !== "STALE"')
        page.wait('document.querySelectorAll(".torque").length === 4')
        assert HOSTILE in page.text('#torques')
        assert page.run('document.querySelectorAll("img").length') == 0
        assert page.run('window.hacked') is None


def test_on_stairs_no_number_of_degrees_is_green(
    page: Page, repository: Path, tmp_path: Path
) -> None:
    """The page names the ground; where it is not flat, a tilt left is at most so much."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    text = text.replace('../urdf', str(repository / 'urdf'))
    stairs = tmp_path / 'stairs.yaml'
    stairs.write_text(text.replace('ground:', 'ground:\n  kind: stairs'), 'utf-8')
    with console(str(repository / 'bags' / 'packbot_pass'), '--config', str(stairs)) as (url, _):
        page.open(url)
        seek(page, 1.0)
        assert page.text('#ground').startswith('stairs: upper bound')
        assert page.text('#map-ground') == '(on flat ground only)'
        assert '≤' in page.text('#tilt')
        assert page.run('document.querySelectorAll(".side-left.OK").length') == 0
        assert 'not begun to tip' in page.text('#cause')
