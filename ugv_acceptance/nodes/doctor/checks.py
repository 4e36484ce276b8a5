"""Checks a set-up: turns what `probe.py` received into findings, each with what to do."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import fmean, median

from ugv_acceptance.bag.cdr import ImuSample, JointStateSample
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.effort.facts import NONE, TORQUE, UNKNOWN
from ugv_acceptance.evaluation.effort.live_rests import LiveRests
from ugv_acceptance.evaluation.effort.understanding import understand
from ugv_acceptance.evaluation.ground import ground_words
from ugv_acceptance.evaluation.inputs.imu_mount import NAMELESS, mounted
from ugv_acceptance.evaluation.inputs.joint_names import names_words, what_to_set
from ugv_acceptance.evaluation.inputs.joint_words import held_words, position_words
from ugv_acceptance.evaluation.inputs.turns import FULL, Turns, turning_of
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.margin_words import rate_words
from ugv_acceptance.evaluation.settings import UNKNOWN as UNPLACED
from ugv_acceptance.evaluation.settings import ImuInput
from ugv_acceptance.model.attitude import (
    angle_between,
    up_from_acceleration,
    up_from_orientation,
)
from ugv_acceptance.model.robot import Joint, Matrix, Vector
from ugv_acceptance.monitoring.session import IMU_FIELDS, JOINT_FIELDS
from ugv_acceptance.nodes.doctor.probe import Heard, Surroundings, Told
from ugv_acceptance.nodes.monitor.own_description import difference_of

OK, WARN, FAIL = 'OK', 'CAUTION', 'FAIL'
# Difference of clocks (s) that is not reported.
CLOCK_SLACK = 1.0
# The slowest input (Hz) that leaves time to react, and the tilt (rad) a floor may have.
SLOWEST = 10.0
LEVEL = math.radians(15)
# Efforts are looked at this often (ns).
LOOK = 200_000_000
# A joint that stands further outside its limits (rad or m) than this cannot be read rightly.
OUTSIDE = 0.1
# What is said of an input that the configuration does not use.
ABSENT = {
    'joint_states': 'not needed: the robot has no measured joints, so no torque is checked',
    'imu': 'none: the base was declared level, so tip-over is not checked',
}


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the result: level, subject, observation, and what to do (empty: nothing)."""

    level: str
    about: str
    seen: str
    do: str = ''


def examine(around: Surroundings, config: Config) -> Iterator[Finding]:
    """Yield the findings about a set-up; `config` is the robot's."""
    where = f'{around.distribution}, {around.middleware}, domain {around.domain}'
    yield Finding(OK, 'ROS', f'{where}, discovery {around.discovery}')
    yield Finding(OK, 'configuration', f'{config.name} from {config.path}')
    if around.robot is not None:
        yield from _own_description(around.robot, config)
    for warning in config.warnings:
        yield Finding(WARN, 'configuration', warning, 'see docs/robot_configuration.md')
    if config.settings.judges_tilt:
        kind = config.settings.ground.kind
        do = '' if kind else 'set ground.kind: flat, uneven or stairs'
        yield Finding(OK, 'ground', f'taken as {ground_words(kind)}', do)
    if len(around.monitors) > 1:
        text = f'{len(around.monitors)} monitors of the same name run'
        yield Finding(WARN, 'monitor', text, 'stop all but one, or give them namespaces')
    looks: tuple[tuple[str, Heard | None, Callable[..., Iterator[Finding]]], ...] = (
        ('joint_states', around.joint_states, _joints),
        ('imu', around.imu, _imu),
    )
    for name, heard, look in looks:
        if heard is None:
            yield Finding(OK, name, ABSENT[name])
            continue
        yield from _topic(name, heard, around.seconds)
        if heard.samples:
            yield from look(heard.samples, config)
    if around.joint_states is not None:
        yield from _efforts(around.joint_states, around.imu, config)


def _own_description(told: Told, config: Config) -> Iterator[Finding]:
    """Yield whether the robot tells its URDF, and whether it is the one in force."""
    name = 'robot_description'
    if not told.texts:
        text = f'nobody tells a URDF on {told.topic}: the one in force is compared with nothing'
        yield Finding(OK, name, text)
        return
    for one in told.texts:
        if other := difference_of(config, one, told.topic):
            do = "configure the robot's own URDF, or none"
            yield Finding(FAIL, name, f'not the URDF in force: {other}', do)
            return
    if told.obstacle:
        yield Finding(WARN, name, told.obstacle)
        return
    source = 'is taken' if config.description != 'file' else f'is that of {config.urdf_path}'
    yield Finding(OK, name, f'the URDF on {told.topic} {source}')


def _efforts(joints: Heard, imu: Heard | None, config: Config) -> Iterator[Finding]:
    """Yield efforts that surely are no torques, or of the other sign, by the seconds heard."""
    evaluator, rests = LiveEvaluator(config.settings), LiveRests(config.settings)
    heard: list[tuple[int, JointStateSample | ImuSample]] = [
        *zip(joints.times, joints.samples, strict=False),
        *(zip(imu.times, imu.samples, strict=False) if imu else ()),
    ]
    due = 0
    for now, sample in sorted(heard, key=lambda one: one[0]):
        if isinstance(sample, JointStateSample):
            evaluator.joint_state(now, now, *JOINT_FIELDS(sample))
        else:
            evaluator.imu(now, now, *IMU_FIELDS(sample))
        margins = evaluator.margins
        if margins is not None and now >= due:
            due = now + LOOK
            rests.see(now, margins.q, *evaluator.measured, margins.gravity, margins.torque)
    if not due:
        return
    for joint in understand(config.settings, (), rests.rests()).joints:
        if joint.opposed or joint.meaning not in {TORQUE, NONE, UNKNOWN}:
            yield Finding(WARN, f'effort of {joint.joint}', joint.sentence, joint.do)


def _topic(name: str, heard: Heard, seconds: float) -> Iterator[Finding]:
    if not heard.publishers:
        other = f'topics.{name}.name: {heard.alike[0].lstrip("/")}' if heard.alike else ''
        do = f'set {other} in the configuration, or remap it' if other else 'start its driver'
        if not other:
            do += '; check that ROS_DOMAIN_ID and the network are the same on both sides'
        yield Finding(FAIL, name, f'nobody publishes {heard.topic}', do)
        return
    types = sorted({kind for _, kind, _ in heard.publishers})
    if types != [heard.type]:
        text = f'{heard.topic} carries {", ".join(types)}, expected {heard.type}'
        yield Finding(FAIL, name, text, f'set topics.{name}.name to another topic')
    for node, _, reason in heard.publishers:
        if reason:
            do = f'set topics.{name}.qos to what is offered'
            yield Finding(FAIL, name, f'QoS of {node} does not match: {reason}', do)
    if len(heard.publishers) > 1:
        nodes = ', '.join(sorted(node for node, _, _ in heard.publishers))
        yield Finding(
            WARN, name, f'{heard.topic} has several publishers: {nodes}', 'stop all but one'
        )
    if heard.malformed:
        text = f'{len(heard.malformed)} messages cannot be decoded: {heard.malformed[-1]}'
        yield Finding(FAIL, name, text, 'check the version of the message type at the publisher')
    yield from _rate(name, heard, seconds)


def _rate(name: str, heard: Heard, seconds: float) -> Iterator[Finding]:
    if len(heard.times) < 2:
        text = f'{len(heard.times)} messages on {heard.topic} in {seconds:g} s'
        yield Finding(FAIL, name, text, 'check the driver, its QoS and the network')
        return
    steps = [b - a for a, b in zip(heard.times, heard.times[1:], strict=False)]
    rate = 1e9 / max(median(steps), 1)
    worst = max(steps) / 1e9
    text = f'{heard.topic}: {rate:.0f} Hz, longest gap {worst * 1e3:.0f} ms'
    if rate < SLOWEST:
        yield Finding(WARN, name, text, f'raise the rate to at least {SLOWEST:g} Hz')
    elif worst > max(3 / rate, 0.1):
        yield Finding(
            WARN, name, text, 'the monitor has NO DATA in such gaps: check load and network'
        )
    else:
        yield Finding(OK, name, text)
    yield from _clock(name, heard)


def _clock(name: str, heard: Heard) -> Iterator[Finding]:
    if not heard.samples:
        return
    pairs = zip(heard.times, heard.samples, strict=False)
    offset = median((received - sample.stamp) / 1e9 for received, sample in pairs)
    about = f'{name} clock'
    if abs(offset) <= CLOCK_SLACK:
        yield Finding(OK, about, f'stamps are {offset * 1e3:.1f} ms before receipt')
    elif not any(sample.stamp for sample in heard.samples):
        yield Finding(WARN, about, 'stamps are all zero', 'let the driver fill header.stamp')
    else:
        do = 'synchronise the clocks; for a simulation set use_sim_time; play a recording restamped'
        yield Finding(WARN, about, f'stamps are {offset:.1f} s before receipt', do)


def _joints(samples: Sequence[JointStateSample], config: Config) -> Iterator[Finding]:
    settings = config.settings
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


def _imu(samples: Sequence[ImuSample], config: Config) -> Iterator[Finding]:
    imu, g = config.settings.imu, config.settings.robot.gravity
    spin = median(math.hypot(*sample.angular_velocity) for sample in samples)
    if not spin <= imu.rest_rate:
        text = (
            'angular velocity is NaN'
            if math.isnan(spin)
            else f'the robot turns at {rate_words(spin, "rad/s")}'
        )
        yield Finding(WARN, 'imu', f'{text}: gravity cannot be judged', 'let it stand still')
        return
    ax, ay, az = (fmean(sample.linear_acceleration[k] for sample in samples) for k in range(3))
    size = math.sqrt(ax * ax + ay * ay + az * az)
    yield _gravity(size, g)
    found = mounted(config.settings, samples[-1].frame_id)
    if found is None:
        yield _unplaced(config, samples[-1].frame_id)
    elif found.joints:
        names = ', '.join(config.settings.robot.joint_names[j] for j in found.joints)
        yield Finding(OK, 'imu mounting', f'on {found.link}, which {names} moves: not judged here')
    else:
        up: Vector = up_from_acceleration(ax, ay, az, found.rotation)
        if size > g / 2:
            yield _mounting(up)
        yield from _orientation(samples, imu, found.rotation, up, known=abs(size - g) <= 0.15 * g)
    expected, frames = config.topics.imu.frame_id, {sample.frame_id for sample in samples}
    if expected is not None and frames != {expected}:
        text = f'frame_id is {", ".join(sorted(frames)) or "empty"}, expected {expected}'
        yield Finding(WARN, 'imu frame', text, 'check that this is the IMU whose mounting is given')


def _unplaced(config: Config, frame: str) -> Finding:
    """Return that nobody says how the IMU is mounted, as far as the URDF tells."""
    if config.settings.imu.placed == UNPLACED:
        text, do = 'declared as unknown', 'set imu.mounting_rpy_deg'
    elif not frame:
        text, do = NAMELESS, 'set imu.mounting_rpy_deg, or let the driver name its frame'
    else:
        text = f'its frame {frame!r} is no link of the URDF'
        do = 'unless /tf_static tells it, set imu.mounting_rpy_deg'
    return Finding(WARN, 'imu mounting', text, do)


def _gravity(size: float, g: float) -> Finding:
    about, seen = 'imu gravity', f'at rest the acceleration is {size:.2f} m/s2'
    if abs(size - g) <= 0.05 * g:
        return Finding(OK, about, seen)
    if abs(size - 1.0) <= 0.15:
        return Finding(FAIL, about, seen, 'it is in g: let the driver send m/s2 (REP-145)')
    if size <= 0.15 * g:
        return Finding(
            FAIL, about, seen, 'gravity was subtracted: let the driver send raw acceleration'
        )
    return Finding(FAIL, about, seen, f'expected {g:.2f}: calibrate it, or check its unit')


def _mounting(up: Vector) -> Finding:
    tilt = math.acos(max(-1.0, min(1.0, up[2])))
    about, seen = 'imu mounting', f'the robot leans {math.degrees(tilt):.1f} deg by acceleration'
    if tilt <= LEVEL:
        return Finding(OK, about, seen)
    if tilt >= math.pi - LEVEL:
        do = 'upside down, or the sign is wrong (+g up at rest, REP-145): set imu.mounting_rpy_deg'
        return Finding(FAIL, about, seen, do)
    return Finding(WARN, about, seen, 'if it stands level, set imu.mounting_rpy_deg')


def _orientation(
    samples: Sequence[ImuSample], imu: ImuInput, mounting: Matrix, up: Vector, *, known: bool
) -> Iterator[Finding]:
    about, last = 'imu orientation', samples[-1]
    x, y, z, w = last.orientation
    size = math.sqrt(x * x + y * y + z * z + w * w)
    do = 'set imu.attitude: accelerometer, or let the driver send an orientation'
    if last.orientation_covariance_0 == -1.0:
        yield Finding(WARN, about, 'not given (covariance -1): the accelerometer is used', do)
    elif not abs(size - 1.0) <= 0.01:
        yield Finding(FAIL, about, f'the quaternion has norm {size:.3g}, expected 1', do)
    elif x == y == z == 0.0:
        yield Finding(WARN, about, 'always the identity: taken for not given', do)
    elif known:
        angle = angle_between(up_from_orientation(x, y, z, w, mounting), up)
        seen = f'{math.degrees(angle):.1f} deg from the acceleration'
        if angle <= imu.agreement:
            yield Finding(OK, about, seen)
        else:
            do = 'check imu.mounting_rpy_deg and the axes of the driver (REP-103: z up)'
            yield Finding(FAIL, about, seen, do)
