"""Random sets of parameters put to a running monitor: each is wholly taken or wholly refused."""

from random import Random
from typing import Any

from hardening.outcome import Outcome
from nodes.live_case import live_nodes, parameter, ros_context, session_of

from ugv_acceptance.evaluation.sample_margins import Margins

# Parameter -> the values it is put to, some of them impossible.
VALUES = {
    'limits.torque_warn': (-1.0, 0.5, 0.8, 1.0, 1.5, 12.0),
    'limits.torque_error': (0.5, 1.0, 1.2, 2.0, 11.0),
    'limits.tip_warn_deg': (-100.0, 2.0, 10.0, 40.0),
    'limits.tip_error_deg': (-1.0, 5.0, 20.0, 95.0),
    'delays.off_s': (-0.1, 0.0, 1.0, float('nan'), float('inf')),
    'payload.mass_kg': (-1.0, 0.0, 1.0, 4.0, float('nan')),
    'payload.cog_m': ([0.0, 0.0], [0.0, 0.0, 0.0], [0.1, 0.0, 0.05]),
    'imu.attitude': ('auto', 'orientation', 'magnetometer'),
    'joints.shoulder_joint.limit_nm': (-1.0, 0.0, 0.5, 50.0),
}


def same(a: Any, b: Any) -> bool:
    """Return whether two values of a parameter are the same but for rounding."""
    if isinstance(a, (bool, str)):
        return bool(a == b)
    pairs = zip([a] if isinstance(a, float) else a, [b] if isinstance(b, float) else b, strict=True)
    return all(abs(x - y) <= 1e-9 * max(1.0, abs(x)) for x, y in pairs)


def trial(count: int, seed: int = 0) -> Outcome:
    """Put `count` sets, messages between them; compare what is told with what rules."""
    rng, taken, bad, seen = Random(seed), 0, list[str](), list[Margins]()
    with ros_context(), live_nodes() as live:
        monitor, driver = live.running()
        tunables = monitor.parameter_desk.tunables
        session_of(monitor).on_margins = lambda _stamp, margins: seen.append(margins)
        for k in range(count):
            names = rng.sample(sorted(VALUES), 1 + rng.randrange(4))
            values = {name: rng.choice(VALUES[name]) for name in names}
            before = {
                tunable.name: monitor.get_parameter(tunable.name).value for tunable in tunables
            }
            put = [parameter(name, value) for name, value in values.items()]
            answer = monitor.set_parameters_atomically(put)
            taken += answer.successful
            after = {
                tunable.name: monitor.get_parameter(tunable.name).value for tunable in tunables
            }
            wanted = before | values if answer.successful else before
            used = session_of(monitor).settings
            if any(not same(after[n], wanted[n]) for n in after):
                bad.append(f'{values}: told otherwise')
            if any(not same(tunable.get(used), after[tunable.name]) for tunable in tunables):
                bad.append(f'{values}: judged otherwise')
            if not answer.successful and not answer.reason:
                bad.append(f'{values}: refused without a reason')
            if k % 50 == 0:
                live.spin(0.02, driver.send)
    text = f'{count} sets: {taken} taken, {count - taken} refused, {len(bad)} mixed, '
    text += f'{len(seen)} margins meanwhile'
    return Outcome('; '.join([text, *bad[:1]]), not bad and 0 < taken < count and bool(seen))
