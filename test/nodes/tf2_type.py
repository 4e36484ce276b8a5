"""tf2_msgs/TFMessage for rclpy where ROS's package is not installed, as raw messages only.

The wheels of ROS for a virtual environment lack tf2_msgs, which every robot has. DDS needs only a
type's name; messages that are published and taken as bytes are not looked into. So the type support
of another message is copied under the name of this one.
"""

import ctypes
import sys
import types
from importlib.util import find_spec

import nav_msgs.msg

# The library and the function that give a message's type support of each kind.
_LIBRARY = 'libnav_msgs__{kind}.so'
_HANDLE = '{kind}__get_message_type_support_handle__nav_msgs__msg__Path'
_KINDS = ('rosidl_typesupport_fastrtps_c', 'rosidl_typesupport_introspection_c')
# Pointers in message_type_support_callbacks_t and in rosidl_message_type_support_t.
_CALLBACKS, _SUPPORT = 7, 6
_Support = ctypes.c_void_p * _SUPPORT
_Find = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)
# What C points at must live as long as the process.
_kept: list[object] = []


def provide_tf2_msgs() -> None:
    """Make `from tf2_msgs.msg import TFMessage` work, by the real package if there is one."""
    if 'tf2_msgs' in sys.modules or find_spec('tf2_msgs'):
        return
    package, messages = types.ModuleType('tf2_msgs'), types.ModuleType('tf2_msgs.msg')
    path = nav_msgs.msg.Path.__class__
    kind = type('Metaclass_TFMessage', (path,), {'_TYPE_SUPPORT': _type_support()})
    messages.TFMessage = kind('TFMessage', (), {})  # type: ignore[attr-defined]
    package.msg = messages  # type: ignore[attr-defined]
    sys.modules |= {'tf2_msgs': package, 'tf2_msgs.msg': messages}


def _type_support() -> object:
    """Return a capsule with the type support of a message under the name of TFMessage."""
    nav_msgs.msg.Path.__class__.__import_type_support__()  # loads the libraries
    found = {kind.encode(): _of_path(kind) for kind in _KINDS}
    fast = found[_KINDS[0].encode()] = _Support(*found[_KINDS[0].encode()])
    callbacks = (ctypes.c_void_p * _CALLBACKS)(
        *(ctypes.c_void_p * _CALLBACKS).from_address(fast[1] or 0)
    )
    names = [ctypes.create_string_buffer(text) for text in (b'tf2_msgs::msg', b'TFMessage')]
    callbacks[0], callbacks[1] = map(ctypes.addressof, names)
    fast[1] = ctypes.addressof(callbacks)
    # rmw asks for the kind that it needs.
    find = _Find(lambda _, kind: ctypes.addressof(found[kind]) if kind in found else None)
    top = _Support(*fast)
    top[2] = ctypes.cast(find, ctypes.c_void_p).value
    _kept.extend((*found.values(), callbacks, *names, find, top))
    make = ctypes.pythonapi.PyCapsule_New
    make.restype = ctypes.py_object
    make.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
    capsule: object = make(ctypes.addressof(top), None, None)
    return capsule


def _of_path(kind: str) -> 'ctypes.Array[ctypes.c_void_p]':
    get = getattr(ctypes.CDLL(_LIBRARY.format(kind=kind)), _HANDLE.format(kind=kind))
    get.restype = ctypes.POINTER(_Support)
    support: ctypes.Array[ctypes.c_void_p] = get().contents
    return support
