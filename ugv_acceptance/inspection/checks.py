"""Checks of what was heard on the inputs, live or recorded: each finding says what to do."""

from collections.abc import Callable, Iterator
from statistics import median

from ugv_acceptance.bag.cdr import ImuSample, JointStateSample
from ugv_acceptance.config import Config
from ugv_acceptance.config.same_robot import difference_of
from ugv_acceptance.evaluation.effort.facts import NONE, TORQUE, UNKNOWN
from ugv_acceptance.evaluation.effort.live_rests import LiveRests
from ugv_acceptance.evaluation.effort.understanding import understand
from ugv_acceptance.evaluation.ground import ground_words
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.inspection.heard import FAIL, OK, WARN, Finding, Heard, Told
from ugv_acceptance.inspection.imu_checks import check_imu
from ugv_acceptance.inspection.joint_checks import check_joints
from ugv_acceptance.monitoring.session import IMU_FIELDS, JOINT_FIELDS

# Difference of clocks (s) that is not reported.
CLOCK_SLACK = 1.0
# The slowest input (Hz) that leaves time to react.
SLOWEST = 10.0
# Findings after which the direction of gravity is not known, and so no static torque.
OF_GRAVITY = ('imu gravity', 'imu mounting', 'imu orientation')
# Efforts are looked at this often (ns).
LOOK = 200_000_000
# What is said of an input that the configuration does not use.
ABSENT = {
    'joint_states': 'not needed: the robot has no measured joints, so no torque is checked',
    'imu': 'none: the base was declared level, so tip-over is not checked',
}


def check_configuration(config: Config) -> Iterator[Finding]:
    """Yield which configuration is in force, what is doubtful about it, and the ground's kind."""
    yield Finding(OK, 'configuration', f'{config.name} from {config.path}')
    for warning in config.warnings:
        yield Finding(WARN, 'configuration', warning, 'see docs/robot_configuration.md')
    if config.settings.judges_tilt:
        kind = config.settings.ground.kind
        do = '' if kind else 'set ground.kind: flat, uneven or stairs'
        yield Finding(OK, 'ground', f'taken as {ground_words(kind)}', do)


def check_inputs(
    joints: Heard | None,
    imu: Heard | None,
    config: Config,
    of_topic: Callable[[str, Heard], Iterator[Finding]],
    seconds: float,
) -> Iterator[Finding]:
    """Yield what is wrong with the two inputs in `seconds`; None: one that is not used.

    `of_topic` yields first what is wrong with the topic of an input. Of one that nobody publishes
    nothing more is said.
    """
    looks: tuple[tuple[str, Heard | None, Callable[..., Iterator[Finding]]], ...] = (
        ('joint_states', joints, check_joints),
        ('imu', imu, check_imu),
    )
    misled = False
    for name, heard, look in looks:
        if heard is None:
            yield Finding(OK, name, ABSENT[name])
            continue
        yield from of_topic(name, heard)
        if heard.publishers:
            yield from _messages(name, heard, seconds)
        found = list(look(heard, config)) if heard.samples else []
        yield from found
        misled = misled or any(one.level == FAIL and one.about in OF_GRAVITY for one in found)
    if joints is not None and not misled:
        yield from _efforts(joints, imu, config)


def check_description(told: Told, config: Config) -> Iterator[Finding]:
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
    """Yield efforts that surely are no torques, or of the other sign, by rests heard."""
    evaluator, rests = LiveEvaluator(config.settings), LiveRests(config.settings)
    heard: list[tuple[int, JointStateSample | ImuSample]] = [
        *joints.pairs(),
        *(imu.pairs() if imu else ()),
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


def _messages(name: str, heard: Heard, seconds: float) -> Iterator[Finding]:
    if heard.malformed:
        text = f'{len(heard.malformed)} messages cannot be decoded: {heard.malformed[-1]}'
        yield Finding(FAIL, name, text, 'check the version of the message type at the publisher')
    if heard.times or not heard.malformed:
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
    offset = median((received - sample.stamp) / 1e9 for received, sample in heard.pairs())
    about = f'{name} clock'
    if abs(offset) <= CLOCK_SLACK:
        yield Finding(OK, about, f'stamps are {offset * 1e3:.1f} ms before receipt')
    elif not any(sample.stamp for sample in heard.samples):
        yield Finding(WARN, about, 'stamps are all zero', 'let the driver fill header.stamp')
    else:
        do = 'synchronise the clocks; for a simulation set use_sim_time; play a recording restamped'
        yield Finding(WARN, about, f'stamps are {offset:.1f} s before receipt', do)
