"""Robot files with anything in them: a configuration, or one line that names the file."""

import re
import time
from itertools import pairwise
from math import inf
from pathlib import Path
from random import Random

from config.robot_files import URDF, YAML, write_robot
from hardening.outcome import Outcome

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.model.statics import static_torque

PIECES = (
    '', '0', '-1', 'nan', '1e999', '[]', '{}', '&a', '*a', '!!python/object:os.system', '\t', '\0',
    '<', '>', '"', '&b;', 'base', 'arm', '30 deg', '~', '- ', ': ', '\n', '</robot>',
)  # fmt: skip
ENTITIES = '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>'
LAUGHS = ''.join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10))
LAUGHS = f'<!DOCTYPE r [<!ENTITY a0 "ha">{LAUGHS}]>'
EXTERNAL = '<!DOCTYPE r [<!ENTITY b SYSTEM "file:///etc/passwd">]>'
SECOND_ROOT = '<link name="other"><inertial><mass value="3"/></inertial></link></robot>'
SECOND_PARENT = (
    '<joint name="z" type="fixed"><parent link="base"/><child link="hand"/></joint></robot>'
)


def mutated(rng: Random, text: str) -> str:
    """Return a text after one or two changes."""
    for _ in range(1 + rng.randrange(2)):
        at = rng.randrange(len(text))
        other = rng.randrange(len(text))
        piece = rng.choice(PIECES) if rng.random() < 0.7 else text[other : other + 30]
        text = text[:at] + piece + text[at + rng.randrange(4) :] or ' '
    return text


def fuzz(folder: Path, count: int, seed: int = 0, patience: float = inf) -> Outcome:
    """Load `count` robots, half of them with a mutated YAML, half with a mutated URDF."""
    rng, refused, bad, slowest = Random(seed), 0, list[str](), 0.0
    for k in range(count):
        texts = (mutated(rng, YAML), URDF) if k % 2 else (YAML, mutated(rng, URDF))
        path, start = write_robot(folder, *texts), time.perf_counter()
        try:
            load(path)
        except BadConfig as error:
            refused += 1
            if str(folder) not in str(error) or '\n' in str(error):
                bad.append(f'not one line with the file: {error}')
        except Exception as error:  # noqa: BLE001 (any other exception is what is looked for)
            bad.append(repr(error))
        slowest = max(slowest, time.perf_counter() - start)
    text = f'{count} fuzzed robots: {refused} refused, {len(bad)} badly, slowest {slowest:.2f} s'
    return Outcome(
        '; '.join([text, *bad[:1]]), not bad and 0 < refused < count and slowest < patience
    )


def chain(joints: int, *, branches: bool = False) -> str:
    """Return a URDF of a base with joints one behind the other, or all on the base."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    links = ['base', *(f'l{k}' for k in range(joints))]
    pairs = [('base', b) for b in links[1:]] if branches else list(pairwise(links))
    weight = f'<inertial><mass value="1"/>{inertia}</inertial>'
    parts = [f'<link name="{n}">{weight}</link>' for n in links]
    parts += [
        f'<joint name="j_{b}" type="revolute"><parent link="{a}"/><child link="{b}"/>'
        '<origin xyz="0.1 0 0"/><axis xyz="0 -1 0"/>'
        '<limit lower="-1" upper="1" effort="40" velocity="1"/></joint>'
        for a, b in pairs
    ]
    return f'<robot name="two">{"".join(parts)}</robot>'


def hostile(folder: Path, patience: float = inf) -> Outcome:
    """Load entities, cycles, bombs, huge trees: refused in one line, or right."""
    bomb = '\n'.join(
        ['a0: &a0 [x]', *(f'a{k}: &a{k} [{", ".join([f"*a{k - 1}"] * 9)}]' for k in range(1, 20))]
    )
    files = {
        'entities': (YAML, ENTITIES + URDF.replace('name="two"', 'name="&b;"', 1)),
        'external entity': (YAML, EXTERNAL + URDF.replace('name="two"', 'name="&b;"', 1)),
        'billion laughs': (YAML, LAUGHS + URDF.replace('name="two"', 'name="&a9;"', 1)),
        'two parents': (YAML, URDF.replace('</robot>', SECOND_PARENT)),
        'two roots': (YAML, URDF.replace('</robot>', SECOND_ROOT)),
        'no mass at all': (YAML, re.sub(r'<mass value="\d+"/>', '<mass value="0"/>', URDF)),
        'cycle of aliases': ('a: &a [*a]\n' + YAML, URDF),
        'cycle': (YAML, URDF.replace('<child link="arm"/>', '<child link="base"/>')),
        'negative mass': (YAML, URDF.replace('"20"', '"-20"')),
        'infinite mass': (YAML, URDF.replace('"20"', '"inf"')),
        'aliases for a billion values': (YAML + bomb, URDF),
        'ten thousand brackets': ('[' * 10_000, URDF),
        'ten thousand elements deep': (YAML, '<robot>' + '<a>' * 10_000),
    }
    bad, slowest = [], (0.0, '')
    for name, texts in files.items():
        start = time.perf_counter()
        try:
            load(write_robot(folder, *texts))
            bad.append(f'{name}: taken')
        except BadConfig:
            pass
        except Exception as error:  # noqa: BLE001 (any other exception is what is looked for)
            bad.append(f'{name}: {error!r}')
        took = time.perf_counter() - start
        slowest = max(slowest, (took, name))
    text = f'{len(files) - len(bad)} of {len(files)} hostile files refused'
    text += f', slowest {slowest[0]:.2f} s ({slowest[1]})'
    return Outcome('; '.join([text, *bad[:2]]), not bad and slowest[0] < patience)


def large(folder: Path, joints: int, *, branches: bool, patience: float = inf) -> Outcome:
    """Load a tree of `joints` joints, the first hundred of them the robot's; mass and torques."""
    theirs = '  lift:\n    limit_nm: 30\n  slide:\n    limit_n: 100\n'
    ours = min(joints, 100)
    yaml = YAML.replace(theirs, ''.join(f'  j_l{k}:\n    limit_nm: 30\n' for k in range(ours)))
    yaml = yaml.replace('payload: {link: hand, mass_kg: 1}\n', '')
    start = time.perf_counter()
    path = write_robot(folder, yaml, chain(joints, branches=branches))
    try:
        robot = load(path).settings.robot
    except BadConfig as error:
        return Outcome(f'{joints} joints refused: {error}', held=False)
    took = time.perf_counter() - start
    mass = sum(link.mass for link in robot.links)
    torque = static_torque(robot, [0.0] * ours, (0.0, 0.0, -9.81))
    # Every link of a chain is a kg, 0.1 m further out than the one before it.
    carried = [0 if branches else sum(range(joints - k)) for k in range(ours)]
    wrong = max(abs(tau - 0.981 * x) for tau, x in zip(torque, carried, strict=True))
    shape = 'branches' if branches else 'links in a chain'
    text = f'{joints} {shape}: mass {mass:g} kg of {joints + 1} kg, '
    text += f'torques wrong by {wrong:.1e} N m, loaded in {took:.2f} s'
    return Outcome(text, abs(mass - joints - 1) < 1e-9 and wrong < 1e-6 and took < patience)
