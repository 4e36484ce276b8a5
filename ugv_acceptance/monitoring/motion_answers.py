"""Answers about planned motions as statuses: result, what they rest on, how long they hold.

A result is PERMITTED, REFUSED or NOT_KNOWN; a permission is taken back by WITHDRAWN or EXPIRED.
Their levels are OK (WARN with a caution), ERROR and, where nothing is known or any more, STALE.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ugv_acceptance.evaluation import planned_motion as motion
from ugv_acceptance.evaluation.alerts.level_words import level_words
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE, WARN
from ugv_acceptance.evaluation.ground import ground_words
from ugv_acceptance.evaluation.inputs.joint_words import held_words
from ugv_acceptance.evaluation.margin_words import share_words, tipping_words
from ugv_acceptance.evaluation.permitted_limits import relaxed_words
from ugv_acceptance.evaluation.planned_motion import CheckedMotion
from ugv_acceptance.model.attitude import roll_pitch
from ugv_acceptance.monitoring.diagnostics import Status
from ugv_acceptance.monitoring.motion_situation import Situation

PERMITTED, REFUSED, NOT_KNOWN = 'permitted', 'refused', 'not_known'
WITHDRAWN, EXPIRED = 'withdrawn', 'expired'
RESULTS = {
    motion.PERMITTED: PERMITTED,
    motion.REFUSED: REFUSED,
    motion.NOT_KNOWN: NOT_KNOWN,
}
LEVELS = {PERMITTED: OK, REFUSED: ERROR, NOT_KNOWN: STALE, WITHDRAWN: STALE, EXPIRED: STALE}
# Name of the statuses; seconds within which a permitted motion has to begin.
NAME, VALID = 'Planned motion', 2.0
VALID_NS = int(VALID * 1e9)
# Letters of a sentence in an answer.
LONGEST = 300
# What no input of the monitor tells.
STANDS = 'that the robot stands still is seen by its IMU and its joints alone'


@dataclass(frozen=True, slots=True)
class Asked:
    """What names a question in its answers: the trajectory's hash, and its header stamp (ns).

    `sha256` is '' where the message was not read.
    """

    sha256: str
    stamp: int

    def status(
        self, result: str, reasons: Sequence[str], values: dict[str, object] | None = None
    ) -> Status:
        """Return an answer; its message is the first of the reasons."""
        more = f' (and {len(reasons) - 1} more)' if len(reasons) > 1 else ''
        text = f'{result.replace("_", " ")}: {_cut(reasons[0], LONGEST)}{more}'
        own: dict[str, object] = {
            'result': result,
            'trajectory_sha256': self.sha256,
            'stamp_ns': self.stamp,
            'valid_until_ns': 0,
            'valid_s': 0.0,
            'reasons': _cut(_joined(reasons), 10 * LONGEST),
        }
        return Status(LEVELS[result], NAME, text, own | (values or {}))


def answer(asked: Asked, checked: CheckedMotion, then: Situation, until: int) -> Status:
    """Return what was found about a motion; a permission holds `until` (ns, ROS time)."""
    result = RESULTS[checked.verdict]
    cautions = [*checked.cautions, *_cautions(then)] if result == PERMITTED else []
    least = _least_words(checked)
    reasons = [least] if result == PERMITTED else list(checked.reasons) or [least]
    values = situation_values(then) | _margins(checked)
    values |= {
        'cautions': _joined(cautions),
        'not_checked': _joined([*checked.not_checked, STANDS]),
        'duration_s': checked.duration,
    }
    if result == PERMITTED:
        values |= {'valid_until_ns': until, 'valid_s': VALID, 'reasons': ''}
    found = asked.status(result, reasons, values)
    if not cautions:
        return found
    return Status(WARN, NAME, f'{found.message}; {cautions[0]}', found.values)


def situation_values(then: Situation) -> dict[str, object]:
    """Return what an answer rests on, as values: load, attitude, ground, limits, posture."""
    x, y, z = then.gravity
    roll, pitch = roll_pitch((-x, -y, -z))
    settings, load = then.settings, then.payload
    joints = zip(settings.joints, then.q, strict=True)
    return {
        'payload_kg': load.mass,
        'payload_cog_m': ','.join(f'{c:.6g}' for c in load.cog),
        'payload_by': then.load_by,
        'roll_deg': math.degrees(roll) + 0.0,  # never -0
        'pitch_deg': math.degrees(pitch) + 0.0,
        'ground': ground_words(settings.ground.kind),
        'limits_hash': then.limits_hash,
        'limits_relaxed': relaxed_words(settings),
        'posture': ','.join(f'{j.topic_name}={(q - j.offset) / j.sign:.4f}' for j, q in joints),
    }


def _cautions(then: Situation) -> list[str]:
    """Return what to say beside a permission: CAUTION now, joints that nobody told."""
    found = [f'the monitor shows {level_words(WARN)} now'] if then.level == WARN else []
    if then.held:
        found.append(f'never told, taken as held: {held_words(then.settings, sorted(then.held))}')
    return found


def _margins(checked: CheckedMotion) -> dict[str, object]:
    """Return the least margins of a motion and where they are."""
    values: dict[str, object] = {}
    for name, tilt in (('tilt', checked.tilt), ('cautious', checked.cautious)):
        if tilt is not None:
            values |= {
                f'{name}_left_deg': math.degrees(tilt.angle),
                f'{name}_side': tilt.side,
                f'{name}_time_s': tilt.time,
                f'{name}_point': tilt.point,
            }
    if (joint := checked.joint) is not None:
        values |= {
            'torque_share': joint.share,
            'torque_joint': joint.joint,
            'torque': joint.torque,
            'torque_limit': joint.limit,
            'torque_time_s': joint.time,
            'torque_point': joint.point,
        }
    return values


def _least_words(checked: CheckedMotion) -> str:
    """Return the least margins of a motion in words."""
    words = []
    if (tilt := checked.cautious or checked.tilt) is not None:
        cautious = ', taken cautiously' if checked.cautious else ''
        left = tipping_words(tilt.side, tilt.angle)
        words.append(f'at least {left}{cautious}, at {tilt.time:.2f} s')
    if (joint := checked.joint) is not None:
        words.append(f'{joint.joint} at most {share_words(joint.share)} of its limit')
    return '; '.join(words) or 'no margin is known'


def _joined(sentences: Iterable[str]) -> str:
    return ' | '.join(sentences)


def _cut(text: str, most: int) -> str:
    """Return a text in one line, at most so long: a number in a message may have 300 digits."""
    line = ' '.join(text.split())
    return line if len(line) <= most else f'{line[: most - 3]}...'
