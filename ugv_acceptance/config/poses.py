"""Named postures of a robot file, such as STOW or DRIVE: checked, and looked up by their names."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import Path
from ugv_acceptance.config.units import Measure, cut, parse, shown, split_key
from ugv_acceptance.model.robot import Joint, Pose, Robot

Refuse = Callable[[Path, str], BadConfig]
# A position this far (rad or m) beyond the end of a joint's range is rounding, not a mistake.
_ROUNDING = 1e-6


def poses_from(
    poses: Mapping[str, Mapping[str, object]], joints: Sequence[Joint], refuse: Refuse
) -> Iterable[Pose]:
    """Yield the poses of a file; `joints` are the measured ones, `refuse` makes a BadConfig.

    Raises BadConfig for a joint that is not measured or named twice, and for a position that is
    none, of another unit than the joint's, or outside its range.
    """
    known = {joint.name: joint for joint in joints}
    for name, written in poses.items():
        found: dict[str, float] = {}
        for key, value in written.items():
            path = ('poses', name, key)
            of, unit = (key, None) if key in known else split_key(key)
            if of not in known:
                raise refuse(
                    path, f'expected a measured joint, got {shown(key)}{nearest_name(of, known)}'
                )
            if of in found:
                raise refuse(path, f'given twice, as {of} with different units')
            given = value if unit is None else Measure(value, unit)
            try:
                found[of] = _position(known[of], given)
            except ValueError as error:
                raise refuse(path, str(error)) from None
        yield Pose(name, tuple(found.items()))


def _position(joint: Joint, given: object) -> float:
    """Return a position (rad, m); ValueError says what was expected and what came."""
    at = parse(given, ('length' if joint.slides else 'angle',)).value
    if not joint.lower - _ROUNDING <= at <= joint.upper + _ROUNDING:
        unit = joint.units.position
        raise ValueError(
            f'expected {joint.lower:g} .. {joint.upper:g} {unit}, the range of {joint.name} '
            f'in the URDF, got {at:g} {unit}'
        )
    return at


def pose_named(robot: Robot, name: str, where: str) -> dict[str, float]:
    """Return the positions (rad, m) of the joints that a pose names; `where` is for the error.

    Raises BadConfig if the robot has no pose of that name.
    """
    found = next((pose for pose in robot.poses if pose.name == name), None)
    if found is None:
        names = [pose.name for pose in robot.poses]
        known = f'a pose ({", ".join(names)})' if names else 'a pose, of which this robot has none,'
        raise BadConfig(f'{where}: expected {known}, got {shown(name)}{nearest_name(name, names)}')
    return dict(found.positions)


def nearest_name(name: str, known: Iterable[str]) -> str:
    """Return '; did you mean NAME?' for the known name that is most like `name`, else ''."""
    by_lower = {one.lower(): one for one in known}
    near = get_close_matches(name.lower(), by_lower, 1, 0.5)
    return f'; did you mean {cut(by_lower[near[0]])}?' if near else ''
