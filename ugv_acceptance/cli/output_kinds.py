"""The kinds of files the verbs write: their endings, and how a file of ours is recognised."""

import json
import re
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Bytes at the start of a file in which its kind is said.
_HEAD = 8192
# A larger file is no result, plan or report of ours.
_LARGEST = 1 << 28
_HEX = re.compile(r'[0-9a-f]{64}\.json')


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of file: its format, its endings, and how to tell whether a file is one we wrote.

    A file that we wrote may be replaced without asking; another only with --overwrite.
    `else_it_is` describes such a file. `by_ending`: the ending says what is written, so a pipe,
    which has none, will not do.
    """

    format: str
    endings: tuple[str, ...]
    ours: Callable[[Path], bool]
    else_it_is: str
    by_ending: bool = False


@dataclass(frozen=True, slots=True)
class FolderKind:
    """A kind of folder: what it is, the files written into it, and how to recognise one of ours.

    `files` are patterns. `may_fill`: with --overwrite it may also be one that is not ours.
    """

    what: str
    files: tuple[str, ...]
    ours: Callable[[Path], bool]
    may_fill: bool = True


def _head(path: Path) -> bytes:
    with path.open('rb') as file:
        return file.read(_HEAD)


def _whole(path: Path) -> bytes:
    return path.read_bytes() if path.stat().st_size < _LARGEST else b''


def _starts(pattern: bytes) -> Callable[[Path], bool]:
    """Return a test whether a file's beginning matches a pattern."""
    found = re.compile(pattern, re.DOTALL)
    return lambda path: found.match(_head(path)) is not None


def _json(path: Path) -> Any:  # noqa: ANN401 - JSON
    try:
        return json.loads(_whole(path))
    except (ValueError, RecursionError):
        return None


def _is_result(path: Path) -> bool:
    """Whether a file holds what evaluate --json writes: a result, or a list of them."""
    found = _json(path)
    results = found if isinstance(found, list) else [found]
    return bool(results) and all(isinstance(r, dict) and _one_result(r) for r in results)


def _one_result(result: dict[str, Any]) -> bool:
    judged = {'version', 'criteria', 'coverage', 'software'} <= set(result)
    return {'verdict', 'reasons', 'bag'} <= set(result) and (
        judged or result['verdict'] == 'BAD INPUT'
    )


def _is_info(path: Path) -> bool:
    """Whether a file holds what info --json writes."""
    found = _json(path)
    return isinstance(found, dict) and {'recording', 'topics', 'could_be_judged'} <= set(found)


def _is_pdf(path: Path) -> bool:
    """Whether a PDF is a report of ours, by its outline in a compressed part."""
    content = _whole(path)
    if not content.startswith(b'%PDF-'):
        return False
    for part in re.finditer(rb'stream\r?\n(.*?)endstream', content, re.DOTALL):
        try:
            text = zlib.decompressobj().decompress(part[1], _LARGEST)
        except zlib.error:
            continue
        if b'/Producer (WeasyPrint' in text and b'/Title (Acceptance report)' in text:
            return True
    return False


def _is_parquet(path: Path) -> bool:
    try:
        from pyarrow import ArrowException, parquet

        names = parquet.read_schema(path).names
    except (ImportError, ArrowException):
        return False
    return bool(names[:4] == ['time_s', 'log_time_ns', 'stamp_ns', 'state'])


def _unedited(first_line: str) -> Callable[[Path], bool]:
    """Return a test for a YAML file that starts with a line and was not edited since."""

    def test(path: Path) -> bool:
        from ugv_acceptance.config.seal import is_sealed

        text = _whole(path).decode('utf-8', 'replace')
        return text.startswith(first_line) and is_sealed(text)

    return test


def _is_map(path: Path) -> bool:
    """Whether a file is a map of ours, of the format its ending names."""
    if path.suffix.lower() == '.npz':
        try:
            with zipfile.ZipFile(path) as file:
                names = set(file.namelist())
        except zipfile.BadZipFile:
            return False
        return {f'{n}.npy' for n in ('x', 'y', 'value', 'class', 'names', 'gravity')} <= names
    return _MAPS[path.suffix.lower()](path)


_MAPS = {
    '.svg': _starts(rb'<svg .*<g id="(torque|rollover|payload|drag)-figure_1">'),
    '.png': _starts(rb'\x89PNG\r\n.{0,200}?tEXtSoftware\x00ugv_acceptance'),
    '.csv': _starts(rb'[^,\n]+,[^,\n]+,(torque|rollover|payload|drag)_[^,\n]+,class,cause\r?\n'),
}


_PICTURES = (
    _starts(rb'\x89PNG\r\n.{0,200}?tEXtTitle\x00robot picture'),
    _starts(rb'<!DOCTYPE html>.*?<title>Robot picture: '),
)


def _is_campaign(path: Path) -> bool:
    """Whether a folder holds our statement or, if ended early, only results of runs."""
    if (path / 'campaign.json').is_file():
        found = _json(path / 'campaign.json')
        return isinstance(found, dict) and {'version', 'mtbf_h', 'each_run'} <= set(found)
    runs = path / 'runs'
    held = {p.name for p in path.iterdir() if p.suffix != '.part'} - {'hashes.jsonl'}
    return held == {'runs'} and all(
        _HEX.fullmatch(p.name) or p.suffix == '.part' for p in runs.glob('*')
    )


def _is_paper(path: Path) -> bool:
    found = _json(path / 'paper.json') if (path / 'paper.json').is_file() else None
    return isinstance(found, dict) and {'table_1', 'table_2', 'figures'} <= set(found)


_YAML = ('.yaml', '.yml')
_HTML = ('.html', '.htm')
_PAGE = rb'\s*<!DOCTYPE html>.*<title>%s: '

RESULT = Kind('JSON', ('.json',), _is_result, 'and is not a result of evaluate')
INFO = Kind('JSON', ('.json',), _is_info, 'and was not written by info')
MARGINS = Kind(
    'CSV', ('.csv',), _starts(rb'time_s,stamp_ns,state,'), 'and is not a table of margins'
)
PARQUET = Kind('Parquet', ('.parquet',), _is_parquet, 'and is not a table of margins')
REPORT = Kind(
    'HTML', _HTML, _starts(_PAGE % b'Acceptance report'), 'and is not an acceptance report'
)
PDF = Kind('PDF', ('.pdf',), _is_pdf, 'and is not an acceptance report')
JUNIT = Kind(
    'JUnit XML',
    ('.xml',),
    _starts(rb'(<\?xml[^>]*>\s*)?<testsuites name="ugv_acceptance"'),
    'and is not a JUnit file of this program',
)
CRITERIA = Kind(
    'YAML', _YAML, _unedited('# Proposed from a run'), 'and is not a proposal, or was edited'
)
# A recording, even one with our judgement in it, is replaced only where that is asked for.
ANNOTATED = Kind('MCAP', ('.mcap',), lambda _: False, 'and may be a recording')
PLAN = Kind('YAML', _YAML, _unedited('# A test plan made by'), 'and is not a plan, or was edited')
# The record of a drill is somebody's proof: another drill does not replace it unasked.
DRILL_RECORD = Kind('JSON', ('.json',), lambda _: False, 'and may be the record of a drill')
CARD = Kind('HTML', _HTML, _starts(_PAGE % b'Operator card'), 'and is not an operator card')
CONFIGURATION = Kind('YAML', _YAML, lambda _: False, 'and may be a configuration')
DESCRIPTION = Kind('URDF', ('.urdf',), lambda _: False, 'and may be a description')
PICTURE = Kind(
    'pictures',
    ('.png', *_HTML),
    lambda path: any(test(path) for test in _PICTURES),
    'and is not a picture of a robot',
    by_ending=True,
)
MAP = Kind('maps', ('.svg', '.png', '.csv', '.npz'), _is_map, 'and is not a map', by_ending=True)

CAMPAIGN = FolderKind(
    'campaign', ('campaign.json', 'campaign.html', 'hashes.jsonl', 'runs/*.json'), _is_campaign
)
PAPER = FolderKind('paper', ('paper.json', 'paper.html', '*.svg'), _is_paper)
RECORDING = FolderKind('recording', (), lambda _: False, may_fill=False)
# `run` checks its folder by itself: it may be one to continue.
RUN = FolderKind(
    'run',
    ('run.json', 'journal.jsonl', 'result.json', 'report.txt', 'report.html', 'steps/*'),
    lambda _: True,
)
