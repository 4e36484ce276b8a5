"""What is known of the torques of joints that carried the robot in a run, and what is not.

A joint between the base and the ground carries a part of the robot's weight. The part follows from
balance on three points only; on more it is taken as evenly spread, and the moment at which that
brought the joint furthest is told with the interval that balance leaves.
"""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ugv_acceptance.evaluation.criteria.statement import NotChecked, Statement
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.reactions import Reactions, reactions_of
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import stances_of, standing
from ugv_acceptance.type_aliases import Json

# Ends of an interval this close (share of the larger one, and N m; N) are one.
SHARE, SLACK = 0.01, 0.05
# So many joints are named in a sentence.
FEW = 4
Gravity = tuple[float, float, float]


def reactions_at(
    settings: Settings, q: Sequence[float], gravity: Gravity, payload: Payload
) -> Reactions:
    """Return what is known of all torques in one posture `q` (j,) under `gravity` (m/s2)."""
    mechanics = mechanics_of(settings.robot)
    posture = posture_of(mechanics, q, payload.mass, payload.cog)
    points = standing(stances_of(mechanics, posture), gravity).points
    return reactions_of(mechanics, posture, points, gravity)


def judged_by_effort(data: Json) -> set[str]:
    """Return the joints that carried the robot and are judged by their measured torque.

    `data` is the part of a result that `CarryingJoints` states.
    """
    return {name for name, told in data.get('carrying', {}).items() if told['by_effort']}


def name_measured(data: Json, statements: Sequence[Statement]) -> None:
    """Say in `data` which joints that carried have a measured effort known to be their torque."""
    known = frozenset().union(*(statement.torques for statement in statements))
    for name, told in data.get('carrying', {}).items():
        told['by_effort'] = name in known


@dataclass(frozen=True, slots=True)
class _Moment:
    """One row: time of receipt (ns), posture (j,), gravity (m/s2), and when its posture came."""

    time: int
    q: tuple[float, ...]
    gravity: Gravity
    posture_time: int


@dataclass(slots=True)
class CarryingJoints:
    """Finds the worst moment of each joint that carried: an examination.

    `payload_at` returns the payload in force at a time (ns), `carrying` the numbers of the joints
    that carried the robot so far.
    """

    settings: Settings
    payload_at: Callable[[int], Payload]
    carrying: Callable[[], Collection[int]]
    _most: dict[int, float] = field(default_factory=dict)
    _worst: dict[int, _Moment] = field(default_factory=dict)

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        for joint in self.carrying():
            size = np.nan_to_num(np.abs(rows.torque[:, joint]))
            if not len(size) or size.max() <= self._most.get(joint, 0.0):
                continue
            k = int(size.argmax())
            j, i = int(rows.pairs.of_joints[k]), int(rows.pairs.of_imu[k])
            self._most[joint] = float(size[k])
            x, y, z = rows.pairs.imu.gravity[i].tolist()
            q = tuple(rows.pairs.joints.q[j].tolist())
            when = int(rows.pairs.joints.time[j])
            self._worst[joint] = _Moment(int(rows.time[k]), q, (x, y, z), when)

    def statement(self, start: int, end: int) -> Statement:
        """Return the worst moments, and what about these joints was not checked."""
        del end
        found = {j: self._found(j, moment, start) for j, moment in sorted(self._worst.items())}
        if not found:
            return Statement()
        names = self.settings.robot.joint_names
        result = {'carrying': {names[j]: told for j, told in found.items()}}
        return Statement(result, not_checked=tuple(self._not_checked(result['carrying'])))

    def _found(self, joint: int, moment: _Moment, start: int) -> Json:
        payload = self.payload_at(moment.posture_time)
        found = reactions_at(self.settings, moment.q, moment.gravity, payload)
        limit = self.settings.limits.torque[joint]
        ends: Any = (found.hanging, found.even, found.least, found.most)
        hanging, even, least, most = (float(of[joint]) for of in ends)
        return {
            'unit': self.settings.robot.joint(self.settings.robot.joint_names[joint]).units.effort,
            'limit': limit if math.isfinite(limit) else None,
            'time_s': (moment.time - start) / 1e9,
            'hanging': hanging,
            'even': even,
            'least': least,
            'most': most,
            'by_effort': False,
        }

    def _not_checked(self, carrying: dict[str, Json]) -> Iterator[NotChecked]:
        open_ended = [name for name, told in carrying.items() if _is_open(told)]
        if open_ended:
            worst = max(open_ended, key=lambda name: _use(carrying[name]))
            told = carrying[worst]
            even, most = abs(told['even']), max(abs(told['least']), abs(told['most']))
            unit, known = told['unit'], told['limit'] is not None
            limit = f'; its limit is {told["limit"]:.1f} {unit}' if known else ''
            why = (
                f'it is taken as even, which puts {even:.1f} {unit} on {worst} at '
                f'{told["time_s"]:.1f} s; {most:.1f} {unit} cannot be excluded{limit}'
            )
            yield NotChecked('how the contact points share the weight', why)
        named, more = list(carrying)[:FEW], len(carrying) - FEW
        names = ', '.join(named) + (f' and {more} more joints' if more > 0 else '')
        why = (
            'feet, flippers and tracks brace against each other: friction may add to the torque of '
            f'{names}'
        )
        yield NotChecked('friction on the ground', why)


def _is_open(told: Json) -> bool:
    low, high = told['least'], told['most']
    return bool(high - low > SLACK + SHARE * max(abs(low), abs(high)))


def _use(told: Json) -> float:
    """Return how much of its limit a joint may need; of one without a limit its torque."""
    most = max(abs(told['least']), abs(told['most']))
    return float(most / told['limit'] if told['limit'] else most * 1e-9)
