"""Reads /tf_static of a recording, where the mounting of the IMU may have to be found by it."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from ugv_acceptance import BadBag, BadSample
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.transforms import TYPE, TransformSample, transforms_of
from ugv_acceptance.evaluation.settings import AUTO, Settings


def with_transforms(settings: Settings, bag: Bag) -> Settings:
    """Return settings that know the static transforms of a recording, if they can use them.

    A transform holds for the whole recording, whenever it was told.
    """
    if settings.imu.placed != AUTO or not settings.hears_imu:
        return settings
    told = tuple(dict.fromkeys(_transforms(bag)))
    return replace(settings, imu=replace(settings.imu, transforms=told))


def _transforms(bag: Bag) -> Iterator[TransformSample]:
    wanted = {
        name
        for name, topic in bag.topics.items()
        if topic.type == TYPE and topic.count and name.rpartition('/')[2] == 'tf_static'
    }
    if not wanted:
        return
    with suppress(BadBag):  # a file that breaks off: told where the inputs are read
        for message in messages(bag, wanted):
            with suppress(BadSample):  # one that cannot be read tells nothing
                yield from transforms_of(message.data)
