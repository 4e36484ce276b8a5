"""A subscription that tells which publisher sent each message, which those of rclpy do not.

The middleware gives every message the DDS identity (GID) of its publisher; rclpy drops it. So the
messages are taken by rcl's own C function, as rclpy takes them. Where that library is not found
messages come without an identity; a wrong one could not be believed, because it counts only if ROS
lists a publisher that has it.
"""

import ctypes
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.type_support import check_is_valid_msg_type
from rclpy.waitable import NumberOfEntities, Waitable

# Called with a message and the GID of its publisher; None: it is not known.
Take = Callable[[Any, bytes | None], None]
# Where a rmw_message_info_t has the GID, and its length; room for one that has grown.
_GID, _ROOM = slice(40, 56), 512
_OK = 0
# The libraries of ROS that have the functions; both are loaded already.
RCL, UTILS = 'librcl.so', 'librcutils.so'


class _Allocator(ctypes.Structure):
    """rcutils_allocator_t: four functions and their state."""

    _fields_ = tuple((name, ctypes.c_void_p) for name in 'adrzs')


class _Bytes(ctypes.Structure):
    """rcutils_uint8_array_t: a serialised message."""

    _fields_ = (
        ('buffer', ctypes.c_void_p),
        ('length', ctypes.c_size_t),
        ('capacity', ctypes.c_size_t),
        ('allocator', _Allocator),
    )


class _Rcl:
    """The C functions that take a message. Raises OSError or AttributeError without them."""

    def __init__(self) -> None:
        utils = ctypes.CDLL(UTILS)
        utils.rcutils_get_default_allocator.restype = _Allocator
        self._free = utils.rcutils_uint8_array_fini
        self._take = ctypes.CDLL(RCL).rcl_take_serialized_message
        self._take.argtypes = [ctypes.c_void_p] * 4
        self._data = _Bytes(None, 0, 0, utils.rcutils_get_default_allocator())
        self._info = (ctypes.c_uint8 * _ROOM)()

    def take(self, pointer: int) -> tuple[bytes, bytes] | None:
        """Return the next message of an rcl_subscription_t and its publisher's GID, if any."""
        data = ctypes.byref(self._data)
        if self._take(pointer, data, ctypes.byref(self._info), None) != _OK:
            return None
        content = ctypes.string_at(self._data.buffer, self._data.length)
        return content, bytes(self._info[_GID])

    def close(self) -> None:
        """Free the memory of the last message."""
        self._free(ctypes.byref(self._data))


class SenderSubscription(Waitable):
    """Subscribes to `topic` of a node, and calls `take` with every message and its publisher."""

    def __init__(self, node: Node, kind: Any, topic: str, qos: QoSProfile, take: Take) -> None:  # noqa: ANN401 - a message's class
        super().__init__(node.default_callback_group)
        self._node, self._kind, self._call = node, kind, take
        self._rcl: _Rcl | None = None
        with suppress(OSError, AttributeError):
            self._rcl = _Rcl()
        check_is_valid_msg_type(kind)  # loads what rcl needs of it
        with node.handle:
            self._handle = rclpy_implementation.Subscription(
                node.handle, kind, topic, qos.get_c_qos_profile()
            )
        self._index = -1
        self.topic_name: str = self._handle.get_topic_name()
        node.add_waitable(self)

    def __enter__(self) -> None:
        """Keep the subscription while an executor waits for it."""
        self._handle.__enter__()

    def __exit__(self, *error: object) -> None:
        """Let go of it."""
        self._handle.__exit__(*error)

    def add_to_wait_set(self, wait_set: Any) -> None:  # noqa: ANN401 - rclpy's
        """Have an executor wait for messages."""
        self._index = wait_set.add_subscription(self._handle)

    def is_ready(self, wait_set: Any) -> bool:  # noqa: ANN401 - rclpy's
        """Return whether a message is there."""
        return bool(wait_set.is_ready('subscription', self._index))

    def get_num_entities(self) -> NumberOfEntities:
        """Return that it is one subscription."""
        return NumberOfEntities(num_subs=1)

    def take_data(self) -> list[tuple[Any, bytes | None]]:
        """Take all messages that are there."""
        found = []
        with self._handle:
            while (one := self._next()) is not None:
                found.append(one)
        return found

    async def execute(self, taken_data: list[tuple[Any, bytes | None]]) -> None:
        """Hand the messages on."""
        for message, gid in taken_data:
            self._call(message, gid)

    def _next(self) -> tuple[Any, bytes | None] | None:
        if self._rcl is None:
            taken = self._handle.take_message(self._kind, False)  # not raw
            return None if taken is None else (taken[0], None)
        found = self._rcl.take(self._handle.pointer)
        return None if found is None else (deserialize_message(found[0], self._kind), found[1])

    def destroy(self) -> None:
        """Unsubscribe."""
        self._node.remove_waitable(self)
        self._handle.destroy_when_not_in_use()
        if self._rcl is not None:
            self._rcl.close()
        self._rcl = None
