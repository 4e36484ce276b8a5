"""A drill as a feed of the console: page and terminal show it as they show a live robot."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ugv_acceptance import BadSample
from ugv_acceptance.console.snapshot import Memory, Snapshot
from ugv_acceptance.drill.course import ENDED, Course
from ugv_acceptance.drill.play import ASK, WATCH
from ugv_acceptance.drill.view import snapshot_of
from ugv_acceptance.evaluation.settings import Settings

# Seconds in which the story can be read before the robot moves; how fast simulated time passes
# while a question stands, so that the answers can be read; the most that passes between two frames.
READING, PACE, MOST = 6.0, 0.5, 0.25


@dataclass(slots=True)
class DrillFeed:
    """Plays a drill in real time; `now` reads a monotonic clock (s).

    The robot stands still until the story can have been read, and time runs slowly while a question
    stands. A computer that cannot keep up lets time slip.
    """

    course: Course
    now: Callable[[], float] = time.monotonic
    settings: Settings = field(init=False)
    _memory: Memory = field(default_factory=Memory)
    _then: float = field(init=False)
    _ready: float = field(init=False)

    def __post_init__(self) -> None:
        self.settings = self.course.config.settings
        self.restart()

    def restart(self) -> None:
        """Let the time for reading begin now."""
        self._then = self.now()
        self._ready = self._then + READING
        self._memory = Memory()
        # The monitor hears the robot before the first frame.
        self.course.advance(MOST)

    def describe(self) -> dict[str, Any]:
        """Return the source of the numbers: the simulated robot of a drill."""
        return {'source': 'drill', 'title': f'drill on the simulated {self.course.config.name}'}

    def snapshot(self) -> Snapshot:
        """Let the time since the last call pass; return what the robot's monitor says now."""
        now = self.now()
        passed, self._then = min(now - self._then, MOST), now
        if self.course.phase == ASK:
            self.course.advance(PACE * passed)
        elif self.course.phase != WATCH or now >= self._ready:
            self.course.advance(passed)
        return self._memory.keep(snapshot_of(self.course.play.robot))

    def extra(self) -> dict[str, Any]:
        """Return the drill's part of a frame: story, question, answers, and what came of it."""
        course, play = self.course, self.course.play
        outcome = play.outcome
        left = None if play.left is None else round(play.left / PACE, 1)
        shown = play.choices if course.phase == ASK or play.answers else ()
        return {
            'drill': {
                'number': course.number,
                'of': len(course.names),
                'title': play.situation.title,
                'story': play.case.story,
                'question': play.case.question,
                'choices': [{'key': c.key, 'words': c.words} for c in shown],
                'phase': course.phase,
                'answer': play.answer,
                'happened': outcome.happened if outcome else '',
                'lesson': outcome.lesson if outcome else '',
                'passed': outcome.passed if outcome else None,
                'left_s': left,
            }
        }

    def command(self, do: str, values: dict[str, Any]) -> str:
        """Answer (`choose` with `choice`), go to the `next`, or `repeat`. BadSample: refused."""
        if do == 'choose':
            return self.course.choose(str(values.get('choice')))
        if do not in {'next', 'repeat'}:
            raise BadSample(f'in a drill choose one of the answers; it cannot do {do!r:.40}')
        said = self.course.next() if do == 'next' else self.course.repeat()
        if self.course.phase != ENDED:
            self.restart()
        return said
