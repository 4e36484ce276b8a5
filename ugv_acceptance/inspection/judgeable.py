"""What an evaluation of a recording could judge, and what it could not, with the reason."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ugv_acceptance.evaluation.criteria.criteria import FAIL, INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.messages import no_value_once
from ugv_acceptance.evaluation.ground import ground_words
from ugv_acceptance.type_aliases import Json

# From this share of the time on a margin counts as known all the time.
ALL = 0.995


@dataclass(frozen=True, slots=True)
class Could:
    """Something that could be judged, in which share (0 to 1) of the time; None: not of a time."""

    what: str
    share: float | None = None


@dataclass(frozen=True, slots=True)
class CouldNot:
    """Something that could not be judged, and why. `decides`: nothing passes without it."""

    what: str
    why: str
    decides: bool = False


def could_be_judged(result: Json) -> Iterator[Could]:
    """Yield what a result of `evaluate` rests on."""
    shares: dict[float, list[str]] = {}
    for joint, share in _judged(result, 'torque_utilisation'):
        if share > 0.0:
            shares.setdefault(round(share, 3), []).append(joint)
    for share, joints in shares.items():
        yield Could(f'torque of {", ".join(joints)}', share)
    for _, share in _judged(result, 'tip_angle'):
        if share > 0.0:
            kind = ground_words(result['ground']['kind'])
            yield Could(f'tip-over, the ground taken as {kind}', share)
    efforts = [name for name, one in _efforts(result) if one['meaning'] == 'torque']
    if efforts:
        yield Could(f'measured effort of {", ".join(efforts)}, and by it the model and the load')
    if fast := (result.get('dynamic_torque') or {}).get('joints'):
        yield Could(f'torque in fast motion of {", ".join(fast)}')
    chassis = result.get('chassis_acceleration') or {}
    if chassis.get('judged_share'):
        yield Could('accelerations of the chassis', float(chassis['judged_share']))
    if result['clearance']['min_m'] is not None:
        yield Could('whether the arm touches the ground')


def _judged(result: Json, signal: str) -> Iterator[tuple[str, float]]:
    """Yield what a signal is of, and in which share of the time it was known."""
    for one in result['criteria']['results']:
        measured = one['measured']
        if one['kind'] == 'value' and measured.get('signal') == signal:
            yield str(measured['of']), float(measured['evaluated_share'] or 0.0)


def _efforts(result: Json) -> Iterator[tuple[str, Any]]:
    yield from ((result.get('model_check') or {}).get('joints') or {}).items()


def could_not_be_judged(result: Json) -> Iterator[CouldNot]:
    """Yield what stands in the way of a verdict, then what `evaluate` lists as not checked."""
    for reason in in_the_way(result):
        yield CouldNot('', reason, decides=True)
    for one in result['not_checked']:
        seconds = '' if one['seconds'] is None else f' ({one["seconds"]:.1f} s)'
        yield CouldNot(f'{one["what"]}{seconds}', one['why'])


def in_the_way(result: Json) -> list[str]:
    """Return why there could be no PASS, whatever the margins are: the causes first."""
    if result['verdict'] == INCONCLUSIVE:
        return [str(reason) for reason in result['reasons']]
    if result['verdict'] != FAIL:
        return []
    found = [
        str(reason)
        for one in result['safeguards']
        if one['verdict'] == INCONCLUSIVE and one['waived'] is None
        for reason in one['reasons']
    ]
    found += [o['reason'] for o in result['criteria']['results'] if o['verdict'] == INCONCLUSIVE]
    return no_value_once(list(dict.fromkeys(found)))
