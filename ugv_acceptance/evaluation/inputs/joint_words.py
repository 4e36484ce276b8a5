"""What is wrong with joint states, in words: which joint, which value, and what to set."""

import math
from collections.abc import Iterable, Sequence

from ugv_acceptance.evaluation.inputs.joint_names import names_words, near_names, what_to_set
from ugv_acceptance.evaluation.inputs.turns import FULL
from ugv_acceptance.evaluation.settings import JointInput, Settings
from ugv_acceptance.model.robot import Joint

# Joints that are told of one by one.
MOST = 3


def position_words(joint: Joint, how: JointInput, q: float) -> str:
    """Return why `q` (rad, m; the robot's convention) cannot be the position of a joint."""
    name, unit = joint.name, joint.units.position
    if math.isnan(q):
        return f'the position of {name} is not a number'
    text = f'{name} is at {q:.5g} {unit}'
    told = (q - how.offset) / how.sign
    in_degrees = how.sign * math.radians(told) + how.offset
    if math.isfinite(joint.lower) or math.isfinite(joint.upper):
        text += f', its range is {joint.lower:.3g} to {joint.upper:.3g} {unit}'
        if not joint.slides and joint.lower <= in_degrees <= joint.upper:
            text += ': degrees instead of radians?'
        return f'{text}; check joints.{name}.sign and offset'
    if not joint.slides and abs(q) > FULL:
        text += f', which is {abs(q) / math.tau:.1f} turns: degrees instead of radians?'
        return f'{text} If it counts turns, take them off by joints.{name}.offset_rad'
    return f'{name} jumps'


def unusable_words(settings: Settings, told: Sequence[float], unknown: Iterable[int]) -> str:
    """Return why the positions of joints number `unknown` cannot be used; `told` (j,) are they."""
    robot = settings.robot
    words = [
        position_words(robot.joint(robot.joint_names[j]), settings.joints[j], told[j])
        for j in unknown
    ]
    return _listed(words)


def missing_words(settings: Settings, ages: Sequence[float | None], names: Iterable[str]) -> str:
    """Return which joints are missing: `ages` (j,) in s, infinite if never told, None if in time.

    `names` are all names that messages told.
    """
    joints = list(zip(settings.robot.joint_names, settings.joints, ages, strict=True))
    never = [(name, how.topic_name) for name, how, age in joints if age == math.inf]
    silent = ', '.join(name for name, _ in never)
    words = [f'{silent} {"was" if len(never) == 1 else "were"} never told'] if never else []
    words += [
        f'{name} was last told {age:.2f} s before'
        for name, _, age in joints
        if age is not None and age != math.inf
    ]
    others = sorted(set(names) - {how.topic_name for how in settings.joints})
    if never and others:
        words.append(_others(never, others))
    if never:
        line = held_words(settings, (name for name, _ in never))
        words.append(f'if they do not move, enter where they are, not under joints: {line}')
    return _listed(words, len(words))


def held_words(settings: Settings, joints: Iterable[str]) -> str:
    """Return the line of a configuration that holds joints where they are taken to be."""
    at = {name: settings.robot.joint(name).nearest(0.0) for name in joints}
    return f'held: {{{", ".join(f"{name}: {q:g}" for name, q in at.items())}}}'


def foreign_words(settings: Settings, names: Iterable[str]) -> str:
    """Return that messages came, but with `names` of which none is a joint of the robot."""
    told = sorted(set(names))
    if not told:
        return 'messages came, but their lists of names are empty'
    wanted = list(
        zip(settings.robot.joint_names, (how.topic_name for how in settings.joints), strict=True)
    )
    others = _others(wanted, told)
    if not near_names([name for _, name in wanted], told):
        others += '; if this is another robot, ugv-acceptance init writes its configuration'
    return f'none names a joint of the robot; {others}'


def _others(wanted: Sequence[tuple[str, str]], names: Sequence[str]) -> str:
    text, keys = f'names told: {names_words(names)}', what_to_set(wanted, names)
    return f'{text}; {keys}' if keys else text


def _listed(words: Sequence[str], most: int = MOST) -> str:
    more = len(words) - most
    return '; '.join(words[:most]) + (f'; and {more} more joints' if more > 0 else '')
