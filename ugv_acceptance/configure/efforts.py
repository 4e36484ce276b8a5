"""What the efforts of a recording mean, joint by joint: torque, other sign, scaled, nothing.

Needs a whole configuration: static torques hang on the model and on gravity.
"""

from dataclasses import dataclass

from ugv_acceptance.bag.reader import choose_topics
from ugv_acceptance.bag.recording import Paths, Recording, open_recording
from ugv_acceptance.config import Config
from ugv_acceptance.configure.draft import CHECK, Derived
from ugv_acceptance.evaluation.effort.facts import SCALED, UNKNOWN, JointMeaning
from ugv_acceptance.evaluation.effort.model_check import ModelCheck
from ugv_acceptance.evaluation.recorded import RecordedEvaluator

# So much of a recording is read (ns).
FIRST = 300_000_000_000


@dataclass(frozen=True, slots=True)
class EffortRemark:
    """What a joint's effort means, as a sentence; the keys to set for it, None where none is."""

    joint: str
    sentence: str
    effort_sign: Derived[float] | None = None
    effort_scale: Derived[float] | None = None


def effort_remarks(config: Config, recording: Recording | Paths) -> tuple[EffortRemark, ...]:
    """Return what the efforts of a recording's first five minutes mean for a configured robot.

    Of joints of which that is not known nothing is said. Raises BadBag if nothing can be read.
    """
    opened = recording if isinstance(recording, Recording) else open_recording(recording)
    if not config.settings.hears_joints:
        return ()
    check, evaluator = ModelCheck(config.settings), RecordedEvaluator(config.settings)
    topics = choose_topics(opened.bag, *config.topics.names, imu_required=False)
    evaluator.start(opened.start_ns)
    for batch in opened.bag.batches(topics):
        rows = evaluator.batch(batch)
        check.add(rows)
        if len(rows.time) and int(rows.time[-1]) > opened.start_ns + FIRST:
            break
    source = f'by the efforts at rest in {opened.paths[0].name}'
    told = [joint for joint in check.understanding().joints if _tells(joint)]
    return tuple(_remark(joint, source) for joint in told)


def _tells(joint: JointMeaning) -> bool:
    return joint.meaning != UNKNOWN or joint.opposed


def _remark(joint: JointMeaning, source: str) -> EffortRemark:
    """Return the sentence about a joint, with the sign and the scale that make it a torque."""
    sign = Derived(-1.0, CHECK, source) if joint.opposed else None
    scale = None
    if joint.meaning == SCALED and joint.ratio is not None:
        if joint.ratio.value < 0.0:
            sign = Derived(-1.0, CHECK, source)
        scale = Derived(1.0 / abs(joint.ratio.value), CHECK, f'{source}: {joint.ratio.text}')
    return EffortRemark(joint.joint, joint.sentence, sign, scale)
