"""Lists of numbers in YAML as ROS parameters have them: integers and doubles are both numbers."""

import re
from collections.abc import Iterator

import yaml

_INTEGER = re.compile(r'[-+]?[0-9]+')
_PARSE_ERRORS = (yaml.YAMLError, LookupError, RecursionError, ValueError)


def list_in(text: str) -> list[object] | None:
    """Return the list that a YAML text is; None: it is something else."""
    try:
        found = yaml.safe_load(text)
    except _PARSE_ERRORS:
        return None
    return found if isinstance(found, list) else None


def with_doubles(text: str) -> str:
    """Return YAML text in which the integers of a list that has doubles too are doubles."""
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except _PARSE_ERRORS:
        return text  # who reads it says what is wrong with it
    places = [] if root is None else sorted(set(_integers(root)), reverse=True)
    for place in places:
        text = f'{text[:place]}.0{text[place:]}'
    return text


def _integers(node: yaml.Node) -> Iterator[int]:
    """Yield where the integers end in lists below a node that have integers and doubles."""
    if isinstance(node, yaml.SequenceNode):
        whole = [item for item in node.value if _is_integer(item)]
        if len(whole) < len(node.value) and all(map(_is_number, node.value)):
            yield from (item.end_mark.index for item in whole)
    elif isinstance(node, yaml.MappingNode):
        for _, value in node.value:
            yield from _integers(value)


def _is_integer(node: yaml.Node) -> bool:
    return _is_number(node) and _INTEGER.fullmatch(node.value) is not None


def _is_number(node: yaml.Node) -> bool:
    if not isinstance(node, yaml.ScalarNode) or node.style is not None:
        return False
    try:
        float(node.value)
    except ValueError:
        return False
    return True
