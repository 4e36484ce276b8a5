"""Whether the live monitor judged by what a recording is judged by here, as far as that was told.

`ugv-acceptance record` writes the monitor's parameters in force into the recording. Where they are
not those of this evaluation, its alerts may be others; with another load a PASS would prove little.
"""

import math
from collections.abc import Iterator, Sequence

from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.bag.told_parameters import ToldParameters, parameters_in
from ugv_acceptance.evaluation.criteria.criteria import FAIL, INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.safeguards import with_objection
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection
from ugv_acceptance.evaluation.criteria.verdict import not_checked_json
from ugv_acceptance.evaluation.inputs.payload import PayloadLog
from ugv_acceptance.evaluation.permitted_limits import RANGES, limits_hash, torque_name
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.offline.evaluation import Judgement
from ugv_acceptance.type_aliases import Json

WHAT = 'the alerts that the live monitor raised'
# A load is in force this long (ns) before it is seen among the parameters.
LATE = 3_000_000_000
# Differences that are named.
MOST = 4
MASS, COG = 'payload.mass_kg', 'payload.cog_m'


def told_parameters(
    recording: Recording, judgement: Judgement, result: Json, *, declared: bool
) -> Json:
    """Return the changes to a result if a live monitor is known to have judged by other numbers.

    `declared`: the load was entered for this evaluation, so whoever did that knows it.
    """
    told = parameters_in(recording)
    found = list(_differences(told, judgement.settings, recording.start_ns))
    load = _other_load(told, judgement.measurement.payloads, recording.start_ns)
    if load and not declared and result['verdict'] != FAIL:
        reason = f'{load}: give the load with --payload, or declare it to the robot as it records'
        changed = with_objection(result, Objection('payload', INCONCLUSIVE, reason))
    else:
        changed = {}
        found += [load] if load else []
    if found:
        more = f' and {len(found) - MOST} more' if len(found) > MOST else ''
        why = f'it judged by other parameters than this evaluation: {"; ".join(found[:MOST])}{more}'
        unchecked = not_checked_json(NotChecked(WHAT, why))
        changed['not_checked'] = [*result['not_checked'], unchecked]
    return changed


def _differences(told: Sequence[ToldParameters], settings: Settings, start: int) -> Iterator[str]:
    """Yield the parameters that were not those of `settings`, each once with when it began."""
    here = _judged_by(settings)
    seen, hashed = set[str](), ''
    for parameters in told:
        others = parameters.limits_hash not in ('', limits_hash(settings))
        hashed = hashed or (parameters.limits_hash if others else '')
        for name, value in here.items():
            there = parameters.values.get(name, value)
            if name not in seen and not _same(there, value):
                seen.add(name)
                yield f'{name} {_shown(there)}, here {_shown(value)}{_since(parameters, start)}'
    if hashed and not seen:
        yield f'limits_hash {hashed}, here {limits_hash(settings)}: another configuration'


def _judged_by(settings: Settings) -> dict[str, object]:
    """Return the parameters that a monitor of these settings has, but for the load."""
    found: dict[str, object] = {of.name: of.value(settings) for of in RANGES if of.live}
    for j, limit in enumerate(settings.limits.torque):
        found[torque_name(settings, j)] = limit if math.isfinite(limit) else 0.0
    found['imu.attitude'] = settings.imu.attitude
    found['imu.specific_force'] = settings.imu.specific_force
    # What is entered for times of a recording, a live monitor is told when it is so.
    if not settings.ground.windows:
        found['ground.kind'] = settings.ground.kind or ''
    if not settings.hand_may_touch:
        found['hand_may_touch'] = False
    return found


def _other_load(told: Sequence[ToldParameters], payloads: PayloadLog, start: int) -> str:
    """Return the first load that the monitor carried and that is not judged here; empty: none."""
    for parameters in told:
        mass, cog = parameters.values.get(MASS), parameters.values.get(COG)
        if not isinstance(mass, float | int) or not isinstance(cog, list):
            continue
        since = parameters.time_ns - LATE
        held = [p for t, p in zip(payloads.since, payloads.payloads, strict=True)
                if since <= t <= parameters.time_ns]  # fmt: skip
        judged = [payloads.at(since), *held]
        if not any(_same([mass, *cog], [p.mass, *p.cog]) for p in judged):
            words = _load_words(mass, cog, judged[-1])
            return f'{words}{_since(parameters, start)}'
    return ''


def _load_words(mass: float, cog: list[object], judged: Payload) -> str:
    if not _same(mass, judged.mass):
        return f'the monitor carried {mass:g} kg, {judged.mass:g} kg are judged here'
    return f'the monitor carried its load at {_shown(cog)} m, {_shown(list(judged.cog))} m here'


def _since(parameters: ToldParameters, start: int) -> str:
    seconds = (parameters.time_ns - start) / 1e9
    return f' (from {seconds:.1f} s on)' if seconds > LATE / 1e9 else ''


def _same(one: object, other: object) -> bool:
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, float | int) and isinstance(other, float | int):
        return math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-9)
    return one == other


def _shown(value: object) -> str:
    if isinstance(value, list | tuple):
        return f'[{", ".join(map(_shown, value))}]'
    if isinstance(value, bool):
        return str(value).lower()
    return f'{value:g}' if isinstance(value, float | int) else repr(value)
