"""The acceptance report: a result as one self-contained HTML page a person can sign."""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from ugv_acceptance import AcceptanceError, pip_install
from ugv_acceptance.evaluation.alerts.messages import level_words
from ugv_acceptance.evaluation.downsampling import Strips
from ugv_acceptance.evaluation.margin_words import share_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.report.error_rate import error_rate_line
from ugv_acceptance.report.format import (
    assumed_line,
    bound_text,
    doubts_of,
    ground_line,
    interval_text,
    limit_text,
    load_text,
    missing_text,
    not_checked_lines,
    number_text,
    origin_line,
    range_text,
    seconds_text,
    worst_text,
)
from ugv_acceptance.report.regions import svg_of
from ugv_acceptance.report.run_charts import gravity_of, positions_of, run_chart, track_map
from ugv_acceptance.report.side_view import Standing, side_view
from ugv_acceptance.report.training import training_line, training_rows
from ugv_acceptance.type_aliases import Json


def pdf_of(html: str) -> bytes:
    """Return the page as a PDF file's bytes. Raises AcceptanceError where WeasyPrint is absent."""
    try:
        import weasyprint  # noqa: PLC0415 - an extra
    except (ImportError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise AcceptanceError(
            f'no PDF: expected WeasyPrint ({pip_install("pdf")}) and Pango '
            f'(apt install libpango-1.0-0 libpangoft2-1.0-0), got: {reason}'
        ) from None
    logging.getLogger('weasyprint').setLevel(logging.ERROR)
    document: bytes = weasyprint.HTML(string=html, url_fetcher=_nothing).write_pdf()
    return document


def _nothing(url: str, *_: Any, **__: Any) -> Any:  # noqa: ANN401 - WeasyPrint's protocol
    raise ValueError(f'a report refers to nothing outside itself, got {url}')


# Seconds shown before and after an event, and charts of events at most.
AROUND = 5.0
MOST_EVENTS = 8
MOST_ALERTS = 60
# Alerts named below one chart.
MOST_TITLES = 12
# Signals whose worst moment is drawn in an event.
MOMENTS = {
    'tip': ('tip_angle',),
    'torque': ('torque_utilisation', 'torque', 'torque_margin'),
}
MARKS = {'PASS': '✓', 'FAIL': '✗', 'INCONCLUSIVE': '?'}
CLOSING = {
    'PASS': 'This run met these criteria.',
    'FAIL': 'This run did not meet these criteria.',
    'INCONCLUSIVE': (
        'This run did not meet these criteria: the data are not sufficient to decide.'
    ),
}


@dataclass(frozen=True, slots=True)
class Picture:
    """An SVG with its caption; `below` are more of what it shows."""

    svg: str
    caption: str
    below: 'tuple[Picture, ...]' = ()


def acceptance_page(
    result: Json, strips: Strips, settings: Settings, parts: Mapping[str, str]
) -> str:
    """Return the report's HTML. `parts` maps keys of an identity to their labels."""
    environment = Environment(
        loader=PackageLoader('ugv_acceptance.report'), autoescape=True, undefined=StrictUndefined
    )
    environment.filters.update(
        training=training_line,
        drilled=training_rows,
        number=number_text,
        seconds=seconds_text,
        level=level_words,
        worst=worst_text,
        limit=limit_text,
        bound=bound_text,
        interval=interval_text,
        range=range_text,
        missing=missing_text,
        share=lambda share: share_words(share, 1),
    )
    return environment.get_template('acceptance.html').render(
        result=result,
        marks=MARKS,
        doubts=doubts_of(result),
        unchecked=not_checked_lines(result),
        error_rate=error_rate_line(),
        closing=CLOSING[result['verdict']],
        first_lines=[
            line for of in (origin_line, assumed_line, ground_line) if (line := of(result))
        ],
        identity=[(words, _entered(result, key)) for key, words in parts.items()],
        inputs=[(key, result['inputs'][key]) for key in ('joint_states', 'imu')],
        alerts=result['alerts'][:MOST_ALERTS],
        more_alerts=max(0, len(result['alerts']) - MOST_ALERTS),
        overview=_overview(result, strips, settings),
        events=_events(result, strips, settings),
        map=_map(result, strips, settings),
    )


def _entered(result: Json, key: str) -> str | None:
    """Return an entry of the identity; that of the payload with what the run says of it."""
    entered: str | None = result['identity'].get(key)
    if key != 'payload':
        return entered
    return f'{entered}, as entered; {load_text(result)}' if entered else load_text(result)


def _overview(result: Json, strips: Strips, settings: Settings) -> Picture | None:
    made = run_chart(strips, result, settings)
    caption = (
        'The whole run; each point is the worst value of a short interval. Solid line: '
        'DANGER begins; dotted line: CAUTION begins; dotted grey: no input. Bars are alerts: plain '
        'CAUTION, hatched DANGER, dotted NO DATA; a triangle is when the worst value came.'
    )
    return Picture(svg_of(made, 'run'), caption) if made else None


def _map(result: Json, strips: Strips, settings: Settings) -> Picture | None:
    made = track_map(strips, result, settings)
    caption = (
        "The run's track (blue, from the dot) over the map. Attitude, payload and the other joints "
        'are those of the moment when the tilt left first passed its limit (if it never did, when '
        'it was least); at other times the areas were different.'
    )
    return Picture(svg_of(made, 'map'), caption) if made else None


def _events(result: Json, strips: Strips, settings: Settings) -> list[Picture]:
    pictures = []
    for k, (title, start, end) in enumerate(_spans(result)[:MOST_EVENTS]):
        made = run_chart(strips, result, settings, (start, end))
        if made is not None:
            views = tuple(_views(result, settings, (start, end), f'event{k}'))
            pictures.append(Picture(svg_of(made, f'event{k}'), title, views))
    return pictures


def _views(
    result: Json, settings: Settings, span: tuple[float, float], name: str
) -> Iterator[Picture]:
    """Yield the robot at the worst moment of tip-over and of torque, if they are in a span (s)."""
    for what, signals in MOMENTS.items():
        found = [
            (c['measured']['distance'] or 0.0, c['name'], c['measured'])
            for c in result['criteria']['results']
            if c['measured'].get('signal') in signals
            and c['measured']['moment'] is not None
            and span[0] <= c['measured']['at_s'] <= span[1]
        ]
        if found:
            _, criterion, measured = min(found, key=lambda one: one[:2])
            moment = measured['moment']
            load = Payload(moment['payload_kg'], tuple(moment['payload_cog_m']))
            q = tuple(positions_of(moment, settings).tolist())
            at = Standing(q, gravity_of(moment, settings.robot.gravity), load)
            words = f'{measured["at_s"]:.2f} s, the worst moment of {criterion}: '
            legend = 'blue: what it stands on; dashed: plumb line; triangle: nearest edge'
            yield Picture(side_view(at, settings, f'{name}-{what}'), words + legend)


def _spans(result: Json) -> list[tuple[str, float, float]]:
    """Return the times (s) to show in detail: alerts above WARN, joined where they overlap."""
    duration = result['coverage']['duration_s']
    spans: list[tuple[list[str], float, float]] = []
    for alert in result['alerts']:
        if alert['level'] == 'WARN':
            continue
        end = duration if alert['end_s'] is None else alert['end_s']
        start, end = max(0.0, alert['start_s'] - AROUND), min(duration, end + AROUND)
        title = f'{alert["start_s"]:.2f} s: {level_words(alert["level"])}, {alert["message"]}'
        if spans and start < spans[-1][2]:
            titles, begin, before = spans[-1]
            titles.append(title)
            spans[-1] = (titles, begin, max(before, end))
        else:
            spans.append(([title], start, end))
    return [(_caption(titles), start, end) for titles, start, end in spans]


def _caption(titles: list[str]) -> str:
    """Return the titles of alerts as one text, at most MOST_TITLES of them."""
    more = len(titles) - MOST_TITLES
    return '; '.join([*titles[:MOST_TITLES], *([f'and {more} more alerts'] if more > 0 else [])])
