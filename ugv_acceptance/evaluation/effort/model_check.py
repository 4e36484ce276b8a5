"""Compares the efforts of a run with the static model, and states what speaks against a verdict.

First what each joint's effort means (meaning.py), from the robot at rest; then only what that
meaning allows: bias, scale and friction of torques, what was carried, measured saturation, and
differences from the model larger than the margin that was left.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection, Statement
from ugv_acceptance.evaluation.criteria.uncertainty import Source
from ugv_acceptance.evaluation.downsampling import Sampler
from ugv_acceptance.evaluation.effort.facts import NONE, SCALED, UNKNOWN, WITHOUT, JointMeaning
from ugv_acceptance.evaluation.effort.joint_check import REST, JointSamples, check_joint, counts
from ugv_acceptance.evaluation.effort.meaning import ZERO
from ugv_acceptance.evaluation.effort.measured import MeasuredLimits, in_another_unit
from ugv_acceptance.evaluation.effort.rests import find_rests, reaches
from ugv_acceptance.evaluation.effort.understanding import Understanding, understand
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Floats, Json

# Time between samples (ns).
SPACING = 100_000_000
# An effort at this share of the joint's limit or above is clipped: it says nothing about the load.
CLIPPED = 0.99

# A unit is that of a scaled effort if the ends of its ratio are at most this many times apart.
SURE_UNIT = 3.0


@dataclass(slots=True)
class ModelCheck:
    """Gathers samples of a run (at most ten a second) and compares them with the model.

    It is an examination: its statement is `model_check` of the result, objections, and which
    efforts could not be used. `sources` are the uncertainty of the model, as configured, `carrying`
    the numbers of the joints that carried the robot so far.
    """

    settings: Settings
    sources: tuple[Source, ...] = ()
    carrying: Callable[[], Collection[int]] = tuple
    _samples: Sampler = field(default_factory=lambda: Sampler(SPACING))
    _limits: MeasuredLimits = field(init=False)

    def __post_init__(self) -> None:
        self._limits = MeasuredLimits(self.settings)

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording, but none of a robot that has tipped.

        It may rest on its arm, and then the efforts do not hold the arm against gravity.
        """
        self._samples.add(rows, standing=True)
        self._limits.add(rows)

    def understanding(self) -> Understanding:
        """Return what the efforts so far mean and say."""
        time, samples = self._samples.samples(len(self.settings.joints))
        rests = find_rests(time, samples, reaches(self.settings))
        found = understand(self.settings, self.sources, rests)
        return replace(found, joints=tuple(map(self._seen_at_all, found.joints, self._limits.most)))

    @staticmethod
    def _seen_at_all(joint: JointMeaning, most: float) -> JointMeaning:
        """Return what an effort means; one that is 0 at rest alone is not one that is always 0."""
        if joint.meaning != NONE or most < ZERO:
            return joint
        return replace(joint, meaning=UNKNOWN, below='')

    def statement(self, start: int, end: int) -> Statement:
        """Return what the efforts say of the recording from `start` to `end` (ns)."""
        del end
        found = self.understanding()
        loads = tuple(_load_objections(found, start))
        told = self._limits.objections(found.joints, start, self.carrying())
        objections = (*told, *loads)
        result = {'model_check': self.result(found, start)}
        # An encoder is called frozen because the effort changed: not by an effort in another unit.
        # But an effort that hardly follows the torque may look like one because the encoder is.
        other_unit = [x for x in found.joints if in_another_unit(x, found.joints)]
        no_torque = [x.joint for x in other_unit if x.ratio and x.ratio.spread <= SURE_UNIT]
        unfounded = frozenset(('ENCODER_FROZEN', name) for name in no_torque)
        known = frozenset(joint.joint for joint in found.joints if joint.sign is not None)
        return Statement(result, objections, tuple(_not_checked(found)), unfounded, known)

    def result(self, found: Understanding, start: int) -> Json:
        """Return the comparison for JSON: joints, loads, contacts, share of slow samples."""
        time, (effort, torque, rate, _, _) = self._samples.samples(len(found.joints))
        slow = np.abs(np.nan_to_num(rate)).max(axis=1, initial=0.0) <= REST
        limits = np.array(self.settings.limits.torque)
        clipped = np.abs(effort) >= CLIPPED * limits
        joints = {}
        for j, joint in enumerate(found.joints):
            told: Json = {
                'meaning': joint.meaning,
                'unit': joint.unit,
                'probability': _digits(joint.probability),
                'sentence': joint.sentence,
                'do': joint.do,
                'ratio': _ratio(found, j),
            }
            measured = np.where(clipped[:, j], np.nan, effort[:, j]) * (joint.fact.sign or 1.0)
            margin = limits[j] - np.abs(torque[:, j])
            columns = measured, torque[:, j], rate[:, j], margin, clipped[:, j], slow
            samples = JointSamples(*columns)
            told |= counts(samples)
            if joint.weighs:
                told |= check_joint(samples)
            joints[joint.joint] = told
        return {
            'samples': len(time),
            'spacing_s': self._samples.spacing / 1e9,
            'speed_validity': self._speed_validity(rate),
            'postures': len(found.rests.start),
            'joints': joints,
            'payload_link': found.link,
            'loads': [_load_json(found, k, start) for k in range(len(found.loads))],
            'contacts': [_contact_json(found, k, start) for k in range(len(found.contacts))],
            'findings': list(_findings(found, start)),
        }

    def _speed_validity(self, rate: Floats) -> Json:
        """Return the share of samples in which every joint was slow enough for the static model."""
        speeds = self.settings.limits.speed or (np.inf,) * rate.shape[1]
        bounds = np.array(speeds)
        judged = np.isfinite(bounds) & np.isfinite(rate).any(axis=0)
        if not judged.any():
            return {'share': None, 'joints': []}
        slow = (np.nan_to_num(np.abs(rate[:, judged])) <= bounds[judged]).all(axis=1)
        names = np.array(self.settings.robot.joint_names)[judged]
        return {'share': float(slow.mean()), 'joints': names.tolist()}


def _digits(value: float) -> float:
    """Return a number with nine digits: the last ones of an inverse differ from run to run."""
    return float(f'{value:.9g}')


def _ratio(found: Understanding, j: int) -> Json | None:
    ratio = found.joints[j].ratio
    if ratio is None:
        return None
    return {
        'value': _digits(ratio.value),
        'low': _digits(ratio.low),
        'high': _digits(ratio.high),
    }


def _load_json(found: Understanding, k: int, start: int) -> Json:
    load = found.loads[k]
    begin, end = found.span(load)
    return {
        'start_s': (begin - start) / 1e9,
        'end_s': (end - start) / 1e9,
        'mass_kg': {
            'value': _digits(load.mass),
            'low': _digits(load.mass - load.half),
            'high': _digits(load.mass + load.half),
        },
        'declared_kg': _digits(load.declared),
        'differs': load.differs,
    }


def _contact_json(found: Understanding, k: int, start: int) -> Json:
    contact = found.contacts[k]
    return {
        'start_s': (int(found.rests.start[contact.row]) - start) / 1e9,
        'end_s': (int(found.rests.end[contact.row]) - start) / 1e9,
        'joint': found.joints[contact.joint].joint,
        'extra': _digits(contact.extra),
        'unit': found.joints[contact.joint].unit,
    }


def _when(begin: int, end: int, start: int) -> str:
    return f'{(begin - start) / 1e9:.1f} to {(end - start) / 1e9:.1f} s'


def _load_objections(found: Understanding, start: int) -> Iterator[Objection]:
    """Object to a load that is surely not the declared one."""
    other = [load for load in found.loads if load.differs]
    if not other:
        return
    lines = [f'{_when(*found.span(x), start)}: {found.load_words(x)}' for x in other]
    yield Objection('payload', 'INCONCLUSIVE', lines[0], tuple(lines[1:]))


def _findings(found: Understanding, start: int) -> Iterator[str]:
    """Yield what somebody should know or do, one sentence each."""
    for joint in found.joints:
        if joint.meaning in {SCALED, WITHOUT} or joint.opposed:
            yield ': '.join(part for part in (joint.sentence, joint.do) if part)
    for load in found.loads:
        if load.differs:
            yield f'{_when(*found.span(load), start)}: {found.load_words(load)}'
    for contact in found.contacts:
        begin, end = int(found.rests.start[contact.row]), int(found.rests.end[contact.row])
        yield f'{_when(begin, end, start)}: {found.contact_words(contact)}'


def _not_checked(found: Understanding) -> Iterator[NotChecked]:
    """Yield which efforts could not be used, and forces that the margins do not count."""
    reasons: dict[str, list[str]] = {}
    for joint in found.joints:
        if joint.why:
            reasons.setdefault(joint.why, []).append(joint.joint)
    for why, names in reasons.items():
        yield NotChecked(f'measured effort of {", ".join(names)}', why)
    turned = [joint for joint in found.joints if joint.opposed]
    if turned:
        listed = ', '.join(joint.joint for joint in turned)
        why = 'it is opposite: set effort_sign: -1 for each in the configuration'
        yield NotChecked(f'sign of the measured effort of {listed}', why)
    if not found.loads:
        why = 'no joint with a measured torque of known scale and sign weighs it'
        yield NotChecked('the payload that was carried', why)
    for contact in found.contacts:
        rests, row = found.rests, contact.row
        seconds = (int(rests.end[row]) - int(rests.start[row])) / 1e9
        what = f'forces from outside on {found.joints[contact.joint].joint}'
        yield NotChecked(what, found.contact_words(contact), seconds)
