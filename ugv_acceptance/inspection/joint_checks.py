"""Checks of joint states: names that are missing, positions that cannot be, degrees for radians."""

import math
from collections.abc import Iterator

from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.inputs.joint_names import names_words, what_to_set
from ugv_acceptance.evaluation.inputs.joint_words import held_words, position_words
from ugv_acceptance.evaluation.inputs.turns import FULL, Turns, turning_of
from ugv_acceptance.inspection.heard import FAIL, OK, WARN, Finding, Heard
from ugv_acceptance.model.robot import Joint

# A joint that stands further outside its limits (rad or m) than this cannot be read rightly.
OUTSIDE = 0.1


def check_joints(heard: Heard, config: Config) -> Iterator[Finding]:
    """Yield what is wrong with the joint states that were heard: names, limits, units."""
    settings, samples = config.settings, heard.samples
    names = {name for sample in samples for name in sample.names}
    wanted = {
        joint.topic_name: (name, joint)
        for name, joint in zip(settings.robot.joint_names, settings.joints, strict=True)
    }
    missing = sorted(set(wanted) - names)
    if missing:
        pairs = [(wanted[topic_name][0], topic_name) for topic_name in missing]
        do = what_to_set(pairs, names) or 'set joints.<joint>.topic_name'
        do += f'; the topic has {names_words(sorted(names))}'
        do += f'; if they do not move: {held_words(settings, [name for name, _ in pairs])}'
        spared = {
            name
            for name, untold in zip(settings.robot.joint_names, settings.untold, strict=False)
            if untold and untold.harmless
        }
        level = WARN if {name for name, _ in pairs} <= spared else FAIL
        yield Finding(level, 'joint names', f'not on the topic: {", ".join(missing)}', do)
    else:
        text = f'all {len(wanted)} of the robot, {len(names) - len(wanted)} others'
        yield Finding(OK, 'joint names', text)
    newest: dict[str, float] = {}
    for sample in samples:
        if len(sample.position) == len(sample.names):
            newest |= dict(zip(sample.names, sample.position, strict=True))
    for topic_name, (name, how) in wanted.items():
        if topic_name not in newest:
            continue
        told, joint = newest[topic_name], settings.robot.joint(name)
        q = how.sign * told + how.offset
        if not _within(joint, q):
            text = f'at {q:.3f}, limits {joint.lower:.3f} to {joint.upper:.3f}'
            do = f'check joints.{name}.sign and offset'
            in_degrees = how.sign * math.radians(told) + how.offset
            if not joint.slides and _within(joint, in_degrees):
                do += '; are degrees sent in place of radians?'
            yield Finding(FAIL, name, text, do)
    yield from _beyond_a_turn(config, newest)


def _beyond_a_turn(config: Config, newest: dict[str, float]) -> Iterator[Finding]:
    """Yield the joints without a range whose positions are beyond a turn, and may be degrees."""
    settings = config.settings
    robot, turns = settings.robot, Turns(turning_of(settings.robot))
    for j, how in enumerate(settings.joints):
        turns.told[j] = how.sign * newest.get(how.topic_name, math.nan) + how.offset
    for j, how in enumerate(settings.joints):
        q = turns.told[j]
        if turns.joints[j].limited and abs(q) > FULL and not turns.judge(j, math.nan, 0, 0.0):
            joint = robot.joint(robot.joint_names[j])
            yield Finding(FAIL, joint.name, position_words(joint, how, q))


def _within(joint: Joint, q: float) -> bool:
    return joint.lower - OUTSIDE <= q <= joint.upper + OUTSIDE
