"""The YAML file and the URDF being combined, and what every part of that needs."""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import Document, Path
from ugv_acceptance.config.schema import File
from ugv_acceptance.config.units import EXAMPLES, Given, cut, shown
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.model.robot import Joint


@dataclass(frozen=True, slots=True)
class Build:
    """The YAML file and the URDF being combined, and the warnings collected meanwhile."""

    document: Document
    file: File
    urdf: Urdf
    warnings: list[str]

    def refuse(self, path: Path, text: str) -> BadConfig:
        """Return the BadConfig for a field of the YAML file, with file and line."""
        return BadConfig(f'{self.document.where(path)}: {text}')

    def warn(self, path: Path, text: str) -> None:
        """Add a warning about a field of the YAML file, with file and line."""
        self.warnings.append(f'{self.document.where(path)}: {text}')


def known(build: Build, path: Path, name: str, known: Sequence[str], what: str) -> None:
    """Raise BadConfig for a name that is not among `known`, with the nearest that is."""
    if name not in known:
        near = get_close_matches(name, known, 1, 0.5)
        hint = f'did you mean {cut(near[0])}?' if near else f'it has {listed(known)}'
        raise build.refuse(path, f'the URDF has no {what} {shown(name)}; {hint}')


def listed(names: Sequence[str]) -> str:
    """Return the first of some names as text, each on one line; 'none' if there is none."""
    return ', '.join(map(cut, names[:8])) + ', ...' * (len(names) > 8) if names else 'none'


def of_joint(
    build: Build, path: Path, joint: Joint, given: Given, turning: str, sliding: str
) -> float:
    """Return a number of a joint in SI; BadConfig for metres of a rotary joint and the like."""
    kind = sliding if joint.slides else turning
    if given.kind not in (None, kind):
        raise build.refuse(
            path, f'expected {EXAMPLES[kind]} for a {joint.kind} joint, got a {given.kind}'
        )
    return given.value
