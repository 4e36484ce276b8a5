"""Advice for each alert of a recording, for the moment it was raised.

Posture and gravity are kept for each alert while the recording is read; the search itself, which
takes milliseconds, runs at the end for at most MOST alerts. An alert raised before a fall keeps the
advice of its moment; one raised after it, of whatever kind, only says to stand clear.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from ugv_acceptance.evaluation.advice.search import COMPUTED, advise_each
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR, has_tipped
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.type_aliases import Floats

# Advice is computed for at most this many alerts of a run, the most severe first.
MOST = 50


@dataclass(frozen=True, slots=True, eq=False)
class _Moment:
    """Joint positions (j,), gravity (3,) m/s2 in `base_link`, receipt time of the joints (ns).

    `tipped` says whether the robot had tipped over by then.
    """

    q: Floats
    gravity: Floats
    heard: int
    tipped: bool


@dataclass(slots=True)
class AlertAdvice:
    """Collects posture and gravity of each alert while a recording is read, and then its advice.

    `log` is the evaluator's growing list of alerts; `payload_at` gives the payload at a time (ns).
    """

    settings: Settings
    log: list[Alert]
    payload_at: Callable[[int], Payload]
    _cases: list[tuple[Alert, _Moment]] = field(default_factory=list)
    _fallen: list[Alert] = field(default_factory=list)
    _seen: int = 0
    _last: _Moment | None = None

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording; its alerts must be in `log`."""
        for alert in self._fresh():
            k = int(rows.time.searchsorted(alert.start, side='right')) - 1
            self._take(alert, _moment(rows, k) if k >= 0 else self._last)
        if len(rows.time):
            self._last = _moment(rows, len(rows.time) - 1)

    def _take(self, alert: Alert, moment: _Moment | None) -> None:
        """Keep an alert with the moment it was raised, if its advice depends on that."""
        if moment is not None and moment.tipped:
            self._fallen.append(alert)
        elif moment is not None and alert.rule.code in COMPUTED:
            self._cases.append((alert, moment))

    def _fresh(self) -> list[Alert]:
        fresh = self.log[self._seen :]
        self._seen = len(self.log)
        return fresh

    def sentences(self) -> dict[int, str]:
        """Return the advice by the alert's `id`; alerts for which the model finds none are missing.

        For an alert raised after the last message the posture of that message is used.
        """
        for alert in self._fresh():
            self._take(alert, self._last)
        order = sorted(self._cases, key=lambda case: (-case[0].rule.level, case[0].start))
        alike: dict[Payload, list[tuple[Alert, _Moment]]] = {}
        for alert, moment in order[:MOST]:
            alike.setdefault(self.payload_at(moment.heard), []).append((alert, moment))
        found = {id(alert): STAND_CLEAR for alert in self._fallen}
        for payload, cases in alike.items():
            q, gravity = ([getattr(m, name) for _, m in cases] for name in ('q', 'gravity'))
            of = [alert.rule.subject for alert, _ in cases]
            told = advise_each(self.settings, q, gravity, payload, of)
            found |= {
                id(alert): best[0].sentence
                for (alert, _), best in zip(cases, told, strict=True)
                if best
            }
        return found


def _moment(rows: MarginRows, k: int) -> _Moment:
    j, i = int(rows.pairs.of_joints[k]), int(rows.pairs.of_imu[k])
    joints = rows.pairs.joints
    q, gravity = joints.q[j].copy(), rows.pairs.imu.gravity[i].copy()
    return _Moment(q, gravity, int(joints.time[j]), has_tipped(rows.angle[k]))
