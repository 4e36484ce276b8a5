"""The page in a real browser, with a recording."""

import json
import re
from pathlib import Path

import pytest
from console.browser import Page
from console.servers import console

DANGER = 26.0
# It lies on its side, past its tipping point by 35 degrees.
FALLEN = 28.5
# Nothing is wrong, and a danger of before is over.
BEFORE = 18.0
HOSTILE = '<img src=x onerror=window.hacked=1>'
LEVEL = 'document.body.dataset.level'
BOXES = '[...document.querySelectorAll("#tilt b")]'
# Ratio of contrast by WCAG 2, of the header's words against what is behind them.
CONTRAST = """
(selector => {
  const light = c => {
    const [r, g, b] = c.match(/\\d+/g).map(x => x / 255)
      .map(x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const words = document.querySelector(selector), style = getComputedStyle(words);
  const ground = x => getComputedStyle(x).backgroundColor;
  let behind = words;
  while (ground(behind) === 'rgba(0, 0, 0, 0)') behind = behind.parentElement;
  const [low, high] = [light(style.color), light(ground(behind))].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
})
"""


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


def test_only_what_is_abnormal_has_colour(shown: Page) -> None:
    """OK is a grey check, DANGER red; they differ in word and in shape too."""
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
    grey, red = ([int(x) for x in re.findall(r'\d+', look[2])[:3]] for look in looks)
    assert max(grey) - min(grey) < 8
    assert max(red) - min(red) > 100


def test_the_header_says_what_and_largest_what_to_do(shown: Page) -> None:
    """Word, direction and number, what to do in the largest letters, and the cause once."""
    seek(shown, DANGER)
    shown.wait(f'{LEVEL} === "ERROR"')
    assert shown.text('#verdict h1') == 'DANGER TIPPING RIGHT, -1.2 deg'
    assert shown.text('#action') == 'LOWER THE ELBOW'
    sizes = shown.run(
        '[...verdict.querySelectorAll(".says *")].filter(x => x.textContent)'
        '.map(x => [parseFloat(getComputedStyle(x).fontSize), x.id])'
    )
    assert max(sizes)[1] == 'action'
    cause = shown.text('#cause').partition(' (and ')[0]
    assert shown.text('#verdict').count(cause) == 1


def test_a_screen_reader_is_told_when_the_trouble_is_another(shown: Page) -> None:
    """What is spoken changes with the kind of trouble, and not with its numbers."""
    spoken = []
    for seconds in (24.9, DANGER, DANGER + 0.1):
        seek(shown, seconds)
        shown.wait(f'{LEVEL} !== "STALE"')
        spoken.append((shown.text('#spoken'), shown.text('#number')))
    (caution, _), danger, later = spoken
    assert shown.run('spoken.getAttribute("aria-live")') == 'assertive'
    assert danger[0].startswith('DANGER. TIPPING RIGHT. LOWER THE ELBOW. ')
    assert danger[0] == later[0] != caution
    assert danger[1] != later[1]


def test_one_event_is_one_card_with_what_to_do(shown: Page) -> None:
    """A robot that tips to the right has one card about it, however many alerts it raised."""
    seek(shown, DANGER)
    assert shown.run('console_page.frame.cards[0].keys.length') > 1
    cards = shown.run('[...document.querySelectorAll("#alerts li")].map(x => x.dataset.key)')
    assert cards[0] == 'tipping-right'
    assert len(set(cards)) == len(cards)
    assert 'elbow' in shown.text('#alerts li.ERROR .do')


def test_what_is_over_is_folded_away(shown: Page) -> None:
    """Past alerts are counted in one line, and shown when somebody opens it."""
    seek(shown, BEFORE)
    assert shown.text('#past-count').startswith('Past alerts (')
    first = 'document.querySelector("#past-alerts li")'
    assert not shown.run(f'{first}.checkVisibility()')
    shown.click('#past-count')
    assert shown.run(f'{first}.checkVisibility()')


def test_the_seconds_to_the_limit_stand_in_the_header(shown: Page) -> None:
    """While a margin shrinks, the header counts the seconds until it is used up."""
    seek(shown, 1.0)
    assert shown.run('countdown.hidden')
    seek(shown, 24.9)
    shown.wait('!countdown.hidden')
    assert float(shown.text('#seconds')) == shown.run('console_page.frame.seconds')
    assert shown.text('#countdown').endswith('s to tipping RIGHT')


def test_who_has_fallen_is_left_alone(shown: Page) -> None:
    """After a fall the page says to stand clear, and nowhere to move the arm or the load."""
    seek(shown, FALLEN)
    shown.wait(f'{LEVEL} === "ERROR"')
    assert shown.text('#action') == 'STAND CLEAR'
    advice = shown.run(
        '[...document.querySelectorAll("#detail, #alerts .do")].map(x => x.textContent)'
    )
    assert all('do not move the arm' in line for line in advice if line)
    assert len(advice) > 1
    over = 'getComputedStyle(document.getElementById("safe-map"), "::after").content'
    assert shown.run(over) == '"DO NOT MOVE THE ARM"'
    seek(shown, DANGER)
    shown.wait(f'{over} === "none"')


def test_a_recording_is_not_spoken_to(shown: Page) -> None:
    """The page of a recording says that it is one, and has no form or button for a live robot."""
    seek(shown, DANGER)
    assert shown.text('#source') == 'RECORDING, not live'
    seen = (
        '[...document.querySelectorAll("form, form *, #tell, #operator, #acknowledge-all,'
        ' .buttons button")].filter(x => x.checkVisibility()).length'
    )
    assert shown.run(seen) == 0


def test_what_is_assumed_and_not_checked_is_said(shown: Page) -> None:
    """One line names the ground that is assumed, and what no margin covers."""
    seek(shown, 1.0)
    assert shown.text('#assumed').startswith('Assumed: ground taken as flat; NOT CHECKED: ')


def test_the_night_is_dark_and_remembered(shown: Page) -> None:
    """The page follows the system's wish for dark, until a person chooses; that is kept."""
    theme = 'document.documentElement.dataset.theme'
    dark = {'name': 'prefers-color-scheme', 'value': 'dark'}
    assert shown.run(theme) == 'day'
    shown.call('Emulation.setEmulatedMedia', features=[dark])
    shown.wait(f'{theme} === "night"')
    shown.click('#night')
    shown.wait(f'{theme} === "day"')
    shown.call('Page.reload')
    shown.wait(f'!!window.console_page?.frame && {theme} === "day"')
    assert shown.run('localStorage.length') == 1
    shown.run('localStorage.clear()')


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


@pytest.mark.parametrize(
    ('width', 'height'), [(320, 640), (390, 844), (768, 1024), (1280, 800), (2560, 1440)]
)
def test_it_fits_every_screen(shown: Page, width: int, height: int) -> None:
    """From 320 to 2560 pixels nothing sticks out, and verdict and margins are in sight."""
    shown.resize(width, height, touch=width < 800)
    for seconds in (24.9, DANGER):
        seek(shown, seconds)
        assert shown.run('document.documentElement.scrollWidth') <= width
        parts = '[verdict, word, action, seconds, tilt, worst, ...tilt.children]'
        boxes = shown.run(
            f'{parts}.map(x => x.getBoundingClientRect()).map(b => [b.x, b.y, b.right, b.bottom])'
        )
        assert all(x >= 0 and y >= 0 and right <= width for x, y, right, _ in boxes)
        assert max(bottom for *_, bottom in boxes) <= height


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
def test_axe_finds_nothing(shown: Page, axe: str, seconds: float) -> None:
    """In OK, CAUTION and DANGER, by day and night, the accessibility checker finds nothing."""
    seek(shown, seconds)
    assert_readable(shown, axe)


def test_without_data_the_first_word_is_stop(page: Page, axe: str, repository: Path) -> None:
    """NO DATA: STOP, what was known last and when, then the cause; no number of before in bold."""
    with console(str(repository / 'bags' / 'packbot_gap')) as (url, _):
        page.open(url)
        page.wait('!!window.console_page?.hello')
        seek(page, 9.5)
        assert page.run('document.body.dataset.level') == 'STALE'
        assert page.text('#word') == 'NO DATA'
        assert page.text('#action') == 'STOP'
        assert page.text('#detail') == 'do not move on these numbers'
        assert re.match(r'last known \d+\.\d s ago: \d+ deg to tipping: ', page.text('#notes'))
        assert page.text('#cause').startswith('no message from imu')
        assert page.run(f'{BOXES}.map(x => x.textContent).join("")') == '————'
        assert page.run(f'{BOXES}.every(x => getComputedStyle(x).fontWeight === "400")')
        assert '°' not in page.text('#margins')
        assert_readable(page, axe)


def assert_readable(page: Page, axe: str) -> None:
    """Check by day and by night: axe-core finds nothing, and the header can be read in the sun."""
    # The expression's value would be the library itself.
    page.run(f'{axe}; 0')
    for theme in ('day', 'night'):
        page.run(f'document.documentElement.dataset.theme = "{theme}"')
        found = page.run(
            'axe.run(document).then(r => r.violations.map(v => '
            'v.id + ": " + v.nodes.map(n => n.target.join(" ")).join(", ")))'
        )
        assert found == []
        for words in ('#verdict h1', '#action', '#cause', '#number'):
            assert page.run(f'{CONTRAST}("{words}")') >= 7, (theme, words)


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
        page.wait('document.querySelectorAll("#torques .torque").length === 4')
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
        assert 'ground: stairs' in page.text('#assumed')
        assert page.text('#map-ground') == '(on flat ground only)'
        assert '≤' in page.text('#tilt')
        assert page.run('document.querySelectorAll(".side-left.OK").length') == 0
        assert 'NOT BEGUN TO TIP' in page.text('#verdict h1')
