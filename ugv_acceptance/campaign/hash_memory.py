"""Remembers in a campaign's folder which recording had which hash, so that it need not be read.

One line of JSON a run in `hashes.jsonl`: its SHA-256 and the mark (`marks.py`) of each of its files
when it was taken. Lines are added as runs are judged; the last of a run counts.
"""

import json
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from ugv_acceptance.bag.atomic_files import naming, write_text
from ugv_acceptance.campaign.sources import Source

NAME = 'hashes.jsonl'
_FIRST = json.dumps({'ugv_acceptance': 'hashes of the recordings of a campaign', 'version': 1})
_DIGITS = 64


@dataclass(frozen=True, slots=True)
class Remembered:
    """The hash of a recording, the marks of its files then, and when that was (UTC, ISO 8601)."""

    sha256: str
    files: dict[str, str]
    hashed: str


@dataclass(slots=True)
class HashMemory:
    """The hashes remembered in a folder; `said` is a sentence where something is odd, else ''.

    A file that is not of this program is neither used nor touched (`foreign`).
    """

    path: Path
    said: str = ''
    foreign: bool = False
    runs: dict[str, Remembered] = field(default_factory=dict)

    def of(self, source: Source) -> Remembered | None:
        """Return what is remembered of a run if all of its files are unchanged, else None."""
        found = self.runs.get(source.name)
        same = found is not None and source.marked and found.files == _files(source)
        return found if same else None

    def add(self, source: Source, sha256: str) -> None:
        """Remember the hash of a run whose files all have a mark. AcceptanceError if it cannot."""
        if not source.marked or self.foreign:
            return
        now = datetime.now(timezone.utc).isoformat(timespec='seconds')
        found = Remembered(sha256, _files(source), now)
        self.runs[source.name] = found
        with naming(self.path), self.path.open('a', encoding='utf-8') as file:
            file.write(('' if file.tell() else f'{_FIRST}\n') + _line(source.name, found))


def read_memory(folder: Path) -> HashMemory:
    """Return the hashes remembered in a campaign's folder; of damaged lines only their number."""
    memory = HashMemory(folder / NAME)
    try:
        text = memory.path.read_bytes().decode('utf-8', 'replace')
    except FileNotFoundError:
        return memory
    except OSError as error:
        return _foreign(memory, str(error.strerror))
    first, _, lines = text.partition('\n')
    if first != _FIRST and (lines or not _FIRST.startswith(first)):
        return _foreign(memory, f'got {first[:40]!r}')
    read = [_read(line) for line in lines.split('\n') if line]
    memory.runs = dict(one for one in read if one is not None)
    damaged = read.count(None)
    if damaged:
        memory.said = f'{memory.path}: damaged lines: {damaged}; those runs are read again'
    # Lines that are damaged, cut off, or were replaced by a later one.
    if len(read) > len(memory.runs) or not text.endswith('\n'):
        text = ''.join(_line(name, one) for name, one in memory.runs.items())
        write_text(memory.path, f'{_FIRST}\n{text}')
    return memory


def _foreign(memory: HashMemory, why: str) -> HashMemory:
    memory.foreign = True
    memory.said = (
        f'{memory.path}: expected remembered hashes, {why}; every recording is read'
        ' until that file is removed'
    )
    return memory


def _files(source: Source) -> dict[str, str]:
    return dict(zip(source.files, source.marks, strict=True))


def _line(name: str, found: Remembered) -> str:
    files = {'files': found.files, 'hashed': found.hashed}
    return json.dumps({'run': name, 'sha256': found.sha256, **files}) + '\n'


def _read(line: str) -> tuple[str, Remembered] | None:
    """Return the run of a line and what it remembers, None where it is damaged."""
    try:
        told: Any = json.loads(line)
        name, found = told['run'], Remembered(told['sha256'], told['files'], told['hashed'])
        datetime.fromisoformat(found.hashed)
        whole = len(bytes.fromhex(found.sha256)) * 2 == _DIGITS
        marks = all(isinstance(mark, str) for mark in found.files.values())
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None
    return (name, found) if whole and marks and isinstance(name, str) else None
