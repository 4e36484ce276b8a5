"""What came of each situation of a drill, and of the drill as a whole."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Outcome:
    """One situation, as it ended: what the operator did, and what the simulated robot then did.

    `answers` are the keys of the actions taken, in order, with the seconds from the question to
    each. `happened` says in one sentence what the robot did, `lesson` what to remember. `least_deg`
    is the least tilt left while it was judged (NaN: not known). Times are simulated seconds.
    """

    situation: str
    title: str
    seed: int
    passed: bool
    answers: tuple[tuple[str, float], ...]
    happened: str
    lesson: str
    least_deg: float


@dataclass(frozen=True, slots=True)
class Drill:
    """A whole drill of one operator: `robot` by name, `started` as ISO 8601 time in UTC.

    The last outcome of each situation counts; `minutes` is how long the drill took. A `scripted`
    one was answered by a file: it shows nothing of its operator.
    """

    operator: str
    robot: str
    configuration_sha256: str
    seed: int
    started: str
    minutes: float
    outcomes: tuple[Outcome, ...]
    scripted: bool = False

    @property
    def to_repeat(self) -> tuple[str, ...]:
        """Names of the situations whose last outcome is no pass."""
        last = {outcome.situation: outcome.passed for outcome in self.outcomes}
        return tuple(name for name, passed in last.items() if not passed)
