"""Draws maps that can be read without colour: hatched, dotted and plain areas."""

import io
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ugv_acceptance.studies.maps import Levels
from ugv_acceptance.type_aliases import Floats

# Colours that stay apart in grey and for colour-blind readers; the hatch says it without them.
COLOURS = ('#ffffff', '#fff0c2', '#e7a9a0')
HATCHES = ('', '..', '////')
WORDS = ('safe', 'caution', 'failure')

STYLE: Any = {
    'svg.hashsalt': 'ugv_acceptance',
    'svg.fonttype': 'path',
    'font.size': 9.0,
    'axes.titlesize': 9.0,
    'axes.linewidth': 0.8,
    'hatch.linewidth': 0.5,
    'hatch.color': '#666666',
    'legend.frameon': True,
    'legend.framealpha': 1.0,
}


def figure(width: float, height: float) -> Figure:
    """Return an empty figure (width and height in inches) that needs no display."""
    with mpl.rc_context(STYLE):
        made = Figure(figsize=(width, height), layout='constrained')
        FigureCanvasAgg(made)
    return made


def draw_regions(
    axes: Axes,
    x: Floats,
    y: Floats,
    margin: Floats,
    levels: Levels,
    label: Callable[[float], str] | None = None,
) -> None:
    """Fill the areas of a `margin` (n, m) over x (n,), y (m,) by level, and draw their borders.

    `label` writes a level on its line; without it the lines stay bare.
    """
    filled = np.nan_to_num(np.clip(margin, -1e6, 1e6), nan=-1e6).T
    # Where nothing lies between both levels, such as where nothing is carried: two areas.
    every = 2 if levels.failure == levels.caution else 1
    bounds = [-2e6, *(levels.failure, levels.caution)[::every], 2e6]
    colours, hatches = COLOURS[::-every], HATCHES[::-every]
    axes.contourf(x, y, filled, levels=bounds, colors=colours, hatches=hatches)
    looks = ((levels.caution, '#333333', 0.9, ':'), (levels.failure, 'black', 1.6, '-'))
    for level, colour, width, dash in looks:
        if filled.min() < level < filled.max():
            lines = axes.contour(
                x, y, filled, levels=[level], colors=colour, linewidths=width, linestyles=dash
            )
            if label is not None:
                for text in axes.clabel(lines, fmt=label, fontsize=8, colors='black'):
                    text.set_bbox({'facecolor': 'white', 'edgecolor': 'none', 'pad': 0.8})


def legend(
    target: Figure | Axes,
    words: Sequence[str] = WORDS,
    more: Sequence[Artist] = (),
    **options: Any,  # noqa: ANN401 - matplotlib's own
) -> None:
    """Add a legend of the three areas, and of `more`, to a figure or to axes."""
    patches = [
        Patch(facecolor=colour, hatch=hatch, edgecolor='#666666', label=word)
        for colour, hatch, word in zip(COLOURS, HATCHES, words, strict=True)
    ]
    target.legend(handles=[*patches, *more], **options)


def degree_axes(axes: Axes, x_name: str, y_name: str, step: float = 90.0) -> None:
    """Label both axes in degrees with ticks every `step`."""
    for axis, name in ((axes.xaxis, x_name), (axes.yaxis, y_name)):
        axis.set_major_locator(mpl.ticker.MultipleLocator(step))
        axis.set_major_formatter('{x:.0f}°')
        axis.set_label_text(name)


def svg_of(made: Figure, name: str = 'map') -> str:
    """Return the figure as an <svg> element; the same figure and name give the same text.

    The name is in the ids of its clip paths and hatches, so that several fit on one page.
    """
    target = io.StringIO()
    style: Any = {**STYLE, 'svg.hashsalt': f'ugv_acceptance {name}'}
    with mpl.rc_context(style):
        made.savefig(target, format='svg', metadata={'Date': None})
    text = target.getvalue()
    # Groups are numbered from 1 in every figure.
    text = text.replace('id="', f'id="{name}-').replace('url(#', f'url(#{name}-')
    text = text.replace('xlink:href="#', f'xlink:href="#{name}-')
    return text[text.index('<svg') :]


def png_of(made: Figure, dpi: int = 150) -> bytes:
    """Return the figure as a PNG file's bytes."""
    target = io.BytesIO()
    with mpl.rc_context(STYLE):
        made.savefig(target, format='png', dpi=dpi, metadata={'Software': 'ugv_acceptance'})
    return target.getvalue()
