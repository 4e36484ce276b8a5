"""A drill as a feed: what page and terminal show of it, and the keys of the terminal."""

from dataclasses import dataclass
from typing import Any

import pytest

from ugv_acceptance import BadSample
from ugv_acceptance.config import load
from ugv_acceptance.console.frame import frame_of
from ugv_acceptance.drill.course import ENDED, Course
from ugv_acceptance.drill.feed import PACE, READING, DrillFeed
from ugv_acceptance.drill.play import ACTING, ASK, JUDGED, WATCH
from ugv_acceptance.drill.terminal import HEIGHT, WIDTH, coloured, do, screen, tour
from ugv_acceptance.monitoring.drawing import figure_of

# The shortest situation.
SHORT = 'fall'


@dataclass(slots=True)
class Wall:
    """A clock on the wall that shows the time (s) it was set to."""

    time: float = 100.0

    def now(self) -> float:
        """Return the time."""
        return self.time


@dataclass(slots=True)
class Shown:
    """A feed on a wall clock, and its frames."""

    wall: Wall
    feed: DrillFeed

    def frame(self, after: float = 0.2) -> dict[str, Any]:
        """Return the frame `after` s."""
        self.wall.time += after
        snapshot = self.feed.snapshot()
        made = frame_of(snapshot, self.feed.settings, figure_of(self.feed.settings.robot))
        return {**made, **self.feed.extra()}

    def until(self, phase: str) -> dict[str, Any]:
        """Return the first frame of a phase."""
        for _ in range(1000):
            frame = self.frame()
            if frame['drill']['phase'] == phase:
                return frame
        raise AssertionError(phase)


@pytest.fixture(scope='module')
def frames() -> dict[str, dict[str, Any]]:
    """Return a frame of each phase of a situation in which it was advised, and the answers."""
    wall = Wall()
    shown = Shown(wall, DrillFeed(Course(load('packbot'), 3, (SHORT,)), wall.now))
    found = {WATCH: shown.frame(0.0), ASK: shown.until(ASK)}
    first, second = shown.frame(1.0), shown.frame(0.2)
    found['slow'] = {'passed_s': second['time_s'] - first['time_s']}
    keys = [choice['key'] for choice in found[ASK]['drill']['choices']]
    assert do(shown.feed, str(keys.index('advice') + 1))
    found[ACTING] = shown.frame()
    found[JUDGED] = shown.until(JUDGED)
    with pytest.raises(BadSample, match='expected a question'):
        shown.feed.command('choose', {'choice': 'advice'})
    with pytest.raises(BadSample, match='in a drill choose one of the answers'):
        shown.feed.command('payload', {'mass_kg': 1.0})
    assert do(shown.feed, 'n') == ENDED
    found[ENDED] = shown.frame()
    return found


def test_a_drill_is_marked_as_one(frames: dict[str, dict[str, Any]]) -> None:
    """The lamp of a frame says that its source is a drill, not a robot."""
    assert frames[WATCH]['lamps']['source'] == 'drill'


def test_each_phase_tells_what_a_page_needs(frames: dict[str, dict[str, Any]]) -> None:
    """Story first; then question, answers and time; in the end what happened, and the lesson."""
    watch, ask, judged = (frames[phase]['drill'] for phase in (WATCH, ASK, JUDGED))
    assert (watch['choices'], watch['left_s'], watch['passed']) == ([], None, None)
    assert 'slope' in watch['story']
    assert {'advice', 'go_on', 'stop', 'wait'} < {choice['key'] for choice in ask['choices']}
    assert 0.0 < ask['left_s'] <= 20.0 / PACE
    assert (judged['passed'], judged['answer'], judged['left_s']) == (True, 'advice', None)
    assert judged['happened']
    assert judged['lesson']
    assert frames[ENDED]['drill']['phase'] == ENDED


def test_the_page_says_to_stand_clear_after_a_fall(frames: dict[str, dict[str, Any]]) -> None:
    """The frame is that of the real monitor: what it advises is what passes."""
    assert frames[ASK]['headline']['action'] == 'STAND CLEAR'
    assert frames[ASK]['level'] == 'ERROR'


def test_time_runs_slowly_while_a_question_stands(frames: dict[str, dict[str, Any]]) -> None:
    """There is time to read the answers: half a second passes in a second."""
    assert frames['slow']['passed_s'] == pytest.approx(PACE * 0.2, abs=0.051)


def test_the_robot_stands_still_until_the_story_can_have_been_read() -> None:
    """Nothing moves in the first seconds of a situation."""
    wall = Wall()
    feed = DrillFeed(Course(load('packbot'), 3, (SHORT,)), wall.now)
    first = feed.snapshot().time
    wall.time += READING - 0.1
    assert feed.snapshot().time == first
    wall.time += 0.2
    assert feed.snapshot().time > first


def test_every_screen_fits_a_small_terminal_without_colour(
    frames: dict[str, dict[str, Any]],
) -> None:
    """At 80 x 24 each phase shows the word, what to do, and what can be answered, in plain text."""
    shown = {phase: screen(frames[phase]) for phase in (WATCH, ASK, ACTING, JUDGED, ENDED)}
    for lines in (*shown.values(), tour()):
        assert len(lines) < HEIGHT
        assert all(len(line) <= WIDTH and line.isascii() for line in lines)
    asked = '\n'.join(shown[ASK])
    assert '<!> DANGER' in asked
    assert 'STAND CLEAR' in asked
    assert all(f'  {k} ' in asked for k in range(1, len(frames[ASK]['drill']['choices']) + 1))
    assert '[OK] PASSED' in shown[JUDGED]


def test_a_long_cause_leaves_the_answers_on_the_screen(frames: dict[str, dict[str, Any]]) -> None:
    """A cause of many lines is cut, with dots; every answer can still be read."""
    frame = frames[ASK]
    long = {**frame, 'headline': {**frame['headline'], 'cause': 'a joint is missing; ' * 40}}
    lines = screen(long)
    assert len(lines) < HEIGHT
    assert any(line.endswith(' ...') for line in lines)
    last = len(frame['drill']['choices'])
    assert any(line.startswith(f'  {last} ') for line in lines)


def test_colour_adds_nothing_but_colour(frames: dict[str, dict[str, Any]]) -> None:
    """Only the line with the word is coloured."""
    lines = screen(frames[ASK])
    differ = [k for k, line in enumerate(coloured(lines, 'ERROR')) if line != lines[k]]
    assert differ == [2]


def test_the_answer_offered_is_the_advice_shown() -> None:
    """While the arm goes on moving the advice changes: header and answer change as one."""
    wall = Wall()
    shown = Shown(wall, DrillFeed(Course(load('packbot'), 7, ('slope',)), wall.now))
    frame, told = shown.until(ASK), set()
    while frame['drill']['phase'] == ASK:
        (offered,) = (c['words'] for c in frame['drill']['choices'] if c['key'] == 'advice')
        line = frame['headline']
        # General advice is for what is not computed, such as a robot that has all but tipped.
        if ':' in line['detail']:
            said = f'{line["action"]} {line["detail"]}'.partition(':')[0]
            # The header says the same words in another order.
            assert sorted(offered.lower().split()) == sorted(said.lower().split())
            told.add(offered)
        frame = shown.frame()
    assert len(told) > 1
