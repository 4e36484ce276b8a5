"""Parses the XML of a URDF, and says what is xacro that nobody expanded.

Parsed by defusedxml, which refuses entities and external files.
"""

import re
from collections.abc import Iterable, Iterator
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from ugv_acceptance import BadConfig
from ugv_acceptance.config.units import cut, shown

XACRO = 'http://www.ros.org/wiki/xacro'
# What only defines something is harmless: where it is used, an expression or a call is left too.
_DEFINITIONS = ('property', 'arg', 'macro')
# The same and other words of old xacro files, which had no prefix.
_UNPREFIXED = (*_DEFINITIONS, 'include', 'insert_block')
_PREFIX = re.compile(rb'[<\s/]([A-Za-z_][A-Za-z0-9_.-]*):[A-Za-z_]')
_RUN = 'run xacro on it first, or `ugv-acceptance init FILE.xacro`'


def parse(text: bytes, source: str) -> Element:
    """Return the <robot> of a URDF, its tags without the namespace that it may have.

    Raises BadConfig if it is no XML, no URDF, or xacro that has to be expanded; definitions of
    xacro and prefixes that nobody declared are ignored.
    """
    try:
        root = _parsed(text)
    except DefusedXmlException:
        raise BadConfig(
            f'{source}: expected a URDF, got XML with a DTD or entities, which are refused'
        ) from None
    except (ParseError, ValueError, LookupError) as error:
        raise BadConfig(f'{source}: expected a URDF (XML), got {shown(str(error))}') from None
    space, name = _split(root)
    if name != 'robot':
        what = ', an SDF: a URDF is needed' if name == 'sdf' else ''
        raise BadConfig(f'{source}: expected the root element <robot>, got <{shown(name)}>{what}')
    if space:
        for element in root.iter():
            if _split(element)[0] == space:
                element.tag = _split(element)[1]
    _refuse_xacro(root, source)
    return root


def _parsed(text: bytes) -> Element:
    try:
        root: Element = fromstring(text, forbid_dtd=True)
    except ParseError as error:
        if 'unbound prefix' not in str(error):
            raise
        used = {*_PREFIX.findall(text)} - {b'xml', b'xmlns'}
        names = sorted(name for name in used if b'xmlns:' + name not in text)
        spaces = (XACRO.encode() if name == b'xacro' else b'urn:' + name for name in names)
        said = (b' xmlns:%b="%b"' % pair for pair in zip(names, spaces, strict=True))
        root = fromstring(text.replace(b'<robot', b'<robot' + b''.join(said), 1), forbid_dtd=True)
    return root


def _split(element: Element) -> tuple[str, str]:
    """Return the namespace and the name of an element; comments have neither."""
    tag = element.tag if isinstance(element.tag, str) else ''
    space, _, name = tag.rpartition('}')
    return space.removeprefix('{'), name


def _refuse_xacro(root: Element, source: str) -> None:
    """Raise BadConfig for xacro in what is read: elements that do something, and expressions."""
    for element in root:
        space, name = _split(element)
        old = not space and name in _UNPREFIXED
        if (old or 'xacro' in space) and name not in _DEFINITIONS:
            raise _xacro(source, f'<{"" if old else "xacro:"}{name}>')
        if name in {'link', 'joint'} and not space:
            where = f'{source}: {name} {cut(element.get("name", ""))}'
            for part in _read_parts(element):
                space, name = _split(part)
                if 'xacro' in space:
                    raise _xacro(where, f'<xacro:{name}>')
                for key, value in part.items():
                    if ('${' in value or '$(' in value) and key != 'filename':
                        raise _xacro(where, shown(value))


def _read_parts(element: Element) -> Iterator[Element]:
    """Yield an element and all in it but pictures."""
    waiting: list[Element] = [element]
    while waiting:
        part = waiting.pop()
        yield part
        waiting += [child for child in part if child.tag != 'visual']


def _xacro(where: str, got: str) -> BadConfig:
    return BadConfig(f'{where}: expected a URDF, got xacro ({got}): {_RUN}')


def bare_links(root: Element) -> Iterable[str]:
    """Yield the names of links that are only a frame: without mass, geometry and picture."""
    parts = ('inertial', 'collision', 'visual')
    for link in root.findall('link'):
        if all(link.find(part) is None for part in parts):
            yield link.get('name', '')
