"""Finds by their names that parts of a split recording are missing, where no metadata.yaml tells.

A recorder of ROS 2 numbers its files from 0: run_0.mcap, run_1.mcap, ... in a folder named run. A
last part that is missing leaves no trace in the names.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

from ugv_acceptance.bag.metadata import SUFFIXES, part_of

# From this number on, a name's last digits are a date or a time, not those of a part.
_NO_PART = 100_000
# Missing parts named in one sentence.
_NAMED = 3


def missing_parts(files: Sequence[Path], recording: Path | None = None) -> Iterator[str]:
    """Yield a sentence for each split recording of which some of the parts are not among `files`.

    `recording` is the folder that is read as one recording; None: the files were given one by one.
    Then those before the first may be left out if they are there. One file alone is a part only in
    a folder of its own name.
    """
    found: dict[tuple[Path, str], set[int]] = {}
    for file in files:
        part = _numbered(file)
        if part is not None:
            found.setdefault((file.parent, part[0]), set()).add(part[1])
    for (folder, stem), numbers in found.items():
        if len(numbers) == 1 and (recording is None or recording.resolve().name != stem):
            continue
        missing = sorted(set(range(max(numbers))) - numbers)
        if recording is None:
            left_out = {n for n in missing if n < min(numbers)} & _beside(folder, stem)
            missing = [n for n in missing if n not in left_out]
        if missing:
            yield _words(stem, missing, sorted(numbers))


def _numbered(file: Path) -> tuple[str, int] | None:
    """Return stem and number of a file that a recorder may have numbered, None of any other."""
    part = part_of(file.name)
    if part is None or part[1] >= _NO_PART:
        return None
    # A recorder writes no leading zeros, and 0 to 9 alone.
    return part if file.name.startswith(f'{part[0]}_{part[1]}.') else None


def _beside(folder: Path, stem: str) -> set[int]:
    """Return the numbers of the parts of a recording that are in a folder."""
    names = (p for p in folder.iterdir() if p.name.lower().endswith(SUFFIXES))
    parts = (_numbered(p) for p in names)
    return {part[1] for part in parts if part is not None and part[0] == stem}


def _words(stem: str, missing: Sequence[int], numbers: Sequence[int]) -> str:
    named = ', '.join(f'{stem}_{n}' for n in missing[:_NAMED])
    more = f' and {len(missing) - _NAMED} more' if len(missing) > _NAMED else ''
    are = 'is' if len(missing) == 1 else 'are'
    held = ', '.join(f'{stem}_{n}' for n in numbers[:_NAMED])
    held += ', ...' if len(numbers) > _NAMED else ''
    return (
        f'{named}{more} {are} missing: a recorder numbers the parts of a recording from 0, found '
        f'{held}'
    )
