"""Renders a self-contained HTML page of sections: text, rows, tables, pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from ugv_acceptance import __version__
from ugv_acceptance.report.paper.numbers import Row, summary
from ugv_acceptance.report.regions import svg_of


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure with its file's name and its caption."""

    name: str
    made: Figure
    caption: str


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page; the first line of each table is its head."""

    title: str
    paragraphs: Sequence[str] = ()
    rows: Sequence[Row] = ()
    tables: Sequence[Sequence[Sequence[str]]] = field(default=())
    pictures: Sequence[Picture] = ()


def render(robot: str, sections: Sequence[Section], drawn: dict[str, str]) -> str:
    """Return the page's HTML; `drawn` holds each picture's SVG by its name."""
    environment = Environment(
        loader=PackageLoader('ugv_acceptance.report'), autoescape=True, undefined=StrictUndefined
    )
    parts: list[dict[str, Any]] = [
        {
            'title': section.title,
            'paragraphs': section.paragraphs,
            'rows': section.rows,
            'tables': section.tables,
            'pictures': [{'svg': drawn[p.name], 'caption': p.caption} for p in section.pictures],
        }
        for section in sections
    ]
    rows = [row for section in sections for row in section.rows]
    template = environment.get_template('paper.html')
    return template.render(
        version=f'ugv_acceptance {__version__}', robot=robot, sections=parts, summary=summary(rows)
    )


def draw(sections: Sequence[Section]) -> dict[str, str]:
    """Return the SVG of every picture by its name, with ids that do not clash on one page."""
    drawn: dict[str, str] = {}
    for section in sections:
        for picture in section.pictures:
            drawn[picture.name] = svg_of(picture.made, picture.name)
    return drawn
