"""The page that computes the paper again: its numbers, its pictures, and that it stands alone."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import typer
from robots import paper_arm
from typer.testing import CliRunner

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.output_kinds import PAPER
from ugv_acceptance.cli.paper import paper
from ugv_acceptance.report.paper.arm_figures import disagreement, paper_grid, safe_fractions
from ugv_acceptance.report.paper.numbers import summary, table_1_rows, table_2_rows
from ugv_acceptance.report.paper.sections import Subject, rollover

app = typer.Typer()
app.command('paper')(paper)


@pytest.fixture(scope='module')
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Run the verb once; return its folder and what it printed."""
    out = tmp_path_factory.mktemp('paper')
    result = CliRunner(env={'COLUMNS': '200', 'TERM': 'dumb'}).invoke(app, ['--out', str(out)])
    assert result.exit_code == 0, result.output
    return out, result.output


def test_the_document_has_what_its_readers_expect(written: tuple[Path, str]) -> None:
    """Keys and values of paper.json that other programs rely on."""
    document = json.loads((written[0] / 'paper.json').read_text(encoding='utf-8'))
    assert document['table_1'] == {'matches': 7, 'of': 7}
    assert (document['table_2']['matches'], document['table_2']['of']) == (16, 16)
    assert len(document['table_2']['rows']) == 8
    assert document['critical_value'] == {
        'paper': 1.227,
        'computed': pytest.approx(1.2626, abs=5e-5),
    }
    assert document['speed_limit_deg_s'] == pytest.approx(36.74, abs=0.01)
    assert all((written[0] / name).is_file() for name in document['figures'])


def test_the_table_of_matches_is_printed(written: tuple[Path, str]) -> None:
    """Each place of the paper with its count, and every difference with its reason."""
    assert re.search(r'Table 1 +7 of +7 match', written[1])
    assert re.search(r'Table 2 +16 of 16 match', written[1])
    assert 'paper 1.227, ours 1.2626' in written[1]


def test_the_page_needs_nothing_else(written: tuple[Path, str]) -> None:
    """No script, style or picture is fetched from anywhere."""
    text = (written[0] / 'paper.html').read_text(encoding='utf-8')
    links = re.findall(r'(?:src|href)="([^"#][^"]*)"', text)
    assert links == []
    assert '<script' not in text
    assert text.count('<svg') == 7


def test_ids_on_the_page_are_unique(written: tuple[Path, str]) -> None:
    """Several pictures on one page do not use each other's clip paths."""
    text = (written[0] / 'paper.html').read_text(encoding='utf-8')
    ids = re.findall(r' id="([^"]+)"', text)
    used = {*re.findall(r'url\(#([^)]+)\)', text), *re.findall(r'href="#([^"]+)"', text)}
    assert len(ids) == len(set(ids))
    assert used <= set(ids)


def test_pictures_are_the_same_every_time(written: tuple[Path, str], tmp_path: Path) -> None:
    """Two runs write the same bytes."""
    CliRunner().invoke(app, ['--out', str(tmp_path)])
    for file in written[0].iterdir():
        assert (tmp_path / file.name).read_bytes() == file.read_bytes(), file.name


def test_pictures_are_well_formed(written: tuple[Path, str]) -> None:
    """Every SVG is XML and draws something."""
    for file in written[0].glob('*.svg'):
        assert len(list(ET.parse(file).getroot().iter())) > 50  # noqa: S314 - written by us


def test_the_folder_is_known_again(written: tuple[Path, str], tmp_path: Path) -> None:
    """So the same command may be given twice; another folder is not taken for one."""
    assert PAPER.ours(written[0])
    (tmp_path / 'paper.json').write_text('{"title": "mine"}')
    assert not PAPER.ours(tmp_path)


def test_mujoco_gives_table_2_as_well(written: tuple[Path, str]) -> None:
    """The multi-body simulation's torques, not the closed form's, on the page."""
    text = (written[0] / 'paper.html').read_text(encoding='utf-8')
    table = text[text.index('F from MuJoCo') :]
    cells = [float(x) for x in re.findall(r'<td>([\d.]+)</td>', table[: table.index('</table>')])]
    assert cells == [1.0, 1.0, 1.0, 1.2, 5.1, 22.0, 67.6, 163.9, *[1.0] * 8]


def test_full_reach_tips_on_level_ground(written: tuple[Path, str]) -> None:
    """The paper's arm with 4 kg, stowed flippers: the page shows that the robot tips."""
    document = json.loads((written[0] / 'paper.json').read_text(encoding='utf-8'))
    left = document['level_full_reach_tilt_left_deg']
    assert left['stowed'] < -10.0
    assert left['forward'] > 40.0
    assert f'{left["stowed"]:.1f}° of tilt left' in (written[0] / 'paper.html').read_text('utf-8')


def test_every_row_of_both_tables_matches() -> None:
    """All seven rows of Table 1 and all sixteen cells of Table 2 match the paper."""
    found = summary([*table_1_rows(), *table_2_rows()])
    assert found == {'Table 1': {'matches': 7, 'of': 7}, 'Table 2': {'matches': 16, 'of': 16}}


def test_curve_and_grid_agree() -> None:
    """Figure 5: the closed form and the map judge every cell alike; the areas agree to a cell."""
    grid = paper_grid(201)
    assert set(disagreement(grid).values()) == {0}
    for exact, counted in safe_fractions(grid).values():
        assert counted == pytest.approx(exact, abs=2.0 / 201)


def test_a_robot_without_flippers_is_refused() -> None:
    """The error names the joint that is missing."""
    with pytest.raises(BadConfig, match='without shoulder_joint'):
        rollover(Subject(paper_arm(), np.array([50.0, 50.0])))
