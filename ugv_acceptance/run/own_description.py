"""Writes into a recording what robot it is of: its URDF on /robot_description, as a robot does."""

from collections.abc import Iterable

from ugv_acceptance.bag.description import TYPE
from ugv_acceptance.bag.told_robot import description_message
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import Config

QOS = Qos(durability='transient_local')


def tell_robot(
    bag: BagWriter, config: Config, now: int, topic: str = '', heard: Iterable[bytes] = ()
) -> None:
    """Write the URDF in force at `now` (ns), and the other descriptions that were `heard`.

    `topic` is by default that of the configuration.
    """
    own = topic or f'/{config.topics.robot_description.lstrip("/~")}'
    bag.add_topic(own, TYPE, QOS)
    for message in dict.fromkeys([description_message(config.urdf_text), *heard]):
        bag.write(own, now, message)
