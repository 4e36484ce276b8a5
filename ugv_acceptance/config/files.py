"""Finds and reads the files of a robot: what ships, what ROS packages hold, what stands beside."""

import sys
from pathlib import Path

from ugv_acceptance import BadConfig

PACKAGE = 'ugv_acceptance'
# A larger file (bytes) is not a robot description.
LARGEST_FILE = 20_000_000


def find(path: Path) -> Path:
    """Return the file of a path, or of the name of a configuration that ships; else BadConfig."""
    if path.parent != Path() or path.exists():
        return path
    name = path if path.suffix in ('.yaml', '.yml') else Path(f'{path}.yaml')
    places = [folder / 'msg_configs' / name for folder in _shares()]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        known = ', '.join(shipped()) or 'none found'
        got = f'a link to {path.readlink()}, which is not there' if path.is_symlink() else 'none'
        raise BadConfig(f'{path}: expected a file, or one that ships ({known}), got {got}')
    return found


def shipped() -> list[str]:
    """Return the names of the configurations that ship."""
    folders = [folder / 'msg_configs' for folder in _shares()]
    return sorted({file.stem for folder in folders for file in folder.glob('*.yaml')})


def _shares() -> list[Path]:
    """Return the folders our data may be in: the checkout, and the installed share folders."""
    checkout, ros = Path(__file__).resolve().parents[2], share_of(PACKAGE)
    return [checkout, *([ros] if ros else []), Path(sys.prefix) / 'share' / PACKAGE]


def share_of(package: str) -> Path | None:
    """Return the share folder of a ROS package; None without ROS or without that package."""
    try:
        from ament_index_python.packages import (  # noqa: PLC0415 - ROS may be absent
            get_package_share_directory,
        )

        return Path(get_package_share_directory(package))
    except (ImportError, LookupError, OSError, ValueError):  # OSError: no AMENT_PREFIX_PATH
        return None


def beside(at: Path, urdf: str) -> Path:
    """Return the path of a URDF: relative to its configuration file, or package://NAME/PATH.

    Raises BadConfig for a package that is not installed, and for what cannot be a path.
    """
    if urdf.startswith('package://'):
        package, _, inside = urdf.removeprefix('package://').partition('/')
        share = share_of(package)
        if share is None:
            raise BadConfig(f'{at}: urdf: expected a ROS package of this set-up, got {package}')
        return share / inside
    try:
        return (at.resolve().parent / urdf.removeprefix('file://')).resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise BadConfig(f'{at}: urdf: expected a path, got {error}') from None


def read(path: Path, what: str) -> bytes:
    """Return the bytes of a file; BadConfig, which says `what` was expected, if there are none."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise BadConfig(f'{path}: expected a {what} below 20 MB, got a larger file')
        return path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or str(error)
        raise BadConfig(f'{path}: expected a {what}, got: {reason}') from None


def text(content: bytes, path: Path | str) -> str:
    """Return the bytes of a file as text; BadConfig if they are not UTF-8."""
    try:
        return content.decode('utf-8')
    except UnicodeDecodeError as error:
        line = content.count(b'\n', 0, error.start) + 1
        raise BadConfig(f'{path}:{line}: expected UTF-8 text, got another encoding') from None
