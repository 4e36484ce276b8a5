"""Cases of the two inputs: what an IMU and a driver of joints send that is odd, one thing each."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from cases.base import Base, base, moving, shaken, turn, upright
from made.judged import INCONCLUSIVE, PASS, Expected
from made.run import EPOCH, NS, Joints, Times

from ugv_acceptance.type_aliases import Floats

Made = Callable[[], Base]
OK = Expected((PASS,))
UNKNOWN = (INCONCLUSIVE,)


def _imu(**changes: Any) -> Base:
    made = base()
    return replace(made, imu=replace(made.imu, **changes))


def _all(vector: Floats | tuple[float, ...], rows: int = 1000) -> Floats:
    return np.tile(np.array(vector, np.float64), (rows, 1))


def _imu_dropout() -> Base:
    made = base()
    return replace(made, imu=made.imu.kept(made.imu.log < EPOCH + 7 * NS))


def _imu_disagree() -> Base:
    return _imu(orientation=_all(turn(math.radians(47.0))), force=_all((0.0, 0.0, 9.81)))


def _imu_nan_orientation() -> Base:
    made = base()
    orientation = made.imu.orientation.copy()
    orientation[:370] = math.nan
    return replace(made, imu=replace(made.imu, orientation=orientation))


def _imu_two() -> Base:
    made = base()
    other = replace(
        made.imu.kept(slice(1, None, 2)),
        frame='mast_imu',
        orientation=_all(turn(math.pi / 2.0), 500),
        force=_all((0.0, 9.81, 0.0), 500),
    )
    return replace(made, imu=made.imu.kept(slice(0, None, 2)), more=(other,))


def _gyro_deg() -> Base:
    rng = np.random.default_rng(20)
    lean = math.radians(28.0)
    return _imu(
        orientation=_all(turn(0.0, 0.0, math.radians(1.5))),
        rate=2.4 * rng.normal(size=(1000, 3)),
        force=_all(upright(lean)),
    )


IMU_CASES: dict[str, tuple[Made, Expected]] = {
    'frozen_imu': (base, Expected((PASS,))),
    'gravity_removed': (
        lambda: _imu(force=np.zeros((1000, 3))),
        Expected((INCONCLUSIVE, PASS), ('gravity',)),
    ),
    'gyro_deg_hides_wrong_orientation': (_gyro_deg, Expected(UNKNOWN)),
    'imu_10hz': (lambda: base(imu_hz=10), Expected((PASS,), ('10 Hz',))),
    'imu_covariance_accel_minus1': (
        lambda: _imu(covariances=(0.01, -1.0, -1.0)),
        Expected(
            (PASS, INCONCLUSIVE),
            (r'acceleration[^"\n]*(not given|absent|not checked|-1)|no acceleration',),
        ),
    ),
    'imu_disagree_then_fail': (_imu_disagree, Expected(UNKNOWN, ('disagree',))),
    'imu_dropout': (
        _imu_dropout,
        Expected(UNKNOWN, (r'no message from imu|imu.*stale|stale.*imu', r'7[01]\.\d %|3\.\d+ s')),
    ),
    'imu_frame_slash': (lambda: _imu(frame='/imu_link'), OK),
    'imu_in_g': (
        lambda: _imu(
            orientation=np.zeros((1000, 4)), force=_all((0.02, -0.01, 1.0)), covariances=(0.0,) * 3
        ),
        Expected(UNKNOWN, (r'\bg\b',)),
    ),
    'imu_nan_orientation': (_imu_nan_orientation, Expected((PASS,), never=('DANGER',))),
    'imu_ned_flat': (
        lambda: _imu(force=_all((0.1, 0.1, -9.81)), covariances=(-1.0, 0.0, 0.0)),
        Expected(UNKNOWN, ('mounting|upside down', 'decides nothing')),
    ),
    'imu_two_publishers': (_imu_two, Expected((INCONCLUSIVE, PASS), ('frame',))),
    'quaternion_degrees': (
        lambda: _imu(orientation=_all((1.2, -2.4, 31.0, 0.0))),
        Expected((PASS,), ('orientation',)),
    ),
    'vibration_good': (
        lambda: replace(base(), imu=shaken(0.14, 0.9, 21)),
        OK,
    ),
    'vibration_hides_wrong_orientation': (
        lambda: replace(base(), imu=shaken(0.16, 1.1, 22, math.radians(27.0))),
        Expected(UNKNOWN),
    ),
}


def _joints(**changes: Any) -> Base:
    made = base()
    return replace(made, joints=replace(made.joints, **changes))


def _degrees(rate: float = 0.0) -> Base:
    made = base()
    pose = np.array((3.0, 57.0, 83.0, 175.0))
    position = np.tile(pose, (500, 1))
    position[:, 1] += rate * np.arange(500) / 50.0
    velocity = np.zeros_like(position)
    velocity[:, 1] = rate
    return replace(made, joints=replace(made.joints, position=position, velocity=velocity))


def _scaled(factor: float) -> Base:
    made = base()
    assert made.joints.effort is not None
    return _joints(effort=made.joints.effort * factor)


def _every_second_empty() -> Base:
    made = base()
    none = np.zeros((250, 0))
    k = np.arange(500)
    empty = Joints((), made.joints.log[k % 2 == 0], made.joints.stamp[k % 2 == 0], none, none, none)
    return replace(made, joints=made.joints.kept(k % 2 == 1), more=(empty,))


def _homing() -> Base:
    made = base()
    position = made.joints.position.copy()
    position[260:, 1] += math.radians(13.0)
    return replace(made, joints=replace(made.joints, position=position))


def _orders(seed: int = 23) -> Base:
    made, rng = base(), np.random.default_rng(seed)
    parts = []
    for k in range(500):
        one, order = made.joints.kept(slice(k, k + 1)), rng.permutation(4)
        assert one.velocity is not None
        assert one.effort is not None
        parts.append(
            replace(
                one,
                names=tuple(one.names[i] for i in order),
                position=one.position[:, order],
                velocity=one.velocity[:, order],
                effort=one.effort[:, order],
            )
        )
    return replace(made, joints=parts[0], more=tuple(parts[1:]))


def _partial() -> Base:
    made = base()
    tables = ('position', 'velocity', 'effort')
    arm = {n: getattr(made.joints, n)[:, :3] for n in tables}
    flipper = {n: getattr(made.joints, n)[:, 3:] for n in tables}
    slow = replace(made.joints, names=made.joints.names[3:], **flipper).kept(slice(0, None, 5))
    return replace(
        made, joints=replace(made.joints, names=made.joints.names[:3], **arm), more=(slow,)
    )


def _nan_start() -> Base:
    made = base()
    position = made.joints.position.copy()
    position[:140] = math.nan
    return replace(made, joints=replace(made.joints, position=position))


def _prefixed(prefix: str, *, beside: bool = False) -> Base:
    made = base()
    other = replace(made.joints, names=tuple(prefix + n for n in made.joints.names))
    return replace(made, more=(other,)) if beside else replace(made, joints=other)


def _velocity_deg() -> Base:
    made = moving(0, 17.0)
    assert made.joints.velocity is not None
    return replace(made, joints=replace(made.joints, velocity=np.degrees(made.joints.velocity)))


def _wrapped() -> Base:
    made = moving(0, 9.0, math.radians(341.0))
    position = made.joints.position.copy()
    position[:, 0] %= 2.0 * math.pi
    return replace(made, joints=replace(made.joints, position=position))


PUSHES = 'pushes against'
JOINT_CASES: dict[str, tuple[Made, Expected]] = {
    'base': (base, OK),
    'degrees': (_degrees, Expected(UNKNOWN, ('degrees|rad',))),
    'degrees_moving': (lambda: _degrees(9.0), Expected(UNKNOWN, ('degrees|rad, not',))),
    'effort_currents': (
        lambda: _scaled(0.15),
        Expected((PASS,), (r'scale|15 ?%|0\.15',), (PUSHES, '-[0-9.]+ kg')),
    ),
    'effort_gravity_compensated': (
        lambda: _scaled(0.0),
        Expected((PASS,), ('gravity|zero|constant',), (PUSHES, '-[1-9][0-9.]* kg')),
    ),
    'effort_nan': (
        lambda: _joints(effort=np.full((500, 4), math.nan)),
        Expected((PASS,), ('no measured effort',), ('[0-9] alert',)),
    ),
    'effort_sign_flipped': (
        lambda: _scaled(-1.0),
        Expected((PASS, INCONCLUSIVE), ('opposite sign|other sign|effort_sign',), (PUSHES,)),
    ),
    'empty_joint_states': (_every_second_empty, OK),
    'joint_jump_homing': (_homing, Expected((PASS, INCONCLUSIVE), ('jump|leap|homed|step',))),
    'name_order_changes': (_orders, OK),
    'names_empty_positions': (
        lambda: _joints(names=(), velocity=np.zeros((500, 0)), effort=np.zeros((500, 0))),
        Expected(UNKNOWN, ('names? .*(empty|missing|none)|no names|0 names|empty names',)),
    ),
    'partial_messages': (_partial, Expected((PASS,), never=('stale', 'no longer updated'))),
    'position_nan_start': (_nan_start, Expected(UNKNOWN, ('nan',))),
    'position_shorter': (
        lambda: _joints(position=base().joints.position[:, :3]),
        Expected(UNKNOWN, ('malformed',)),
    ),
    'prefixed_names': (lambda: _prefixed('bot7_'), Expected(UNKNOWN, ('bot7_shoulder_joint',))),
    'rate_mismatch_2hz': (
        lambda: base(hz=2),
        Expected((PASS, INCONCLUSIVE), ('rate.*low|low.*rate|stale|2 Hz',)),
    ),
    'two_publishers_prefixed': (lambda: _prefixed('arm42_', beside=True), OK),
    'velocity_only_some': (
        lambda: _joints(velocity=np.zeros((500, 2)), effort=np.zeros((500, 1))),
        Expected((PASS,), never=(PUSHES,)),
    ),
    'velocity_units': (_velocity_deg, Expected((PASS, INCONCLUSIVE), ('velocit',))),
    'wrap_0_2pi': (_wrapped, Expected((PASS,), never=('POSITION_LEAP', 'STATIC_MODEL'))),
}


def _stamps(change: Callable[[Times], Times], *, imu: bool = True, joints: bool = True) -> Base:
    made = base()
    if joints:
        made = replace(made, joints=replace(made.joints, stamp=change(made.joints.stamp)))
    if imu:
        made = replace(made, imu=replace(made.imu, stamp=change(made.imu.stamp)))
    return made


CLOCK = Expected((PASS,), ('CLOCK',))
TIME_CASES: dict[str, tuple[Made, Expected]] = {
    'clock_offset_topics': (
        lambda: _stamps(lambda t: t - 4 * NS, joints=False),
        Expected((PASS,), ('CLOCK',)),
    ),
    'late_messages_50ms': (
        lambda: _stamps(lambda t: t - NS * 17 // 100, imu=False),
        Expected((PASS,)),
    ),
    'sim_stamps': (lambda: _stamps(lambda t: t - EPOCH + 15 * NS), CLOCK),
    'stamp_zero': (lambda: _stamps(lambda t: t * 0, imu=False), CLOCK),
    'stamps_jump_back': (
        lambda: _stamps(lambda t: np.where(t < EPOCH + 5 * NS, t, t - 6 * NS)),
        CLOCK,
    ),
}
