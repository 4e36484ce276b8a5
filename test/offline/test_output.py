"""Tables of a recording: of one without margins too, and what is wrong with their place."""

from pathlib import Path

import pytest
from bag.bag_cases import IMU, JOINT_STATE, cdr, joint_state

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.atomic_files import check_writable
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.recording import Recording, open_recording
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import load
from ugv_acceptance.offline.judge import Options, judge
from ugv_acceptance.offline.output import CsvSink, ParquetSink

SETTINGS = load().settings
REPOSITORY = Path(__file__).parents[2]


def judged(source: Path, sink: CsvSink | ParquetSink) -> None:
    """Judge a recording into a sink."""
    recording = open_recording(source)
    with sink:
        options = Options(tuple(sink.sinks), detail=True)
        judge(recording, SETTINGS, options=options)


def without_imu(folder: Path) -> Path:
    """Write a recording of which no margin is known."""
    with BagWriter(folder / 'in') as writer:
        writer.add_topic('/joint_states', JOINT_STATE, Qos())
        writer.add_topic('/imu/data', IMU, Qos())
        writer.write('/joint_states', 10**9, cdr(joint_state()))
    return folder / 'in'


def test_a_table_without_a_row_is_a_table(tmp_path: Path) -> None:
    """A recording without margins gives tables with columns; an older file does not stay."""
    parquet = pytest.importorskip('pyarrow.parquet', reason='extra table is not installed')
    source, table, text = without_imu(tmp_path), tmp_path / 'out.parquet', tmp_path / 'out.csv'
    for path in (table, text):
        path.write_text('old')
    judged(source, ParquetSink(table, SETTINGS, 0))
    judged(source, CsvSink(text, SETTINGS, 0))
    found = parquet.read_table(table)
    assert found.num_rows == 0
    assert {'time_s', 'zmp_m'} <= set(found.column_names)
    assert len(text.read_text().splitlines()) == 1


@pytest.mark.parametrize('kind', [CsvSink, ParquetSink])
def test_a_table_that_is_not_whole_has_no_name(
    tmp_path: Path, kind: type[CsvSink | ParquetSink]
) -> None:
    """Where judging ends with an error, the file that was there before stays as it was."""
    (tmp_path / 'out').write_text('old')
    bag = open_bag(REPOSITORY / 'bags' / 'packbot_pass')
    sink = kind(tmp_path / 'out', SETTINGS, 0)

    def fault(_: object) -> None:
        raise ValueError('no more')

    with pytest.raises(ValueError, match='no more'), sink:
        judge(Recording(bag), SETTINGS, options=Options((*sink.sinks, fault), detail=True))
    assert (tmp_path / 'out').read_text() == 'old'


@pytest.mark.parametrize('kind', [CsvSink, ParquetSink])
def test_a_table_that_cannot_be_written_is_one_error(
    tmp_path: Path, kind: type[CsvSink | ParquetSink]
) -> None:
    """A table that cannot be written is one error that names its path."""
    path = tmp_path / 'gone' / 'out'
    with pytest.raises(AcceptanceError, match=r'out: cannot be written: .*No such file'):
        judged(REPOSITORY / 'bags' / 'packbot_pass', kind(path, SETTINGS, 0))


def test_a_place_is_checked_before(tmp_path: Path) -> None:
    """A folder, or a folder that is not there, is refused before anything is judged."""
    check_writable(None)
    check_writable(tmp_path / 'out')
    for path, why in (
        (tmp_path, 'expected a file, it is a folder'),
        (tmp_path / 'gone' / 'out', 'there is no folder'),
    ):
        with pytest.raises(AcceptanceError, match=why):
            check_writable(path)
