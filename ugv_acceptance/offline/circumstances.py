"""Where a recording comes from and what load it tells of, as far as it says so itself."""

from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.inputs.payload import PayloadLog
from ugv_acceptance.type_aliases import Json

CLOCK = 'rosgraph_msgs/msg/Clock'
# Changes of the load that are listed.
MOST_TOLD = 20


def origin_of(bag: Bag) -> Json:
    """Return whether a recording says that it was simulated: `simulated` is None if it does not.

    `clock` is the topic of a ROS clock, as simulators and replays have.
    """
    clocks = [name for name, topic in bag.topics.items() if topic.type == CLOCK and topic.count]
    return {'simulated': True if bag.simulated else None, 'clock': clocks[0] if clocks else None}


def load_of(told: PayloadLog, start: int) -> Json:
    """Return the load carried: that of the configuration, and each told since `start` (ns)."""
    carried = told.settings.robot.payload
    changes = zip(told.since, told.payloads, strict=True)
    listed = [{'at_s': (at - start) / 1e9, 'mass_kg': load.mass} for at, load in changes]
    return {
        'link': told.settings.robot.payload_link,
        'configured_kg': carried.mass,
        'known': told.settings.payload_known,
        'told': listed[:MOST_TOLD],
        'changes': len(listed),
    }


def assumed_of(config: Config) -> dict[str, str] | None:
    """Return the numbers of a robot that are only assumed, with why; None if that is not said."""
    return None if config.assumed is None else dict(config.assumed)
