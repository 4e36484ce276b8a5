"""Numbers and names that a broken driver sends: which fault is named, and that nothing is OK."""

import math
from dataclasses import dataclass, replace

from evaluation.streams import MS, REST, T0, Imu, Joints, give, settings, tilted, upright
from hardening.outcome import Outcome

from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.wording import advice

LEAN = tilted(0.1, 0.05)
GOOD_JOINTS, GOOD_IMU = Joints(0), Imu(0, LEAN, acceleration=upright(LEAN))
NAN, INF = math.nan, math.inf


@dataclass(frozen=True, slots=True)
class Case:
    """What is sent for three seconds, and the code that must name it; '' where none may be needed.

    `known` says whether margins may be computed: from the other of orientation and accelerometer.
    """

    code: str
    joints: Joints = GOOD_JOINTS
    imu: Imu = GOOD_IMU
    known: bool = False


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
    'quaternion zero': Case('', imu=_imu((0.0,) * 4, upright(LEAN)), known=True),
    'quaternion of norm 196': Case(
        '', imu=_imu((100.0, 100.0, 100.0, 92.0), upright(LEAN)), known=True
    ),
    'identity orientation': Case('', imu=_imu((0.0, 0.0, 0.0, 1.0), upright(LEAN)), known=True),
    'covariance -1': Case(
        '', imu=replace(_imu(tilted(0.5), upright(LEAN)), covariance_0=-1.0), known=True
    ),
    # Margins until the alert's delay is over.
    'orientation apart from acceleration': Case(
        'IMU_INCONSISTENT', imu=_imu(tilted(0.5), REST), known=True
    ),
    'quaternion zero, acceleration in g': Case(
        'INPUT_INVALID', imu=_imu((0.0,) * 4, (0.0, 0.0, 1.0))
    ),
    'acceleration in g': Case('IMU_GRAVITY', imu=_imu(LEAN, (0.0, 0.0, 1.0)), known=True),
    'gravity removed': Case('IMU_GRAVITY', imu=_imu(LEAN, (0.01, 0.0, 0.02)), known=True),
    'raw counts': Case('INPUT_INVALID', imu=_imu(LEAN, (0.0, 0.0, 16384.0)), known=True),
    'IMU upside down': Case('TIP_OVER', imu=_imu(tilted(3.0), upright(tilted(3.0))), known=True),
    'IMU quarter turned': Case(
        'TIP_OVER', imu=_imu(tilted(1.57), upright(tilted(1.57))), known=True
    ),
}


def trial(name: str) -> tuple[set[str], int, bool]:
    """Return the codes of the alerts, the evaluations made, and whether all margins were finite."""
    case, evaluator = CASES[name], LiveEvaluator(settings())
    evaluator.start(T0)
    finite = True
    for k in range(150):
        for offset, message in ((0, case.joints), (1, case.imu)):
            margins = give(evaluator, replace(message, time=T0 + k * 20 * MS + offset))
            if margins is not None:
                finite = finite and all(map(math.isfinite, margins.torque))
        evaluator.tick(T0 + k * 20 * MS + 10 * MS)
    return {a.rule.code for a in evaluator.watch.log}, evaluator.evaluated, finite


def outcomes() -> list[Outcome]:
    """Send every case."""
    bad, silent = [], []
    for name, case in CASES.items():
        codes, evaluated, finite = trial(name)
        named = case.code in codes and advice(case.code) if case.code else True
        if not (named and finite and (case.known or not evaluated)):
            bad.append(f'{name} gave {sorted(codes)} and {evaluated} margins')
        if not case.code:
            silent.append(name)
    text = f'{len(CASES) - len(bad)} of {len(CASES)} cases as they must be'
    text += f'; without an alert, margins from the accelerometer alone: {", ".join(silent)}'
    return [Outcome('; '.join([text, *bad]), not bad)]
