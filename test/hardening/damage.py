"""MCAP files cut, flipped, made to claim too much or to point at themselves, and what is read."""

import struct
import time
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from random import Random

import zstandard
from bag.bag_cases import Message, expected, rows, run, write_mcap
from bag.recordings import BOTH, SHAPES, chunk_starts
from hardening.outcome import Outcome, memory
from mcap.writer import CompressionType

from ugv_acceptance import BadBag
from ugv_acceptance.bag.reader import open_bag

GIB = 1 << 30


@dataclass(slots=True)
class Tally:
    """What reading many damaged copies of one recording came to.

    `silent` counts readings of a recording that calls itself wholly protected which held a message
    that was never written, or fewer than were, without a finding.
    """

    files: int = 0
    refused: int = 0
    silent: list[str] = field(default_factory=list)
    crashed: list[str] = field(default_factory=list)
    unsaid: int = 0
    slowest: float = 0.0

    def take(self, path: Path, whole: list[object], what: str, *, guarded: bool) -> None:
        """Read a file and compare it with what was written."""
        self.files += 1
        start = time.perf_counter()
        try:
            bag = open_bag(path)
            reading = bag.batches(BOTH)
            found = rows(reading)
        except BadBag:
            self.refused += 1
            return
        except Exception as error:  # noqa: BLE001 (any other exception is what is looked for)
            self.crashed.append(f'{what}: {error!r}')
            return
        finally:
            self.slowest = max(self.slowest, time.perf_counter() - start)
        if found == whole:
            return
        said = bool(bag.salvaged or bag.findings or reading.facts.findings)
        if guarded and not (said and set(found) <= set(whole)) and bag.protected == 'all':
            self.silent.append(what)
        if not guarded and not said and bag.protected != 'none':
            self.unsaid += 1

    def outcome(self, name: str, patience: float) -> Outcome:
        """Return the tally as one row."""
        first = [*self.crashed, *self.silent][:1]
        text = (
            f'{self.files} {name}: {len(self.crashed)} crashes, {len(self.silent)} silent changes, '
            f'{self.unsaid} not called unprotected, slowest {self.slowest:.2f} s'
        )
        held = not self.crashed and not self.silent and not self.unsaid
        return Outcome('; '.join([text, *first]), held and self.slowest < patience)


def _recording(path: Path, shape: str, messages: list[Message]) -> list[object]:
    write_mcap(path, messages, chunk_size=900, **SHAPES[shape])
    return list(expected(messages))


def cuts(folder: Path, step: int = 1, patience: float = inf) -> Outcome:
    """Cut small recordings after every `step`-th byte."""
    tally = Tally()
    for shape in ('zstd', 'uncompressed', 'no chunks'):
        path = folder / 'cut.mcap'
        whole = _recording(path, shape, run(6))
        data = path.read_bytes()
        for size in range(0, len(data), step):
            path.write_bytes(data[:size])
            tally.take(path, whole, f'{shape} cut at {size}', guarded=True)
    return tally.outcome('cuts', patience)


def flips(folder: Path, count: int, seed: int = 0, patience: float = inf) -> Outcome:
    """Flip one bit, `count` times, over recordings with and without checksums."""
    rng, tally = Random(seed), Tally()
    shapes = ('zstd', 'lz4', 'uncompressed', 'no checksums')
    for shape in shapes:
        path = folder / 'flip.mcap'
        whole = _recording(path, shape, run(12))
        data = path.read_bytes()
        for _ in range(count // len(shapes)):
            bit = rng.randrange(8 * len(data))
            broken = bytearray(data)
            broken[bit // 8] ^= 1 << bit % 8
            path.write_bytes(broken)
            what = f'{shape} bit {bit}'
            tally.take(path, whole, what, guarded=shape != 'no checksums')
    return tally.outcome('bit flips', patience)


def hostile(folder: Path, count: int, seed: int = 0, patience: float = inf) -> Outcome:
    """Write odd lengths and offsets over those of records; point indexes at each other."""
    rng, tally = Random(seed), Tally()
    path = folder / 'hostile.mcap'
    whole = _recording(path, 'uncompressed', run(12))
    data = path.read_bytes()
    places = list(_numbers(data))
    values = [0, 1, 8, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1, len(data), *chunk_starts(data)]
    for _ in range(count):
        broken = bytearray(data)
        for at in rng.sample(places, 1 + rng.randrange(3)):
            broken[at : at + 8] = struct.pack('<Q', rng.choice(values))
        path.write_bytes(_resealed(broken))
        tally.take(path, whole, f'hostile {_}', guarded=False)
    tally.unsaid = 0  # lengths and offsets are not what a chunk's checksum covers
    return tally.outcome('wrong lengths and looping indexes', patience)


def _numbers(data: bytes) -> Iterator[int]:
    """Yield where the length of each record lies, and offsets in ChunkIndex and Footer records."""
    pos = 8
    while pos < len(data) - 8:
        opcode, length = struct.unpack_from('<BQ', data, pos)
        yield pos + 1
        if opcode == 8:  # ChunkIndex: times, offset, length
            yield from (pos + 9 + 16, pos + 9 + 24)
        if opcode == 2:
            yield from (pos + 9, pos + 17)
        pos += 9 + length


def _resealed(data: bytearray) -> bytes:
    """Return the file with a right checksum over its changed summary, as an attacker would."""
    (start,) = struct.unpack_from('<Q', data, len(data) - 28)
    if start < len(data) - 37:
        crc = zlib.crc32(data[start : len(data) - 12])
        struct.pack_into('<I', data, len(data) - 12, crc)
    return bytes(data)


def bombs(folder: Path, size: int = GIB, patience: float = inf) -> Outcome:
    """Chunks and files of a few kB that unpack to `size` bytes of zeros, said or not said."""
    made: list[tuple[str, Callable[[Path, int], Path]]] = [
        ('chunk that says so', _honest),
        ('chunk that claims 1 kB', _liar),
        ('whole file', _whole),
    ]
    texts, held = [], True
    for name, make in made:
        path = make(folder, size)
        before, start = memory(), time.perf_counter()
        try:
            bag = open_bag(path)
            got = len(rows(bag.batches(BOTH)))
            said = bool(bag.findings or bag.salvaged)
        except BadBag:
            got, said = 0, True
        grown, took = memory() - before, time.perf_counter() - start
        held = held and said and got == 0 and grown < 80 and took < patience
        told = 'refused' if said else 'NOT SAID'
        texts.append(f'{name} ({path.stat().st_size} bytes): {told}, {grown:+.0f} MB, {took:.2f} s')
    return Outcome('; '.join(texts), held)


def _zeros(size: int) -> bytes:
    packer = zstandard.ZstdCompressor().compressobj()
    block = bytes(1 << 20)
    return b''.join([*(packer.compress(block) for _ in range(size >> 20)), packer.flush()])


def _chunk(folder: Path, claimed: int, packed: bytes) -> Path:
    """Write an MCAP of one zstd chunk that claims to unpack to `claimed` bytes."""
    content = struct.pack('<QQQII', 1, 2, claimed, 0, 4) + b'zstd'
    content += struct.pack('<Q', len(packed)) + packed
    path = folder / 'bomb.mcap'
    magic = b'\x89MCAP0\r\n'
    header = struct.pack('<BQII', 1, 8, 0, 0)
    path.write_bytes(magic + header + struct.pack('<BQ', 6, len(content)) + content)
    return path


def _honest(folder: Path, size: int) -> Path:
    return _chunk(folder, size, _zeros(size))


def _liar(folder: Path, size: int) -> Path:
    return _chunk(folder, 1024, _zeros(size))


def _whole(folder: Path, size: int) -> Path:
    """Write a sound recording with zeros behind it, packed as `ros2 bag` packs files."""
    whole = write_mcap(folder / 'whole.mcap', run(3), compression=CompressionType.NONE)
    packer = zstandard.ZstdCompressor().compressobj()
    parts = [packer.compress(whole.read_bytes())]
    parts += [packer.compress(bytes(1 << 20)) for _ in range(size >> 20)]
    path = folder / 'bomb.mcap.zstd'
    path.write_bytes(b''.join([*parts, packer.flush()]))
    return path


def conformance(folder: Path, patience: float = inf) -> Outcome:
    """Open and read the conformance files of the format."""
    paths = sorted(folder.glob('*.mcap'))
    slowest, crashed = 0.0, []
    for path in paths:
        start = time.perf_counter()
        try:
            list(open_bag(path).batches(BOTH))
        except BadBag:
            pass
        except Exception as error:  # noqa: BLE001 (any other exception is what is looked for)
            crashed.append(f'{path.name}: {error!r}')
        slowest = max(slowest, time.perf_counter() - start)
    text = f'{len(paths)} conformance files: {len(crashed)} crashes, slowest {slowest:.2f} s'
    return Outcome('; '.join([text, *crashed[:1]]), not crashed and slowest < patience)
