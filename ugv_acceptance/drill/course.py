"""A whole drill: one situation after another, repeated on request; what came of each."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from ugv_acceptance import BadSample
from ugv_acceptance.config import Config
from ugv_acceptance.drill.outcome import Drill, Outcome
from ugv_acceptance.drill.play import JUDGED, Play
from ugv_acceptance.drill.situations import SITUATIONS

# The phase of a drill after its last situation.
ENDED = 'ended'
# A situation that is repeated has the numbers of another seed.
_AGAIN = 1000


@dataclass(slots=True)
class Course:
    """The situations of a drill by `names`, in order; `play` is the one under way.

    Raises BadSample for an unknown name.
    """

    config: Config
    seed: int = 1
    names: Sequence[str] = tuple(SITUATIONS)
    play: Play = field(init=False)
    outcomes: list[Outcome] = field(default_factory=list)
    number: int = 1
    over: bool = False
    _tries: int = 0
    _taken: bool = False

    def __post_init__(self) -> None:
        for name in self.names:
            if name not in SITUATIONS:
                known = ', '.join(SITUATIONS)
                raise BadSample(f'situation: expected one of {known}, got {name!r:.40}')
        self._begin()

    def _begin(self) -> None:
        situation = SITUATIONS[self.names[self.number - 1]]
        self.play = Play(self.config, situation, self.seed + self._tries * _AGAIN)
        self._taken = False

    @property
    def phase(self) -> str:
        """The phase of the situation under way, ENDED after the last."""
        return ENDED if self.over else self.play.phase

    def advance(self, seconds: float) -> None:
        """Let so much simulated time (s) pass."""
        self.play.advance(seconds)
        if self.play.outcome is not None and not self._taken:
            self.outcomes.append(self.play.outcome)
            self._taken = True

    def choose(self, key: str) -> str:
        """Give an answer; return what was chosen. Raises BadSample where that cannot be."""
        return self.play.choose(key)

    def next(self) -> str:
        """Go on to the next situation, after the last end the drill. BadSample: not judged yet."""
        self._check()
        if self.number == len(self.names):
            self.over = True
            return ENDED
        self.number, self._tries = self.number + 1, 0
        self._begin()
        return f'situation {self.number} of {len(self.names)}'

    def repeat(self) -> str:
        """Play the same situation again, with other numbers. BadSample: not judged yet."""
        self._check()
        self._tries += 1
        self._begin()
        return 'once more, with other numbers'

    def _check(self) -> None:
        if self.over or self.play.phase != JUDGED:
            raise BadSample('next, repeat: expected a situation that is judged')

    def drill(
        self, operator: str, started: str, minutes: float, *, scripted: bool = False
    ) -> Drill:
        """Return what came of it so far, for its record."""
        config = self.config
        return Drill(
            operator,
            config.name,
            config.sha256,
            self.seed,
            started,
            round(minutes, 1),
            tuple(self.outcomes),
            scripted,
        )
