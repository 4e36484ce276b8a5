"""Feeds the rules on margins with the margins of a part of a recording."""

import numpy as np

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import feed
from ugv_acceptance.evaluation.lost_margins import Lost, with_lost
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.sliding import slides_first
from ugv_acceptance.model.stability import NO_CONTACT
from ugv_acceptance.type_aliases import Floats, Times


def watch_margins(settings: Settings, watch: RuleSet, rows: MarginRows, lost: Lost) -> None:
    """Judge torques, tilt left and how the robot stands; `lost` is when they became unknown."""
    all_known = rows.known.all()
    time = rows.time if all_known else rows.time[rows.known]
    time = with_lost(time, lost, lost.time)
    values_of = (*rows.torque.T, *rows.angle.T)
    for k, (values, (warn, error)) in enumerate(
        zip(values_of, (*watch.torque, *watch.tip), strict=True)
    ):
        loaded = k < len(watch.torque)
        least = min(warn.on, error.on)
        # What is below both limits cannot change quiet signals.
        if warn.on == np.inf or (warn.quiet and error.quiet and _largest(values, loaded) < least):
            continue
        some = values if all_known else values[rows.known]
        worse = np.abs(some) if loaded else -some
        if rows.touches.any():
            worse = np.where(np.isnan(worse), -np.inf, worse)
        worse = with_lost(worse, lost)
        feed(warn, time, worse)
        feed(error, time, worse)
    if settings.judges_tilt:
        _watch_stand(settings, watch, rows, (time, lost))
    watch.predict_rows(rows)


def _watch_stand(
    settings: Settings, watch: RuleSet, rows: MarginRows, when: tuple[Times, Lost]
) -> None:
    """Judge how the robot stands in the rows with margins, `when` with those lost among them."""
    time, lost = when
    state = rows.state[rows.known]
    feed(watch.support, time, with_lost(np.where(state >= NO_CONTACT, 1.0, 0.0), lost))
    if watch.slide.on < np.inf:
        gravity, least = rows.gravity[rows.known], rows.angle[rows.known].min(axis=1)
        slope = slides_first(tuple(gravity.T), least, settings.limits.friction)
        feed(watch.slide, time, with_lost(slope, lost))


def _largest(values: Floats, loaded: bool) -> float:  # noqa: FBT001 - a kind of value
    """Return the largest size of torques (`loaded`), or of minus the tilt left, where known.

    Minus infinity if none is.
    """
    low = -float(np.fmin.reduce(values, initial=np.inf))
    return max(low, float(np.fmax.reduce(values, initial=-np.inf))) if loaded else low
