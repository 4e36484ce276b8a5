"""The one table of what people read for a level, on every surface; machines read LEVELS."""

from ugv_acceptance.evaluation.alerts.state_machine import LEVELS

# A level as people read it; machines (ROS, JSON, CSV, files of criteria and plans) read LEVELS.
LEVELS_FOR_PEOPLE = dict(zip(LEVELS, ('OK', 'CAUTION', 'DANGER', 'NO DATA'), strict=True))

# What each level for people means, and what it says to do: one table for card and manual.
MEANS = {
    'OK': ('all margins are kept', 'go on'),
    'CAUTION': (
        'a margin is small or shrinks fast, or an input looks wrong',
        'slow down and follow the advice before you go on',
    ),
    'DANGER': (
        'a limit is passed, or a measurement cannot be trusted',
        'stop what you are doing and follow the advice',
    ),
    'NO DATA': ('the margins are not known', 'STOP: do not move on these numbers'),
}


def level_words(level: int | str) -> str:
    """Return a level, by its number or its name in LEVELS, as people read it."""
    return LEVELS_FOR_PEOPLE[LEVELS[level] if isinstance(level, int) else level]


def pattern_words(pattern: str) -> str:
    """Return LEVEL, LEVEL CODE or LEVEL CODE SUBJECT as people read it: DANGER TIP_OVER left."""
    level, space, rest = pattern.partition(' ')
    return level_words(level) + space + rest
