"""Collects what a recording's messages, or a running robot's, tell of the robot itself."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.bag.cdr import IMU, JOINT_STATE, Decoder, ImuSample, JointStateSample
from ugv_acceptance.bag.description import TYPE as STRING
from ugv_acceptance.bag.description import string_of
from ugv_acceptance.bag.layout import Wire
from ugv_acceptance.bag.transforms import TYPE as TF
from ugv_acceptance.bag.transforms import transforms_of
from ugv_acceptance.config.urdf import Urdf, read_urdf
from ugv_acceptance.configure.evidence import Evidence, SeenImu, SeenTopic, StaticTransform
from ugv_acceptance.configure.names import match_names
from ugv_acceptance.configure.seen_imus import ImusSeen
from ugv_acceptance.configure.seen_joints import JointsSeen

# How the names of topics end that hold a URDF, and fixed frames.
DESCRIPTION, STATIC = 'robot_description', 'tf_static'
# The last parts of the names of a monitor's own topics, which are JointState messages too.
OWN = frozenset({'static_torque', 'torque_margin', 'stability'})
# Types that hold much the same as an input, but are not read.
_UNREAD = ('control_msgs/msg/DynamicJointState', 'control_msgs/msg/JointTrajectoryControllerState')


def is_wanted(topic: str, kind: str) -> bool:
    """Return whether the messages of a topic tell something of the robot itself."""
    last = topic.rpartition('/')[2]
    if kind == STRING:
        return last == DESCRIPTION
    if kind == TF:
        return last == STATIC
    return kind in {JOINT_STATE.type, IMU.type} and last not in OWN


@dataclass(slots=True)
class _Topic:
    """A topic: its type, number of messages that were told beforehand and taken, their times."""

    type: str
    promised: int = 0
    rate: float = 0.0
    taken: int = 0
    malformed: int = 0
    reason: str = ''
    first: int = 0
    last: int = 0
    decoder: Decoder[Any] | None = None
    frames: dict[str, None] = field(default_factory=dict)
    joints: JointsSeen = field(default_factory=JointsSeen)
    imus: ImusSeen = field(default_factory=ImusSeen)
    texts: dict[str, None] = field(default_factory=dict)

    def seen(self, name: str) -> SeenTopic:
        span = (self.last - self.first) * 1e-9
        rate = (self.taken - 1) / span if span > 0.0 else self.rate
        return SeenTopic(name, self.type, self.promised or self.taken, rate, tuple(self.frames))


@dataclass(slots=True)
class Collector:
    """Takes serialised messages of one robot, recorded or live; `evidence` is what they tell.

    `where` is the recording's path, or 'live'; `doubts` are sentences about what is odd.
    """

    where: str
    doubts: list[str] = field(default_factory=list)
    _topics: dict[str, _Topic] = field(default_factory=dict)
    _transforms: dict[str, StaticTransform] = field(default_factory=dict)

    def topic(self, name: str, kind: str, count: int = 0, rate: float = 0.0) -> None:
        """Note a topic: its type, number of messages (0: count those taken), and rate (Hz)."""
        self._topics.setdefault(name, _Topic(kind, count, rate))

    def take(self, now: int, topic: str, data: bytes, wire: Wire = 'cdr') -> None:
        """Take a message of a noted topic, received at `now` (ns); no content is an error."""
        of = self._topics[topic]
        of.taken += 1
        of.first, of.last = (now if of.taken == 1 else of.first), max(of.last, now)
        try:
            self._take(now, of, data, wire)
        except BadSample as error:
            of.malformed += 1
            of.reason = of.reason or str(error)

    def _take(self, now: int, of: _Topic, data: bytes, wire: Wire) -> None:
        if of.type == STRING:
            text = string_of(data, wire)
            of.texts.pop(text, None)
            of.texts[text] = None
        elif of.type == TF:
            for part in transforms_of(data, wire):
                parent, child = part.parent.lstrip('/'), part.child.lstrip('/')
                told = StaticTransform(parent, child, part.xyz, part.rotation)
                if self._transforms.get(child, told) != told:
                    self.doubts.append(f'/tf_static has different transforms of {child}')
                self._transforms[child] = told
        else:
            kind = JOINT_STATE if of.type == JOINT_STATE.type else IMU
            of.decoder = of.decoder or Decoder(kind, wire)
            sample: JointStateSample | ImuSample = of.decoder.one(data)
            if len(of.frames) < 8:
                of.frames[sample.frame_id] = None
            if isinstance(sample, JointStateSample):
                of.joints.take(now, sample)
            else:
                of.imus.take(now, sample)

    def evidence(self, urdf: Urdf | None = None) -> Evidence:
        """Return what was told; joint states are those of the topic that fits the URDF best.

        `urdf` is the robot's where it is known already, else that of /robot_description is taken.
        """
        doubts = [*dict.fromkeys(self.doubts), *self._odd()]
        where, text = self._description(doubts)
        if urdf is None and text is not None:
            try:
                urdf = read_urdf(text.encode(), f'/{DESCRIPTION}')
            except BadConfig as error:
                doubts.append(str(error))
        names = [] if urdf is None else [j.name for j in urdf.joints if j.kind != 'fixed']
        joints, rivals = self._joint_states(names, where, doubts)
        told, doubt = ((), '') if joints is None else self._topics[joints].joints.seen()
        doubts += [f'{joints}: {doubt}'] if doubt else []
        return Evidence(
            self.where,
            tuple(topic.seen(name) for name, topic in sorted(self._topics.items())),
            None if text is None else text.encode(),
            tuple(self._transforms.values()),
            joints,
            told,
            self._imus(doubts),
            tuple(doubts),
            rivals,
        )

    def _of(self, kind: str) -> dict[str, _Topic]:
        """Return the topics of a type that have messages, by name in order."""
        found = sorted(self._topics.items())
        return {name: of for name, of in found if of.type == kind and of.taken}

    def _odd(self) -> list[str]:
        """Return what is odd with single topics."""
        found = []
        for name, of in sorted(self._topics.items()):
            if of.malformed:
                found.append(
                    f'{name}: {of.malformed} of {of.taken} messages cannot be read: {of.reason}'
                )
            if of.joints.empty and of.joints.empty < of.taken:
                found.append(f'{name}: {of.joints.empty} of {of.taken} messages have no position')
            if of.type in _UNREAD:
                found.append(f'{of.type} on {name} is not read: {JOINT_STATE.type} is needed')
        return found

    def _description(self, doubts: list[str]) -> tuple[str, str | None]:
        """Return the topic of the URDF that fits the joints best, and the last one it told."""
        held = {n: [t for t in of.texts if '<robot' in t] for n, of in self._of(STRING).items()}
        held = {name: texts for name, texts in held.items() if texts}
        for name, texts in held.items():
            if len(texts) > 1:
                doubts.append(f'{name} has {len(texts)} different URDFs: the last one is used')
        if not held:
            return '', None
        last = {name: texts[-1] for name, texts in held.items()}
        chosen = max(last, key=lambda name: self._fits(last[name]))
        if len(set(last.values())) > 1:
            names = ' and '.join(last)
            doubts.append(f'{names} have different URDFs: that of {chosen} is used')
        return chosen, last[chosen]

    def _fits(self, text: str) -> int:
        """Return how many joints of a URDF are told by the topic that tells most of them."""
        try:
            urdf = read_urdf(text.encode(), DESCRIPTION)
        except BadConfig:
            return -1
        names = [joint.name for joint in urdf.joints if joint.kind != 'fixed']
        told = [of.joints.joints for of in self._of(JOINT_STATE.type).values()]
        return max((len(match_names(names, t).told) for t in told), default=0)

    def _joint_states(
        self, names: Sequence[str], description: str, doubts: list[str]
    ) -> tuple[str | None, tuple[str, ...]]:
        """Return the topic of joint states that fits best, and those that fit as well.

        Of several the one beside the topic `description` is taken, or called joint_states.
        """
        topics = self._of(JOINT_STATE.type)
        for name, of in topics.items():
            lost = of.joints.nowhere
            if lost and len(lost) < len(of.joints.joints):
                doubts.append(f'{name} names {", ".join(lost)} without a position')
        fits = {name: self._fit(of, names) for name, of in topics.items()}
        fits = {name: fit for name, fit in fits.items() if fit > (0, 0)}
        if not fits:
            return None, ()
        beside, most = description.rpartition('/')[0], max(fits.values())
        best = [name for name, fit in fits.items() if fit == most]
        liked = [n for n in best if description and n.rpartition('/')[0] == beside] or best
        liked = [n for n in liked if n.rpartition('/')[2] == 'joint_states'] or liked
        if len(liked) > 1:
            named = ' and '.join(liked)
            doubts.append(f'{named} fit equally well (two robots?): {liked[0]} is read')
        mine = set(match_names(names, topics[liked[0]].joints.joints).told)
        for name in fits:
            more = set(match_names(names, topics[name].joints.joints).told) - mine
            if more:
                listed = ', '.join(sorted(more))
                doubts.append(f'only {name} has {listed}, but only {liked[0]} is read')
        return liked[0], tuple(liked[1:])

    def _fit(self, of: _Topic, names: Sequence[str]) -> tuple[int, int]:
        """Return how many names of the URDF a topic tells, and how many names it has."""
        told = [name for name in of.joints.joints if name not in of.joints.nowhere]
        matched = len(match_names(names, told).told)
        return (matched, 0 if names and matched else len(told))

    def _imus(self, doubts: list[str]) -> tuple[SeenImu, ...]:
        found: list[SeenImu] = []
        for name, of in self._of(IMU.type).items():
            if not of.imus.frames:
                continue
            imus, odd = of.imus.seen(name)
            found += imus
            doubts += odd
        return tuple(found)
