"""What a drill's robot shows: the snapshot that page and terminal draw, as of a live robot."""

import math
from dataclasses import replace
from typing import Any

from ugv_acceptance.console.latest_messages import hints_of
from ugv_acceptance.console.monitor_values import countdown_of, number_of
from ugv_acceptance.console.snapshot import NO_PAYLOAD, AlertRow, InputRow, Snapshot
from ugv_acceptance.drill.robot import DrillRobot
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, OK, STALE, Alert
from ugv_acceptance.run.messages import topics_of

# Who publishes the inputs of a drill.
PUBLISHER = 'the simulated robot'


def snapshot_of(robot: DrillRobot) -> Snapshot:
    """Return what the monitor of a drill's robot knows and says now."""
    session, verdict = robot.session, robot.verdict
    evaluator = session.evaluator
    margins, said = evaluator.margins, {k: str(v) for k, v in verdict.values.items()}
    alerts = _alerts(robot, said)
    told = any(row.level == STALE and row.end is None for row in alerts)
    common: dict[str, Any] = {
        'payload': evaluator.payload,
        'alerts': alerts,
        'inputs': tuple(_input(robot, name) for name in session.counts),
        'ground': said.get('ground', ''),
        'running': robot.time,
        'source': 'drill',
    }
    now = session.clock.now()
    if margins is None:
        problem = '' if told else verdict.message
        return Snapshot(now, STALE, problem, q=tuple(evaluator.joints.q), **common)
    return Snapshot(
        now,
        verdict.level,
        known=True,
        q=margins.q,
        effort=tuple(evaluator.joints.effort),
        gravity=margins.gravity,
        torque=margins.torque,
        angle=tuple(float(a) for a in margins.angle),
        state=int(margins.state),
        hints=hints_of(said),
        stamp=margins.stamp,
        rough='trend' in said,
        cautious=math.radians(number_of(said, 'cautious_deg')),
        carried='trend' not in said and evaluator.carried,
        countdown=countdown_of(said),
        **common,
    )


def _alerts(robot: DrillRobot, said: dict[str, str]) -> tuple[AlertRow, ...]:
    """Return the alerts, active ones with their worst value until now and the newest advice."""
    session = robot.session
    active = {f'{a.rule.code}-{a.rule.subject}-{LEVELS[a.rule.level]}': a for a in session.active}
    rows = []
    for row in robot.alerts.rows.values():
        alert = active.get(row.key)
        rows.append(row if alert is None or row.end else _newest(robot, row, alert, said))
    return tuple(rows)


def _newest(robot: DrillRobot, row: AlertRow, alert: Alert, said: dict[str, str]) -> AlertRow:
    session = robot.session
    about = (said.get('code'), said.get('subject')) == (row.code, row.subject)
    advice = said.get('do', row.advice) if about else row.advice
    return replace(
        row,
        text=session.faults.sentence(alert, session.settings),
        advice=STAND_CLEAR if session.advisory.tipped else advice,
        worst=alert.worst_at,
        peak=float(alert.peak),
    )


def _input(robot: DrillRobot, name: str) -> InputRow:
    session = robot.session
    count, now = session.counts[name], session.clock.now()
    mine = [alert for alert in session.active if alert.rule.subject == name]
    silent = STALE if not count.taken and name != 'payload' else OK
    sentences = [session.faults.sentence(alert, session.settings) for alert in mine]
    return InputRow(
        name,
        topics_of(robot.config).get(name, ''),
        max([alert.rule.level for alert in mine], default=silent),
        session.rates.get(name, math.nan if count.taken else 0.0),
        (now - count.last) / 1e9 if count.taken else math.nan,
        (PUBLISHER,),
        '; '.join(sentences) or (NO_PAYLOAD if name == 'payload' and not count.taken else ''),
    )
