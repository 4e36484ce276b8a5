"""Mutated messages of each input type into a session: decoding, validation and evaluation."""

import struct
from collections.abc import Iterator
from random import Random

from hardening.outcome import Outcome, memory
from nodes.live_case import FOLDED, NAMES

from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.config import load
from ugv_acceptance.monitoring.session import Session

ZERO = (0.0,) * 3
LEVEL = (0.0, 0.0, 0.0, 1.0)
STAMP = 1_700_000_000_000_000_000
# Messages of each type, whole and right: what is mutated.
SEEDS = {
    'joint_states': (
        joint_state_cdr(STAMP, '', NAMES, FOLDED),
        joint_state_cdr(STAMP, 'base_link', NAMES, FOLDED, [0.0] * 4, [1.0] * 4),
        joint_state_cdr(STAMP, '', NAMES[:2], FOLDED[:2]),
        joint_state_cdr(STAMP, '', (), ()),
    ),
    'imu': (
        imu_cdr(STAMP, 'imu_link', LEVEL, ZERO, (0.0, 0.0, 9.81)),
        imu_cdr(STAMP, '', (0.1, 0.0, 0.0, 0.995), (0.1,) * 3, (0.0, 1.9, 9.6)),
    ),
    'payload': (
        inertia_cdr(STAMP, 'gripper_link', 2.0, ZERO),
        inertia_cdr(STAMP, '', 0.0, (0.1, 0.0, 0.0)),
    ),
}
# Bytes that numbers of a message break at: lengths, NaN, infinity, the largest and least float.
PIECES = (
    *(struct.pack('<I', n) for n in (0, 1, 5, 2**16, 2**31 - 1, 2**31, 2**32 - 1)),
    *(struct.pack('<d', x) for x in (float('nan'), float('inf'), 1e308, -1e308, 5e-324, 180.0)),
    b'\xff\xfe',
    b'\0',
)


def mutated(rng: Random, seed: bytes) -> bytes:
    """Return a message after one to four changes: bits, bytes, pieces, cuts, additions."""
    data = bytearray(seed)
    for _ in range(1 + rng.getrandbits(2)):
        if not data:
            break
        at, way = rng.randrange(len(data)), rng.randrange(6)
        if way == 0:
            data[at] ^= 1 << rng.getrandbits(3)
        elif way == 1:
            data[at] = rng.getrandbits(8)
        elif way in (2, 3):
            piece = rng.choice(PIECES)
            data[at : at + len(piece)] = piece
        elif way == 4:
            del data[at:]
        else:
            data[at:at] = rng.randbytes(rng.randrange(1, 9))
    return bytes(data)


def mutants(seeds: tuple[bytes, ...], count: int, seed: int) -> Iterator[bytes]:
    """Yield messages, one in eight of them whole."""
    rng = Random(seed)
    for k in range(count):
        whole = rng.choice(seeds)
        yield whole if k % 8 == 0 else mutated(rng, whole)


def session() -> tuple[Session, list[str]]:
    """Return a session of the PackBot, and the faults of our own code that it will report."""
    faults: list[str] = []

    def problem(text: str) -> None:
        if 'fault of the monitor' in text:
            faults.append(text)

    made = Session(load().settings, lambda _stamp, _margins: None, lambda: None, problem)
    return made, faults


def trial(count: int, seed: int = 0, warm: int = 20_000) -> dict[str, Outcome]:
    """Take `count` mutants of each input; growth is counted after the first `warm` of them."""
    return {name: _one(name, count, seed, warm) for name in SEEDS}


def _one(name: str, count: int, seed: int, warm: int) -> Outcome:
    watched, faults = session()
    take = getattr(watched, f'take_{name.removesuffix("s")}')
    others = [watched.take_imu, watched.take_joint_state]
    before = memory()
    for k, data in enumerate(mutants(SEEDS[name], count, seed)):
        if k == min(warm, count // 2):
            before = memory()
        take(data)
        if k % 64 == 0:  # margins are evaluated, not only messages decoded
            others[0](SEEDS['imu'][0])
            others[1](SEEDS['joint_states'][0])
            watched.alarm_tracker.take()
            watched.tick()
    growth, refused = memory() - before, watched.counts[name].malformed
    text = f'{count} {name}: {refused} refused, {len(faults)} faults, {growth:+.1f} MB'
    if faults:
        text += f' ({faults[0]})'
    taken = watched.counts[name].taken
    return Outcome(text, not faults and growth < 10.0 and refused > 0 and taken > 0)
