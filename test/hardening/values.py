"""Numbers and names that a broken driver sends: which fault is named, and that nothing is OK."""

import math
from dataclasses import dataclass, replace

from evaluation.streams import MS, REST, T0, Imu, Joints, give, settings, tilted, upright
from hardening.outcome import Outcome

from ugv_acceptance.evaluation.alerts.messages import advice
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import ImuInput, Settings

LEAN = tilted(0.1, 0.05)
GOOD_JOINTS, GOOD_IMU = Joints(0), Imu(0, LEAN, acceleration=upright(LEAN))
NAN, INF = math.nan, math.inf
TOLD = settings(ImuInput(frame='imu_link'))
FORCED = settings(ImuInput(specific_force=True))


def endless(of: Settings) -> Settings:
    """Return settings of a robot whose lift turns without end."""
    lift = replace(of.robot.joints[0], kind='continuous', lower=-INF, upper=INF)
    return replace(of, robot=replace(of.robot, joints=(lift, of.robot.joints[1])))


@dataclass(frozen=True, slots=True)
class Case:
    """What is sent for three seconds, and the code that must name it; '' where none may be needed.

    `known` says whether margins may stay: from the other of orientation and accelerometer. `early`:
    only until the alert's delay is over. `moving` is what the first position changes by a second.
    """

    code: str
    joints: Joints = GOOD_JOINTS
    imu: Imu = GOOD_IMU
    known: bool = False
    early: bool = False
    moving: float = 0.0
    told: Settings = TOLD


def _joints(*position: float, names: tuple[str, ...] = GOOD_JOINTS.names) -> Joints:
    return replace(GOOD_JOINTS, names=names, position=position)


def _imu(orientation: tuple[float, ...] = LEAN, force: tuple[float, ...] = REST) -> Imu:
    return Imu(0, orientation, acceleration=force)


CASES = {
    'position NaN': Case('INPUT_INVALID', _joints(NAN, 0.0)),
    'position infinite': Case('INPUT_INVALID', _joints(INF, 0.0)),
    'position 1e308': Case('INPUT_INVALID', _joints(1e308, 0.0)),
    'degrees for radians': Case('INPUT_INVALID', _joints(57.3, 0.0)),
    'fewer positions than names': Case('INPUT_STALE', _joints(0.1)),
    'no positions': Case('INPUT_STALE', _joints()),
    'empty names': Case('INPUT_STALE', _joints(0.1, 0.0, names=('', ''))),
    'no names': Case('INPUT_STALE', _joints(names=())),
    'a joint twice': Case(
        'INPUT_INCOMPLETE', _joints(0.1, 0.1, 0.0, names=('lift', 'lift', 'hand_slide'))
    ),
    'a joint renamed': Case('INPUT_INCOMPLETE', _joints(0.1, 0.0, names=('lift', 'slide_2'))),
    'all joints renamed': Case('INPUT_STALE', _joints(0.1, 0.0, names=('a', 'b'))),
    'quaternion NaN, acceleration NaN': Case('INPUT_INVALID', imu=_imu((NAN,) * 4, (NAN,) * 3)),
    'quaternion 1e308, acceleration infinite': Case(
        'INPUT_INVALID', imu=_imu((1e308,) * 4, (INF,) * 3)
    ),
    'quaternion zero': Case('IMU_ORIENTATION', imu=_imu((0.0,) * 4, upright(LEAN)), known=True),
    'quaternion of norm 196': Case(
        'IMU_ORIENTATION', imu=_imu((100.0, 100.0, 100.0, 92.0), upright(LEAN)), known=True
    ),
    'quaternion NaN': Case('IMU_ORIENTATION', imu=_imu((NAN,) * 4, upright(LEAN)), known=True),
    'identity orientation': Case(
        'IMU_ORIENTATION', imu=_imu((0.0, 0.0, 0.0, 1.0), upright(LEAN)), known=True
    ),
    # REP-145's way to say that there is no orientation: a state of the input, no fault.
    'covariance -1': Case(
        '', imu=replace(_imu(tilted(0.5), upright(LEAN)), covariance_0=-1.0), known=True
    ),
    'orientation apart from acceleration': Case(
        'IMU_INCONSISTENT', imu=_imu(tilted(0.5), REST), early=True
    ),
    'wrong frame': Case('IMU_FRAME', imu=replace(GOOD_IMU, frame='other_imu')),
    'quaternion zero, acceleration in g': Case(
        'IMU_NO_GRAVITY', imu=_imu((0.0,) * 4, (0.0, 0.0, 1.0))
    ),
    'acceleration in g': Case('IMU_GRAVITY', imu=_imu(LEAN, (0.0, 0.0, 1.0)), early=True),
    'gravity removed': Case('IMU_GRAVITY', imu=_imu(LEAN, (0.01, 0.0, 0.02)), early=True),
    'specific force in g': Case('IMU_NO_GRAVITY', imu=_imu(LEAN, (0.0, 0.0, 1.0)), told=FORCED),
    'specific force without gravity': Case(
        'IMU_NO_GRAVITY', imu=_imu(LEAN, (0.01, 0.0, 0.02)), told=FORCED
    ),
    'raw counts': Case('INPUT_INVALID', imu=_imu(LEAN, (0.0, 0.0, 16384.0))),
    'acceleration NaN': Case('INPUT_INVALID', imu=_imu(LEAN, (NAN,) * 3)),
    'degrees of an endless joint that moves': Case(
        'POSITION_LEAP', early=True, moving=57.3, told=endless(TOLD)
    ),
    'IMU upside down': Case(
        'IMU_MOUNTING', imu=_imu(tilted(3.0), upright(tilted(3.0))), early=True
    ),
    'IMU quarter turned': Case(
        'IMU_MOUNTING', imu=_imu(tilted(1.57), upright(tilted(1.57))), early=True
    ),
}


@dataclass(frozen=True, slots=True)
class Trial:
    """Codes of the alerts, evaluations made, whether all margins were finite, and known at last."""

    codes: set[str]
    evaluated: int
    finite: bool
    known: bool

    def failing(self, case: Case) -> str:
        """Return what is not as it must be; '' where all is."""
        if case.code and not (case.code in self.codes and advice(case.code)):
            return f'not named {case.code}, but {sorted(self.codes)}'
        if not case.code and self.codes - {'TIP_OVER', 'TORQUE_LIMIT'}:
            return f'named {sorted(self.codes)}'
        if self.known is not case.known:
            return f'margins known at last: {self.known}'
        if self.evaluated and not (case.known or case.early):
            return f'{self.evaluated} margins computed'
        return '' if self.finite else 'margins that are no numbers'


def trial(name: str) -> Trial:
    """Send a case for three seconds."""
    case = CASES[name]
    evaluator = LiveEvaluator(case.told)
    evaluator.start(T0)
    finite = True
    for k in range(150):
        position = case.joints.position
        if case.moving:
            position = (position[0] + case.moving * k * 0.02, *position[1:])
        for offset, message in ((0, replace(case.joints, position=position)), (1, case.imu)):
            margins = give(evaluator, replace(message, time=T0 + k * 20 * MS + offset))
            if margins is not None:
                finite = finite and all(map(math.isfinite, margins.torque))
        evaluator.tick(T0 + k * 20 * MS + 10 * MS)
    codes = {a.rule.code for a in evaluator.watch.log}
    return Trial(codes, evaluator.evaluated, finite, evaluator.margins is not None)


def outcomes() -> list[Outcome]:
    """Send every case."""
    failing = {name: trial(name).failing(case) for name, case in CASES.items()}
    bad = [f'{name}: {what}' for name, what in failing.items() if what]
    named = len({case.code for case in CASES.values() if case.code})
    text = f'{len(CASES) - len(bad)} of {len(CASES)} cases as they must be, {named} codes'
    return [Outcome('; '.join([text, *bad]), not bad)]
