"""All that the front door offers, used once: mypy finds no Any in it (pyproject.toml asks so)."""

import ugv_acceptance as ugv


def names_of(result: ugv.Evaluation) -> list[str]:
    """Use every part of an evaluation."""
    margins: ugv.MarginColumns = result.margins
    shape: tuple[int, int] = result.table('arrow').shape
    told = [f'{a.level} {a.code} {a.subject} {a.start_s} {a.end_s} {a.peak}' for a in result.alerts]
    told += [f'{c.name} {c.demand} {c.verdict} {c.reason} {c.evidence}' for c in result.criteria]
    told += [result.verdict, *result.reasons, f'{result.coverage} {shape}', result.to_json()]
    told += [*margins.joints, *margins.sides, f'{len(margins)}', *result.to_dict()]
    return told


def fed(path: str) -> dict[str, float]:
    """Feed a recording, then a posture, to live evaluators; return the margins of the posture."""
    config: ugv.Config = ugv.load_config('packbot')
    recording: ugv.Recording = ugv.open_recording(path)
    played = ugv.LiveEvaluator(config)
    for sample in recording:
        played.take(sample)
    live = ugv.LiveEvaluator(played.config)
    live.payload(1.0, (0.0, 0.0, 0.1))
    live.joint_state(live.joint_names, [0.0] * len(live.joint_names))
    margins: ugv.LiveMargins | None = live.imu((0.0, 0.0, 9.81))
    live.tick()
    if margins is None or live.level == 'STALE':
        return {}
    return {**margins.tip_angle, **margins.static_torque, **margins.torque_margin}


def both(path: str) -> tuple[list[str], dict[str, float]]:
    """Evaluate a recording and feed it to the live evaluator."""
    load = ugv.Payload(2.0)
    return names_of(ugv.evaluate(path, config='packbot', payload=load)), fed(path)
