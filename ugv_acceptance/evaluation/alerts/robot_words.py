"""Words of alerts for the robot at hand: its motion, clearance, and what it has."""

from ugv_acceptance.evaluation.margin_words import tipping_words
from ugv_acceptance.evaluation.permitted_limits import relaxed
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.roles import LEGGED, WHEELED, roles_of

# The sentences are those of a tracked robot with an arm; what stands in place of its words.
_UNDER = {
    WHEELED: (('an end of the tracks', 'a wheel'), ('tracks', 'wheels')),
    LEGGED: (('an end of the tracks', 'a foot'), ('tracks', 'feet')),
}
_WITHOUT_ARM = (
    ('lower the arm over the tracks, face', 'face'),
    ('; lower the arm over the tracks before', ' before'),
    ('; lower the arm over the tracks, bring the load closer', ''),
    ('bring the load closer, lower the arm, face', 'face'),
    ('; bring the arm low and to the high side', ''),
)


def of_robot(text: str, robot: Robot) -> str:
    """Return a sentence about a tracked robot with an arm as it is for another robot."""
    roles = roles_of(robot)
    without = () if roles.arm else _WITHOUT_ARM
    for words, instead in (*without, *_UNDER.get(roles.kind, ())):
        text = text.replace(words, instead)
    return text


def height(clearance: float) -> str:
    """Return in words how high (m) the arm was at least."""
    where = 'above' if clearance > 0.0 else 'below'
    return f'it came to {abs(clearance):.2f} m {where}'


def moving(side: str, angle: float) -> str:
    """Return in words what the turn of a robot leaves (rad) of its tilt to a side."""
    if angle < 0.0:
        return f'it turns so fast that it will tip over: {side.upper()}'
    return f'as fast as it turns, {tipping_words(side, angle)}'


def relaxed_limit(name: str, settings: Settings) -> str:
    """Return how far the limit of this name is relaxed now, and the reason given for it."""
    found = next((b for b in relaxed(settings) if b.name == name), None)
    if found is None:
        return f'{name} was wider than permitted'
    return f'{found.words}; reason: {settings.unsafe}'
