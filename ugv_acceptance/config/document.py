"""Parses YAML and remembers the line of every key, so that errors can name file and line."""

from collections.abc import Sequence
from dataclasses import dataclass

import yaml

from ugv_acceptance import BadConfig
from ugv_acceptance.config.units import KEY_ENDINGS

# What PyYAML raises for text it cannot construct: a date of month 13, an unknown tag, deep nesting.
_PARSE_ERRORS = (
    yaml.YAMLError,
    ArithmeticError,
    AttributeError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
)
_DEEPEST = 20
_MOST = 50_000

Path = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Document:
    """A parsed YAML file: its plain values and the line (from 1) of each path in it."""

    source: str
    data: object
    lines: dict[Path, int]

    def where(self, path: Sequence[str | int]) -> str:
        """Return 'file:line: a.b.c' for a path, with the line of the nearest key that exists."""
        known: Path = ()
        for part in path:
            here = self._key(known, part)
            if here is None:
                break
            known = here
        line = self.lines.get(known, 1)
        written = (*known, *path[len(known) :])
        field = _dotted(written)
        return f'{self.source}:{line}: {field}' if field else f'{self.source}:{line}'

    def _key(self, parent: Path, part: str | int) -> Path | None:
        """Return the path of a key below `parent`, written with or without its unit."""
        endings = (part, *(f'{part}_{unit}' for unit in KEY_ENDINGS))
        return next((p for e in endings if (p := (*parent, e)) in self.lines), None)


def read_document(text: str, source: str) -> Document:
    """Parse a YAML text; BadConfig if it is not YAML or holds a key twice."""
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        lines: dict[Path, int] = {}
        if node is not None:
            _walk(node, (), lines, source)
        data = None if node is None else loader.construct_document(node)
    except BadConfig:
        raise
    except _PARSE_ERRORS as error:
        raise BadConfig(f'{source}{_place(error)}: expected YAML, got {_problem(error)}') from None
    return Document(source, data, lines)


def _walk(node: yaml.Node, path: Path, lines: dict[Path, int], source: str) -> None:
    """Record the line of every key below a node in `lines`."""
    lines.setdefault(path, node.start_mark.line + 1)
    # This also ends on an alias to its own parent, and on aliases of aliases.
    if len(path) > _DEEPEST or len(lines) > _MOST:
        raise BadConfig(
            f'{source}:{node.start_mark.line + 1}: expected at most {_MOST} values,'
            f' {_DEEPEST} deep, got more'
        )
    if isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            _walk(item, (*path, index), lines, source)
    elif isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            here = (*path, str(key.value))
            if here in lines:
                line = key.start_mark.line + 1
                raise BadConfig(f'{source}:{line}: {_dotted(here)}: key given twice')
            lines[here] = key.start_mark.line + 1
            _walk(value, here, lines, source)


def _dotted(path: Path) -> str:
    """Return a path as 'a.b.c'; unprintable keys are escaped, so that it stays on one line."""
    words = (str(part) for part in path)
    return '.'.join(word if word.isprintable() else repr(word) for word in words)


def _place(error: Exception) -> str:
    mark = getattr(error, 'problem_mark', None)
    return '' if mark is None else f':{mark.line + 1}'


# What PyYAML says of the mistakes that people make, in words that tell what to do.
_WORDS = (
    ("character '\\t'", 'a tab: indent with spaces'),
    ('expected <block end>', 'a line that is indented neither as those beside it nor below them'),
    ('unacceptable character', 'a control character, or another encoding than UTF-8'),
    ('mapping values are not allowed here', 'a second ":" in one line, or a line indented too far'),
    ("could not find expected ':'", 'a line without ":" where a key is expected'),
    ("expected ',' or", 'a bracket that is not closed, or a comma that is missing'),
    ('unexpected end of stream', 'a quote or bracket that is not closed'),
    ('found unexpected end', 'a quote or bracket that is not closed'),
)


def _problem(error: Exception) -> str:
    """Return why a text is no YAML, in plain words where it is a usual mistake."""
    text = str(getattr(error, 'problem', None) or str(error) or type(error).__name__)
    known = next((words for part, words in _WORDS if part in text), None)
    return known or ' '.join(text.split())
