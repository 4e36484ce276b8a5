"""What a monitor says of the ground, and of the tilt left on it: words and values."""

import math

from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, STALE
from ugv_acceptance.evaluation.alerts.tipping_watch import NOT_KNOWN
from ugv_acceptance.evaluation.ground import CARRIED, bound_words, ground_words
from ugv_acceptance.evaluation.least_margins import least_tilt
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.margin_words import tipping_words
from ugv_acceptance.evaluation.sample_margins import Margins

# What the newest trend says where the ground is not flat.
TRENDS = {NOT_KNOWN: 'not known yet', **dict(enumerate(LEVELS[:STALE]))}


def tilt_words(margins: Margins, evaluator: LiveEvaluator) -> str:
    """Return the tilt left in words; an upper bound where the ground is not flat."""
    side, angle = least_tilt(margins.angle)
    if not side:
        return 'no tilt margin'
    if evaluator.settings.ground.rough:
        return bound_words(side, angle, evaluator.watch.trend.cautious)
    words = tipping_words(side, angle)
    return f'{words}; {CARRIED}' if evaluator.carried else words


def ground_values(evaluator: LiveEvaluator) -> dict[str, object]:
    """Return what the ground is taken for; where it is not flat the cautious margin and trend.

    Empty for a robot whose tip-over is not judged.
    """
    ground, trend = evaluator.settings.ground, evaluator.watch.trend
    if not evaluator.settings.judges_tilt:
        return {}
    found: dict[str, object] = {'ground': ground_words(ground.kind)}
    if ground.rough:
        found |= {'cautious_deg': math.degrees(trend.cautious), 'trend': TRENDS[trend.level]}
    return found
