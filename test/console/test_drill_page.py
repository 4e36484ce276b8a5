"""The drill on the page: played to its end by an operator with a mouse and a keyboard."""

import json
import sys
from pathlib import Path

from console.browser import PATIENCE, Page
from console.servers import HERE, address_of, running

from ugv_acceptance.drill.record import is_edited, read_record

DRILL = 'console_page?.frame?.drill'


def wait_for(page: Page, phase: str) -> None:
    """Wait until the drill is in a phase, and the page shows it."""
    page.wait(f'{DRILL}?.phase === "{phase}" && console_page.painted === console_page.frame.number')


def test_a_drill_is_played_to_its_end_on_a_phone(page: Page, tmp_path: Path) -> None:
    """A wrong answer, given by its key, is to be repeated; the record says so and is offered.

    Every answer is a button a finger hits, in sight below the header, and nothing sticks out
    sideways.
    """
    out = tmp_path / 'ada.json'
    with running(sys.executable, str(HERE / 'drill_page.py'), 'fall', str(out)) as process:
        page.open(address_of(process), 390, 844, touch=True)
        wait_for(page, 'ask')
        keys = [choice['key'] for choice in page.run(f'{DRILL}.choices')]
        boxes = page.run(
            '[...document.querySelectorAll("#drill-choices button")].map(x => {'
            ' const b = x.getBoundingClientRect();'
            ' return [b.height, b.top - verdict.offsetHeight, innerHeight - b.bottom]; })'
        )
        assert len(boxes) == len(keys) >= 6
        assert min(height for height, _, _ in boxes) >= 44
        assert min(value for box in boxes for value in box) >= 0
        assert page.run('document.documentElement.scrollWidth') <= 390
        page.type(str(keys.index('help') + 1))
        wait_for(page, 'judged')
        assert page.text('#drill-passed') == '✗ TO REPEAT'
        assert page.text('#drill-lesson') == page.run(f'{DRILL}.lesson') != ''
        page.click('#drill-next')
        wait_for(page, 'ended')
        assert '✗ to repeat: After a fall' in page.text('#drill-situations')
        download(page, tmp_path / 'saved')
    record = read_record(out)
    assert not is_edited(record)
    assert [[a['key'] for a in one['answers']] for one in record['situations']] == [['help']]
    assert record == json.loads((tmp_path / 'saved' / 'drill.json').read_text('utf-8'))
    assert page.complaints == []


def download(page: Page, folder: Path) -> None:
    """Save the record that the page offers."""
    folder.mkdir()
    page.call('Page.setDownloadBehavior', behavior='allow', downloadPath=str(folder))
    page.click('#drill-save')
    end = PATIENCE
    while not (folder / 'drill.json').exists() and end > 0:
        page.run('new Promise(done => setTimeout(done, 100))')
        end -= 0.1
