"""A copy of any MCAP has all its messages, its channels and their types, whatever its summary."""

from pathlib import Path
from typing import Any

import pytest
from bag.bag_cases import run, write_mcap
from bag.recordings import SHAPES, chunk_starts
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer

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


DATA = bytes(range(256)) * 10_000


def beside(path: Path) -> list[Any]:
    """Return attachments and metadata records, as the mcap package reads them by their index."""
    with path.open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        counted = summary.statistics.attachment_count, summary.statistics.metadata_count
        held = [*reader.iter_attachments()], [*reader.iter_metadata()]
        assert counted == (len(held[0]), len(held[1]))
        return [*held[0], *held[1]]


def with_extras(path: Path, name: str, *, index: bool = True) -> Path:
    """Write a recording with two attachments, one large, and two metadata records."""
    kinds = IndexType.ALL if index else IndexType.NONE
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=10_000, index_types=kinds)
        writer.start()
        writer.add_attachment(1, 2, f'{name}.urdf', 'text/xml', b'<robot/>')
        schema = writer.register_schema('std_msgs/msg/Empty', 'ros2msg', b'')
        channel = writer.register_channel('/empty', 'cdr', schema)
        for time in range(9):
            writer.add_message(channel, time, bytes(4000), time)
        writer.add_metadata('operator', {'name': name, 'Ort': 'Köln'})
        writer.add_metadata('rosbag2', {'serialized_metadata': 'message_count: 9'})
        writer.add_attachment(3, 4, 'pictures', '', DATA)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


@pytest.mark.parametrize('index', [True, False])
def test_attachments_and_metadata_are_copied(tmp_path: Path, index: bool) -> None:  # noqa: FBT001
    """Of every part, to the last byte; not what rosbag2 says of the file itself."""
    paths = [with_extras(tmp_path / f'run_{n}.mcap', f'part {n}', index=index) for n in range(2)]
    write_annotated(tmp_path / 'out.mcap', open_bag(paths), {}, [])
    found = beside(tmp_path / 'out.mcap')
    names = ['part 0.urdf', 'pictures', 'part 1.urdf', 'pictures', 'operator', 'operator']
    assert [one.name for one in found] == names
    assert [one.data for one in found[:2]] == [b'<robot/>', DATA]
    assert [(one.create_time, one.log_time) for one in found[:2]] == [(1, 2), (3, 4)]
    assert [one.metadata['name'] for one in found[4:]] == ['part 0', 'part 1']
    assert len(copied(tmp_path / 'out.mcap')) == 18


def test_an_attachment_that_breaks_off_is_left_out(tmp_path: Path) -> None:
    """A file cut off within its last attachment: the copy is whole, with what came before."""
    path = with_extras(tmp_path / 'in.mcap', 'cut')
    path.write_bytes(path.read_bytes()[: -len(DATA) // 2])
    write_annotated(tmp_path / 'out.mcap', open_bag(path), {}, [])
    assert [one.name for one in beside(tmp_path / 'out.mcap')] == ['cut.urdf', 'operator']
