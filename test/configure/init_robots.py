"""Small URDFs of our own for the tests of `init`: a rover, a tracked arm, an arm alone, a dog."""

from collections.abc import Iterator

INERTIA = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'


def link(name: str, mass: float = 0.0, shape: str = '', at: str = '0 0 0', cog: str = '') -> str:
    """Return a link with a mass at `cog` and a collision shape at `at`, both in its axes."""
    body = ''
    if mass:
        place = cog or at
        body += f'<inertial><origin xyz="{place}"/><mass value="{mass}"/>{INERTIA}</inertial>'
    if shape:
        body += f'<collision><origin xyz="{at}"/><geometry>{shape}</geometry></collision>'
    return f'<link name="{name}">{body}</link>'


def joint(
    name: str, kind: str, ends: tuple[str, str], xyz: str, axis: str = '0 1 0', limit: str = ''
) -> str:
    """Return a joint between two links; `limit` is the effort, with a range of 2 rad each way."""
    parent, child = ends
    text = f'<origin xyz="{xyz}"/><parent link="{parent}"/><child link="{child}"/>'
    if kind != 'fixed':
        text += f'<axis xyz="{axis}"/>'
    if limit:
        text += f'<limit lower="-2" upper="2" effort="{limit}" velocity="2"/>'
    return f'<joint name="{name}" type="{kind}">{text}</joint>'


def robot(name: str, *parts: str) -> str:
    """Return a URDF."""
    return f'<robot name="{name}">\n' + '\n'.join(parts) + '\n</robot>\n'


def box(x: float, y: float, z: float) -> str:
    """Return the geometry of a box (m)."""
    return f'<box size="{x} {y} {z}"/>'


def _imu() -> Iterator[str]:
    yield link('imu_link')
    yield joint('imu_mount', 'fixed', ('base_link', 'imu_link'), '0 0 0.1')


def rover() -> str:
    """Return a rover of 20 kg: four wheels of 0.1 m radius, 5 cm wide, tracks 0.5 m apart."""
    parts = [link('base_link', 16.0, box(0.6, 0.3, 0.2)), *_imu()]
    for end, x in (('front', 0.2), ('rear', -0.2)):
        for side, y in (('left', 0.25), ('right', -0.25)):
            name = f'{end}_{side}_wheel'
            wheel = '<cylinder radius="0.1" length="0.05"/>'
            body = link(f'{name}_link', 1.0, wheel)
            body = body.replace(
                '<collision><origin xyz="0 0 0"/>',
                '<collision><origin xyz="0 0 0" rpy="1.5707963267948966 0 0"/>',
            )
            parts += [body]
            parts += [joint(name, 'continuous', ('base_link', f'{name}_link'), f'{x} {y} -0.05')]
    return robot('rover', *parts)


def tracked_arm(shoulder: str = '60', elbow: str = '40') -> str:
    """Return a tracked robot of 36 kg with turret, shoulder, elbow and a fixed gripper."""
    return robot(
        'tracked',
        link('base_link', 30.0, box(0.7, 0.1, 0.2), '0 0.2 0.1', '0 0 0.08'),
        link('right_track', 0.0, box(0.7, 0.1, 0.2)),
        joint('right', 'fixed', ('base_link', 'right_track'), '0 -0.2 0.1'),
        *_imu(),
        link('turret_link', 1.0, box(0.1, 0.1, 0.05)),
        joint('turret', 'revolute', ('base_link', 'turret_link'), '0 0 0.25', '0 0 1', '30'),
        link('upper_link', 3.0, box(0.5, 0.05, 0.05), '0.25 0 0'),
        joint(
            'shoulder', 'revolute', ('turret_link', 'upper_link'), '0 0 0.05', '0 -1 0', shoulder
        ),
        link('fore_link', 2.0, box(0.4, 0.05, 0.05), '0.2 0 0'),
        joint('elbow', 'revolute', ('upper_link', 'fore_link'), '0.5 0 0', '0 -1 0', elbow),
        link('gripper_link'),
        joint('grip', 'fixed', ('fore_link', 'gripper_link'), '0.4 0 0'),
    )  # fmt: skip


def arm_alone() -> str:
    """Return an arm of three joints that stands on nothing: its root is the world."""
    return robot(
        'bench_arm',
        link('world'),
        link('base_link', 4.0, box(0.2, 0.2, 0.1), '0 0 0.05'),
        joint('bolted', 'fixed', ('world', 'base_link'), '0 0 0'),
        link('one', 1.0, box(0.05, 0.05, 0.1)),
        joint('pan', 'revolute', ('base_link', 'one'), '0 0 0.15', '0 0 1', '20'),
        link('two', 2.0, box(0.4, 0.05, 0.05), '0.2 0 0'),
        joint('lift', 'revolute', ('one', 'two'), '0 0 0.05', '0 -1 0', '30'),
        link('three', 1.0, box(0.3, 0.05, 0.05), '0.15 0 0'),
        joint('bend', 'revolute', ('two', 'three'), '0.4 0 0', '0 -1 0', '15'),
        link('tool0'),
        joint('flange', 'fixed', ('three', 'tool0'), '0.3 0 0'),
    )


def dog() -> str:
    """Return a robot of 12 kg on four legs of two joints, with balls as feet."""
    parts = [link('base_link', 8.0, box(0.5, 0.2, 0.1)), *_imu()]
    for end, x in (('front', 0.2), ('rear', -0.2)):
        for side, y in (('left', 0.12), ('right', -0.12)):
            name = f'{end}_{side}'
            parts += [
                link(f'{name}_thigh', 0.6, box(0.03, 0.03, 0.2), '0 0 -0.1'),
                joint(f'{name}_hip', 'revolute', ('base_link', f'{name}_thigh'), f'{x} {y} 0',
                      '0 1 0', '23.5'),
                link(f'{name}_shank', 0.4, box(0.03, 0.03, 0.16), '0 0 -0.1'),
                joint(f'{name}_knee', 'revolute', (f'{name}_thigh', f'{name}_shank'), '0 0 -0.2',
                      '0 1 0', '45'),
                link(f'{name}_foot', 0.0, '<sphere radius="0.02"/>'),
                joint(f'{name}_ankle', 'fixed', (f'{name}_shank', f'{name}_foot'), '0 0 -0.2'),
            ]  # fmt: skip
    return robot('dog', *parts)
