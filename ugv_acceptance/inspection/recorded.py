"""The checks of `doctor` on a recording: its files, its topics, its messages, what they mean."""

from collections.abc import Callable, Collection, Iterable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import partial

from ugv_acceptance import BadSample
from ugv_acceptance.bag.log_times import LogTimes, log_times_of
from ugv_acceptance.bag.raw import Offered, offered_by_all
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.bag.told_robot import descriptions_in
from ugv_acceptance.config import Config, Topic
from ugv_acceptance.evaluation.alerts.level_words import level_words
from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.inspection.checks import check_configuration, check_description, check_inputs
from ugv_acceptance.inspection.heard import FAIL, OK, WARN, Finding, Heard, Told
from ugv_acceptance.inspection.hearing import hear
from ugv_acceptance.inspection.look import Chosen, Look, chosen, look, until_cheap
from ugv_acceptance.type_aliases import Json

# What `evaluate` could not check because of an input, by how it begins: what a person should do.
ODD = {
    'reported velocity': 'check the unit of the velocities at the driver',
    'whether posture and tilt': 'synchronise the clocks of the two hosts',
    'rate of the IMU': 'let its driver set the covariance, or leave the numbers out',
    'acceleration of the IMU': 'let its driver set the covariance, or leave the numbers out',
    'rate and acceleration of the IMU': 'let its driver set the covariance, or leave them out',
    'position of': '',
}
# The same where it is only worth knowing.
NOTED = ('measured effort', 'imu')
# Safeguards that speak of inputs.
ABOUT_INPUTS = ('imu', 'joint_positions')


@dataclass(frozen=True, slots=True)
class Checked:
    """The findings about a recording, and until when it was read (s; None: all of it)."""

    findings: tuple[Finding, ...]
    until_s: float | None


def examine_recording(
    recording: Recording,
    config: Config,
    *,
    everything: bool = False,
    reached: Callable[[float], None] = lambda _: None,
) -> Checked:
    """Check a recording, its beginning where it is long; `reached` gets seconds of it."""
    bag, used = recording.bag, chosen(recording, config)
    part = bag.beginning(bag.end_ns if everything else until_cheap(bag))
    kinds = {'joint_states': config.topics.joint_states, 'imu': config.topics.imu}
    heard = {name: _heard(bag, topic, used[name]) for name, topic in kinds.items() if topic.used}
    joints, imu = heard.get('joint_states'), heard.get('imu')
    hear(part, _there(joints), _there(imu), config.settings.imu)
    seen = look(recording, config, everything=everything, reached=reached)
    of_topic = partial(_of_topic, config, used, log_times_of(bag))
    found = [
        *_of_files(bag),
        *check_description(_told(recording, config), config),
        *check_configuration(config),
        *check_inputs(joints, imu, config, of_topic, part.duration_s),
    ]
    silent = {name for name, one in heard.items() if not one.times}
    found += _of_evaluation(seen, silent, [one.seen for one in found])
    return Checked(tuple(dict.fromkeys(found)), seen.until_s)


def _heard(bag: Bag, topic: Topic, used: Chosen) -> Heard:
    if used.topic is None:
        return Heard(topic.name, topic.type)
    profiles = offered_by_all(bag).get(used.topic, ())
    nodes = [
        (f'publisher {k + 1}', topic.type, _mismatch(one, topic)) for k, one in enumerate(profiles)
    ]
    return Heard(used.topic, topic.type, nodes or [('the recorded one', topic.type, '')])


def _mismatch(offer: Offered, wanted: Topic) -> str:
    """Return why a monitor with this configuration would not have heard a publisher; '': it did."""
    if wanted.reliability == 'reliable' and offer.reliability == 'best_effort':
        return 'best effort was offered, reliable is asked for'
    if wanted.durability == 'transient_local' and offer.durability == 'volatile':
        return 'volatile was offered, transient local is asked for'
    return ''


def _there(heard: Heard | None) -> Heard | None:
    return heard if heard is not None and heard.publishers else None


def _told(recording: Recording, config: Config) -> Told:
    found = descriptions_in(recording, config.topics.robot_description)
    texts: list[str | BadSample] = [text.decode() for text in found.texts]
    texts += [BadSample(why) for why in found.unreadable]
    different = f'the recording tells {len(texts)} different ones' if len(texts) > 1 else ''
    return Told(found.where or f'/{config.topics.robot_description}', tuple(texts), different)


def _of_files(bag: Bag) -> Iterator[Finding]:
    files = f'{len(bag.paths)} files' if len(bag.paths) > 1 else 'one file'
    kept = {'all': 'every chunk has a checksum', 'part': 'some chunks have no checksum'}
    how = kept.get(bag.protected, 'no checksums: damage may go unnoticed')
    messages = sum(topic.count for topic in bag.topics.values())
    text = f'{bag.duration_s:.1f} s, {messages} messages in {files}, {how}'
    yield Finding(OK, 'recording', text)
    if bag.salvaged:
        do = 'let the recorder end by itself: Ctrl-C, no kill, room on the disk'
        yield Finding(FAIL, 'recording', bag.salvaged, do)
    for text in bag.findings:
        yield Finding(OK if text.endswith('no metadata.yaml') else WARN, 'recording', text)


def _of_topic(
    config: Config,
    used: dict[str, Chosen],
    times: dict[str, LogTimes],
    name: str,
    heard: Heard,
) -> Iterator[Finding]:
    if used[name].topic is None:
        yield Finding(FAIL, name, used[name].why)
        return
    expected = config.topics.used[name].name
    if heard.topic.lstrip('/') != expected.lstrip('/'):
        do = f'set topics.{name}.name: {heard.topic.lstrip("/")}, or remap it, for a live monitor'
        yield Finding(OK, name, f'{heard.topic} is taken, {used[name].why}', do)
    for _, _, reason in heard.publishers:
        if reason:
            do = f'set topics.{name}.qos to what is offered, or a live monitor hears nothing'
            yield Finding(WARN, name, f'QoS as recorded does not match: {reason}', do)
    if len(heard.publishers) > 1:
        text = f'{heard.topic} had {len(heard.publishers)} publishers when it was recorded'
        yield Finding(WARN, name, text, 'stop all but one')
    back = times[heard.topic].backwards if heard.topic in times else 0
    if back:
        text = f'log times of {heard.topic} go back by up to {back / 1e9:.3g} s'
        yield Finding(WARN, name, text, "do not set the recorder's clock while it records")


def _of_evaluation(
    seen: Look, silent: AbstractSet[str], known: Collection[str]
) -> Iterator[Finding]:
    """Yield what the evaluation of a recording found wrong with its inputs.

    `silent` are inputs without a message, `known` what was said already.
    """
    if seen.judged is None:
        text = seen.obstacle.removeprefix(f'{seen.whole.paths[0]}: ')
        text = text.partition('; the bag holds:')[0]
        if text not in known:
            yield Finding(FAIL, 'evaluation', text)
        return
    result = seen.judged.result
    yield from _of_alerts(result['alerts'], silent)
    said = {alert['message'] for alert in result['alerts']}
    for one in result['safeguards']:
        if one['name'] in ABOUT_INPUTS:
            texts = [text for text in one['reasons'] if text not in said]
            yield from (Finding(WARN, str(one['name']).replace('_', ' '), text) for text in texts)
    for one in result['not_checked']:
        do = next((do for start, do in ODD.items() if one['what'].startswith(start)), None)
        if do is not None:
            yield Finding(WARN, one['what'], one['why'], do)
        elif one['what'].startswith(NOTED):
            yield Finding(OK, one['what'], one['why'])


def _of_alerts(alerts: Iterable[Json], silent: AbstractSet[str]) -> Iterator[Finding]:
    """Yield the first alert of each kind that is about an input."""
    told = set()
    for alert in alerts:
        key = alert['code'], alert['subject']
        known = key in told or (alert['code'] == 'INPUT_STALE' and alert['subject'] in silent)
        if known or alert['code'] in FAILURES or alert['doubtful'] or not _of_input(alert):
            continue
        told.add(key)
        level = FAIL if level_words(alert['level']) == 'DANGER' else WARN
        yield Finding(level, f'{alert["subject"]} {alert["code"]}', _when(alert), alert['advice'])


def _of_input(alert: Json) -> bool:
    """Return whether an alert is about an input, not about what the robot does."""
    codes = ('ENCODER_FROZEN', 'POSITION_LEAP', 'JOINTS_REPEATED', 'EFFORT_SIGN', 'CONFIG_DIFFERS')
    return alert['subject'] in {'joint_states', 'imu', 'payload'} or alert['code'] in codes


def _when(alert: Json) -> str:
    end = 'the end' if alert['end_s'] is None else f'{alert["end_s"]:.2f} s'
    return f'{alert["start_s"]:.2f} s to {end}: {alert["message"]}'
