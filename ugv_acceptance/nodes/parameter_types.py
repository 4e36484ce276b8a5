"""Parameters in the type they are declared with, however a number was written.

rclpy ends a node that is given `10` for a double. Here an integer is a number like any other; what
is none is refused in one line with the parameter's name. The declared type stays as it is, so
ROS tools go on showing a double.
"""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ugv_acceptance import BadConfig
from ugv_acceptance.config.yaml_numbers import list_in

Kind = Parameter.Type
_EXPECTED = {
    Kind.BOOL: 'true or false',
    Kind.INTEGER: 'an integer',
    Kind.DOUBLE: 'a number',
    Kind.STRING: 'a text',
    Kind.DOUBLE_ARRAY: 'a list of numbers',
    Kind.STRING_ARRAY: 'a list of texts',
}
_GOT = {bool: 'true or false', int: 'an integer', float: 'a number', str: 'a text', bytes: 'a byte'}
# Letters of a refused value that are shown.
_SHOWN = 60


def declare(
    node: Node,
    name: str,
    default: Any,  # noqa: ANN401 - a value, or a Parameter.Type without one
    descriptor: ParameterDescriptor,
) -> None:
    """Declare a parameter; a value from the ROS arguments may be an integer for a double.

    Raises BadConfig naming the parameter where its value has another type or is out of range.
    """
    kind = default if isinstance(default, Kind) else Kind.from_parameter_value(default)
    given = node._parameter_overrides.get(name)  # noqa: SLF001 - rclpy has no public way
    value = default if given is None else fitted(name, given.value, kind)
    if value == []:
        if value is not default and default is not kind:
            raise BadConfig(f'parameter {name}: expected {_EXPECTED[kind]}, got an empty list')
        value = kind  # of an empty list rclpy cannot tell the type
    try:
        node.declare_parameter(name, value, descriptor, ignore_override=True)
    except InvalidParameterValueException:
        raise BadConfig(f'parameter {name}: expected {_range(descriptor)}, got {value}') from None


def _range(descriptor: ParameterDescriptor) -> str:
    (found,) = [*descriptor.floating_point_range, *descriptor.integer_range]
    return f'{found.from_value:g} to {found.to_value:g}'


def fitted(name: str, value: Any, kind: Kind) -> Any:  # noqa: ANN401 - a parameter's value
    """Return a parameter's value in its declared type, or raise BadConfig naming it.

    Integers become doubles, alone and in lists. An empty list has no type of its own: an empty list
    of any type, or none, stands for no numbers, and for `['']`, which means no texts.
    """
    try:
        return _FITS[kind](value) if kind in _FITS else value
    except TypeError:
        expected = f'parameter {name}: expected {_EXPECTED[kind]}'
        raise BadConfig(f'{expected}, got {_shown(value)}') from None


def _exactly(kind: type) -> Callable[[Any], Any]:

    def same(value: Any) -> Any:  # noqa: ANN401 - a parameter's value
        if type(value) is not kind:
            raise TypeError
        return value

    return same


def _number(value: Any) -> float:  # noqa: ANN401 - a parameter's value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    return float(value)


def _numbers(value: Any) -> list[float]:  # noqa: ANN401 - a parameter's value
    if isinstance(value, str):
        # So `ros2 param set` sends a list of integers and doubles.
        value = list_in(value)
        if value is None:
            raise TypeError
    return [_number(item) for item in _items(value)]


def _texts(value: Any) -> list[str]:  # noqa: ANN401 - a parameter's value
    if isinstance(value, str):
        raise TypeError
    return [_exactly(str)(item) for item in _items(value)] or ['']


def _items(value: Any) -> Iterable[Any]:  # noqa: ANN401 - a parameter's value
    return () if value is None else value


_FITS: dict[Kind, Callable[[Any], Any]] = {
    Kind.BOOL: _exactly(bool),
    Kind.INTEGER: _exactly(int),
    Kind.DOUBLE: _number,
    Kind.STRING: _exactly(str),
    Kind.DOUBLE_ARRAY: _numbers,
    Kind.STRING_ARRAY: _texts,
}


def _shown(value: Any) -> str:  # noqa: ANN401 - a parameter's value
    if value is None:
        return 'nothing'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str | int | float):
        return f'{_cut(repr(value))}, {_GOT[type(value)]}'
    kinds = sorted({_GOT[type(item)] for item in value})
    return f'{_cut(str(list(value)))}, a list of {" and ".join(kinds) or "nothing"}'


def _cut(text: str) -> str:
    return text if len(text) <= _SHOWN else f'{text[: _SHOWN - 4]} ...'


# To type checkers it is a node; before Node among the bases of a class it must not be one.
if TYPE_CHECKING:
    _Base = Node
else:
    _Base = object


class FittingParameters(_Base):
    """A node whose parameters can be set to integers where doubles are declared.

    To be named before Node among the bases of a class.
    """

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters all at once or none; a wrong type is refused with the name."""
        try:
            fitting = [_fitting(self, parameter) for parameter in parameter_list]
        except BadConfig as error:
            return SetParametersResult(successful=False, reason=str(error))
        return super().set_parameters_atomically(fitting)


def _fitting(node: Node, parameter: Parameter) -> Parameter:
    """Return a parameter in its declared type; one that is not declared as it is."""
    name = parameter.name
    if not node.has_parameter(name):
        return parameter
    kind = Kind(node.describe_parameter(name).type)
    return Parameter(name, kind, fitted(name, parameter.value, kind))
