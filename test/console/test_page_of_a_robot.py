"""The page in a real browser, with a live robot: driver, monitor and console are processes."""

import re
import signal

import pytest
from console.browser import Page
from console.servers import Live, calm

FOLDED = (0.0, 2.0, -2.5, 2.0)
STRETCHED = (0.0, 0.3, 0.2, 2.0)
CLOSE = (0.0, 1.2, -1.55, 2.0)  # the shoulder at 90 % of its limit
LEVEL = 'document.body.dataset.level'
CAUSE = 'document.getElementById("cause").textContent'


@pytest.fixture
def shown(page: Page, robot: Live) -> Page:
    """Return a page that shows a robot that stands well."""
    robot.pose(*FOLDED)
    page.open(robot.url)
    calm(page)
    return page


def wait_for_both(page: Page, state: str) -> None:
    """Wait until both dangers of the stretched arm are listed so.

    Before the monitor's word comes, a danger is one that only the console sees.
    """
    for danger in ('tipping-front', 'torque-shoulder_joint'):
        row = f'document.querySelector("#alerts li.ERROR[data-key={danger}]")'
        page.wait(f'{row}?.dataset.state === "{state}"')


def test_live_numbers_move(shown: Page, robot: Live) -> None:
    """The page follows the robot's joints."""
    before = shown.text('#torques')
    robot.pose(0.0, 1.6, -2.0, 2.0)
    shown.wait(f'document.getElementById("torques").textContent !== {before!r}')
    shown.wait('Math.abs(console_page.frame.q[1] - 1.6) < 1e-6')


def test_an_alert_appears_sounds_and_is_acknowledged(shown: Page, robot: Live) -> None:
    """Danger is shown and sounded until a person acknowledges; then the monitor says so."""
    assert 'off' in shown.text('#arm')
    shown.click('#arm')
    shown.wait('document.body.dataset.sound === "armed"')
    robot.pose(*STRETCHED)
    shown.wait(f'{LEVEL} === "ERROR" && document.body.dataset.sound === "sounding"')
    wait_for_both(shown, 'active, not acknowledged')
    # A late input is NO DATA for a moment, on a busy machine.
    # The sign flashes, at most three times a second, and not for who asked for less motion.
    sign = 'getComputedStyle(document.getElementById("sign"))'
    shown.wait(f'{LEVEL} === "ERROR" && {sign}.animationName === "flash"')
    assert float(shown.run(f'{sign}.animationDuration').rstrip('s')) > 1 / 3
    calm = {'name': 'prefers-reduced-motion', 'value': 'reduce'}
    shown.call('Emulation.setEmulatedMedia', features=[calm])
    shown.wait(f'{LEVEL} === "ERROR" && {sign}.animationName === "none"')
    shown.run('operator.value = "Ada"')
    shown.click('#acknowledge-all')
    wait_for_both(shown, 'active, acknowledged')
    # A caution about the motion may come later, and is acknowledged too.
    shown.run('setInterval(() => document.getElementById("acknowledge-all").click(), 500)')
    shown.wait(
        f'{LEVEL} === "ERROR" && document.body.dataset.sound === "armed"'
        ' && !verdict.classList.contains("flash")'
    )
    assert 'Ada' in shown.text('#alerts li[data-key=tipping-front] small')


def test_one_voice_at_a_time(shown: Page, robot: Live) -> None:
    """With two dangers and what goes with them no tone begins before the one before has ended."""
    shown.run(
        'window.voices = []; for (const name of ["start", "stop"]) {'
        ' const was = OscillatorNode.prototype[name];'
        ' OscillatorNode.prototype[name] = function (when) {'
        ' voices.push(when); was.call(this, when); }; } 0'
    )
    shown.click('#arm')
    robot.pose(*STRETCHED)
    wait_for_both(shown, 'active, not acknowledged')
    shown.wait('voices.length >= 24')
    moments = shown.run('voices')
    assert moments == sorted(moments)


def test_one_press_acknowledges_all_alerts_of_a_cause(shown: Page, robot: Live) -> None:
    """A card stands for all alerts of its cause: its button acknowledges each of them."""
    robot.pose(*STRETCHED)
    wait_for_both(shown, 'active, not acknowledged')
    card = '#alerts li[data-key=tipping-front]'
    shown.click(f'{card} button[data-deed=acknowledge]')
    mine = 'console_page.frame.cards.find(card => card.key === "tipping-front")'
    shown.wait(f'{mine}.state === "active, acknowledged" && !{mine}.unseen')
    other = 'console_page.frame.cards.find(card => card.key === "torque-shoulder_joint")'
    assert shown.run(f'{other}.unseen')


def test_no_alarm_colour_where_nothing_is_wrong(shown: Page) -> None:
    """Sound is off when the page opens: the button says so in words, and in no alarm's colour."""
    assert shown.run('document.body.dataset.sound') == 'off'
    for part in ('color', 'borderTopColor', 'backgroundColor'):
        colour = shown.run(f'getComputedStyle(arm).{part}')
        red, green, blue = map(int, re.findall(r'\d+', colour)[:3])
        assert max(red, green, blue) - min(red, green, blue) < 8


def test_what_is_over_stays_until_it_is_seen(shown: Page, robot: Live) -> None:
    """A danger that has gone by stays on the page until it is acknowledged."""
    robot.pose(*STRETCHED)
    # Only what tipped is latched; a motor's danger may come before it.
    shown.wait('!!document.querySelector("#alerts li.ERROR[data-key^=tipping]")')
    robot.pose(*FOLDED)
    shown.wait(f'{CAUSE}.startsWith("over, not acknowledged") && {LEVEL} === "WARN"')
    # What was to be done is no longer to be done.
    shown.wait('[...document.querySelectorAll("li.over .do")].every(x => !x.textContent)')
    shown.wait('!document.getElementById("acknowledge-all").disabled')
    shown.click('#acknowledge-all')
    shown.wait(f'{CAUSE}.startsWith("over, latched until reset")')
    shown.click('#past-count')
    # There may be two of them: it takes a moment until the arm is back.
    shown.run(
        '[...document.querySelectorAll("#past-alerts [data-deed=reset]")].forEach(x => x.click())'
    )
    shown.wait(f'{LEVEL} === "OK"')


def test_a_caution_can_be_shelved_a_danger_not(shown: Page, robot: Live) -> None:
    """The page offers shelving for a caution, which is silent then; for a danger it does not."""
    robot.pose(*CLOSE)
    shown.wait(f'{LEVEL} === "WARN"')
    # Others come and go with the motion.
    row = '#alerts li.WARN[data-key=torque-shoulder_joint]'
    shown.wait(f'!!document.querySelector("{row} button[data-deed=shelve]")')
    shown.click(f'{row} button[data-deed=shelve]')
    shown.wait('document.getElementById("answer").textContent.includes("shelve")')
    shown.wait(f'document.querySelector("{row}").dataset.state.endsWith("shelved")')
    assert not shown.run(f'document.querySelector("{row}").matches(".unacknowledged")')
    shown.click(f'{row} button[data-deed=unshelve]')
    robot.pose(*STRETCHED)
    shown.wait('!!document.querySelector("#alerts li.ERROR button[data-deed=acknowledge]")')
    assert not shown.run('!!document.querySelector("#alerts li.ERROR button[data-deed=shelve]")')


def test_inputs_arrive_at_the_rate_sent(shown: Page) -> None:
    """Joint states and IMU of 50 Hz each are said to arrive, at 50 Hz, and not long ago."""
    cells = '[...document.querySelectorAll("#inputs tr")].slice(0, 2).map(row => row.children)'
    shown.wait(
        f'{cells}.every(([, state, rate, age]) => state.textContent === "arriving"'
        ' && /^(49|50|51) Hz$/.test(rate.textContent) && / ms$/.test(age.textContent))'
    )


def test_a_silent_input_is_no_data(shown: Page, robot: Live) -> None:
    """Without IMU the page shows NO DATA and which input is silent."""
    robot.say('silent')
    shown.wait(f'{LEVEL} === "STALE" && {CAUSE}.includes("imu")')
    shown.wait('[...document.querySelectorAll("#inputs td.STALE")].length === 1')
    robot.say('speak')
    shown.wait(f'{LEVEL} !== "STALE"')


def test_a_stopped_monitor_is_no_data(shown: Page, robot: Live) -> None:
    """A monitor that stands still is seen although the inputs go on."""
    shown.run('new Promise(done => setTimeout(done, 2500))')
    robot.monitor.send_signal(signal.SIGSTOP)
    try:
        # On a busy machine an input may be late as well: what counts is that the page names this.
        shown.wait(f'{LEVEL} === "STALE" && {CAUSE}.includes("the monitor")')
        assert shown.text('#word') == 'NO DATA'
    finally:
        robot.monitor.send_signal(signal.SIGCONT)
    shown.wait(f'{LEVEL} !== "STALE"')


def test_a_frozen_server_is_no_data(shown: Page, robot: Live) -> None:
    """The page's own watchdog says STOP, what was known last and when; no number of now is left."""
    robot.console.send_signal(signal.SIGSTOP)
    try:
        shown.wait(f'{LEVEL} === "STALE" && {CAUSE}.includes("console server")')
        assert shown.text('#action') == 'STOP'
        last = re.fullmatch(r'last known (\d+\.\d) s ago: \d+ deg to .*', shown.text('#notes'))
        assert last
        shown.wait(f'!notes.textContent.includes("known {last[1]} s")')
        assert '°' not in shown.text('#margins')
        assert '%' not in shown.text('#margins')
    finally:
        robot.console.send_signal(signal.SIGCONT)
    shown.wait(f'{LEVEL} !== "STALE"')


def test_no_data_cannot_be_mistaken_for_ok(shown: Page, robot: Live) -> None:
    """NO DATA is hatched, in another shape, and covers the numbers that may be old."""
    look = (
        '[getComputedStyle(verdict).backgroundImage,'
        ' document.getElementById("sign-shape").getAttribute("d")]'
    )
    fine = shown.wait(f'{LEVEL} === "OK" && {look}')
    robot.console.send_signal(signal.SIGSTOP)
    try:
        shown.wait(f'{LEVEL} === "STALE"')
        lost = shown.run(look)
        cover = 'getComputedStyle(document.querySelector(".live"), "::after").content'
        assert shown.run(cover) == '"NO DATA"'
    finally:
        robot.console.send_signal(signal.SIGCONT)
    assert fine[0] == 'none'
    assert 'repeating-linear-gradient' in lost[0]
    assert fine[1] != lost[1]


def test_a_declared_payload_reaches_the_monitor(shown: Page, robot: Live) -> None:
    """A payload typed into the page is published: the posture that was too much holds 0.1 kg."""
    robot.pose(*STRETCHED)
    shown.wait(f'{LEVEL} === "ERROR"')
    shown.click('#tell summary')
    shown.run('document.getElementById("load-mass").value = "0.1"')
    shown.click('#load-form button')
    shown.wait('document.getElementById("load").textContent.startsWith("0.10 kg")')
    shown.wait(f'{LEVEL} !== "ERROR" && {LEVEL} !== "STALE"')
    shown.run('document.getElementById("load-mass").value = "4"')
    shown.click('#load-form button')
    shown.wait('document.getElementById("load").textContent.startsWith("4.00 kg")')


def test_the_ground_is_told_from_the_page(shown: Page) -> None:
    """Stairs chosen in the page are what the monitor takes the ground for, until flat is chosen."""
    assert shown.text('#assumed').startswith('Assumed: ground taken as flat')
    # What somebody else tells the monitor is chosen here as well.
    shown.run('console_page.socket.send(\'{"do": "ground", "kind": "uneven"}\')')
    shown.wait('document.getElementById("ground-kind").value === "uneven"')
    shown.click('#tell summary')
    for kind, rough in (('stairs', True), ('flat', False)):
        shown.run(f'document.getElementById("ground-kind").value = "{kind}"')
        shown.click('#ground-form button')
        shown.wait(
            f'console_page.frame.ground.words.startsWith("{kind}")'
            f' && console_page.frame.ground.rough === {str(rough).lower()}'
        )
        shown.wait(f'document.getElementById("answer").textContent.includes("{kind}")')
