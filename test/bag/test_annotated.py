"""A copy of any MCAP has all its messages, its channels and their types, whatever its summary."""

from pathlib import Path
from typing import Any

import pytest
from bag.bag_cases import run, write_mcap
from bag.recordings import SHAPES, chunk_starts
from mcap.reader import make_reader

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.annotated import write_annotated
from ugv_acceptance.bag.blocks import block_of
from ugv_acceptance.bag.reader import open_bag

WRITTEN = run(60)


def copied(path: Path) -> list[tuple[str, str, int, bytes]]:
    """Return topic, type, log time and content of every message, as the mcap package reads it."""
    with path.open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        return [
            (channel.topic, schema.name if schema else '', message.log_time, message.data)
            for schema, channel, message in reader.iter_messages()
        ]


@pytest.mark.parametrize('shape', SHAPES)
def test_every_shape_of_mcap_is_copied_whole(tmp_path: Path, shape: str) -> None:
    """An annotated copy has every message of the MCAP, also if its summary lists no channels."""
    path = write_mcap(tmp_path / 'in.mcap', WRITTEN, **SHAPES[shape])
    assert write_annotated(tmp_path / 'out.mcap', open_bag(path), {}, []) == len(WRITTEN)
    assert copied(tmp_path / 'out.mcap') == list(WRITTEN)


def test_a_file_cut_off_is_copied_up_to_there(tmp_path: Path) -> None:
    """Of a truncated MCAP the copy holds all that the reader salvages, and is complete itself."""
    path = write_mcap(tmp_path / 'in.mcap', WRITTEN)
    data = path.read_bytes()
    path.write_bytes(data[: chunk_starts(data)[2] + 100])
    count = write_annotated(tmp_path / 'out.mcap', open_bag(path), {}, [])
    assert 0 < count < len(WRITTEN)
    assert copied(tmp_path / 'out.mcap') == WRITTEN[:count]


def test_no_half_file_is_left(tmp_path: Path) -> None:
    """If the annotation fails, neither the copy nor a part of it remains."""
    path = write_mcap(tmp_path / 'in.mcap', WRITTEN)

    def fault() -> Any:
        yield block_of([(WRITTEN[0][2], WRITTEN[0][2], 0, b'\0\1\0\0')])
        raise ValueError('no more')

    with pytest.raises(ValueError, match='no more'):
        write_annotated(
            tmp_path / 'out.mcap', open_bag(path), {'/said': 'std_msgs/msg/Empty'}, fault()
        )
    assert [p.name for p in tmp_path.iterdir()] == ['in.mcap']


def test_what_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    """A copy that cannot be written gives one error that names the place, and leaves nothing."""
    path = write_mcap(tmp_path / 'in.mcap', WRITTEN)
    (tmp_path / 'out.mcap' / 'full').mkdir(parents=True)
    with pytest.raises(AcceptanceError, match=r'out\.mcap: cannot be written'):
        write_annotated(tmp_path / 'out.mcap', open_bag(path), {}, [])
    assert sorted(p.name for p in tmp_path.iterdir()) == ['in.mcap', 'out.mcap']
