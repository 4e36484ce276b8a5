"""The result of evaluating a recording: verdict, reasons, criteria, alerts, margins."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Literal, Protocol

import numpy as np

from ugv_acceptance import AcceptanceError, pip_install
from ugv_acceptance.bag.atomic_files import json_text
from ugv_acceptance.bag.reader import Topics
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.criteria.measurement import CriteriaMeasurement
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.summary import AlertRecord
from ugv_acceptance.offline.margins import (
    Column,
    MarginColumns,
    arrow_table,
    margin_columns,
    margin_rows,
    named_columns,
)
from ugv_acceptance.type_aliases import Json

Verdict = Literal['PASS', 'FAIL', 'INCONCLUSIVE']


class Table(Protocol):
    """A table of margins: what Arrow tables and pandas DataFrames have in common."""

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""

    def __getitem__(self, name: str, /) -> object:
        """Return the column of that name."""


@dataclass(frozen=True, slots=True)
class CriterionOutcome:
    """The outcome of one criterion: its demand in words, verdict, reason and evidence."""

    name: str
    demand: str
    verdict: Verdict
    reason: str
    evidence: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Judgement:
    """The objects an evaluation was made from, for further work on the same recording."""

    settings: Settings
    topics: Topics
    evaluator: RecordedEvaluator
    facts: Facts
    measurement: CriteriaMeasurement


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The result of evaluating a recording: verdict, reasons, criteria, alerts and margins.

    `result` is the whole result as plain values. `margins` are computed when first asked for: the
    recording is then read once more.
    """

    recording: Recording
    config: Config
    result: Json = field(repr=False)
    judgement: Judgement = field(repr=False)

    @property
    def verdict(self) -> Verdict:
        """PASS, FAIL or INCONCLUSIVE. Missing data never passes."""
        verdict: Verdict = self.result['verdict']
        return verdict

    @property
    def reasons(self) -> tuple[str, ...]:
        """The reasons for the verdict, as sentences, the most important first."""
        return tuple(self.result['reasons'])

    @property
    def coverage(self) -> float:
        """The share of the recording, 0 to 1, in which all margins were known."""
        return float(self.result['coverage']['fraction'])

    @property
    def criteria(self) -> tuple[CriterionOutcome, ...]:
        """The outcome of every criterion, in the order of the criteria."""
        return tuple(
            CriterionOutcome(
                c['name'], c['demand'], c['verdict'], c['reason'], tuple(c['evidence'])
            )
            for c in self.result['criteria']['results']
        )

    @property
    def alerts(self) -> tuple[AlertRecord, ...]:
        """All alerts, in the order in which they were raised."""
        names = [f.name for f in fields(AlertRecord)]
        return tuple(AlertRecord(**{n: a[n] for n in names}) for a in self.result['alerts'])

    @cached_property
    def margins(self) -> MarginColumns:
        """The margins over time as NumPy columns; the recording is read once more."""
        found = self.judgement
        return margin_columns(self.recording.bag, found.topics, found.settings)

    def to_dict(self) -> Mapping[str, object]:
        """Return the result as plain values, laid out as schema/result.schema.json says."""
        return self.result

    def to_json(self) -> str:
        """Return the result as JSON text, laid out as schema/result.schema.json says."""
        return json_text(self.result)

    def table(self, library: Literal['arrow', 'pandas'] | None = None) -> Table:
        """Return the margins as a table with the columns of --csv and --parquet.

        An Arrow table if PyArrow is installed, else a pandas DataFrame. Unknown margins are nulls
        (NaN in pandas). Raises AcceptanceError if the library is not installed.
        """
        columns = self._columns()
        for name in [library] if library else _MAKERS:
            with suppress(ImportError):
                return _MAKERS[name](columns)
        needed = library or 'arrow or pandas'
        advice = 'pip install pandas' if library == 'pandas' else pip_install('table')
        raise AcceptanceError(f'table: expected {needed} ({advice}), it is not installed')

    def _columns(self) -> dict[str, Column]:
        found, start = self.judgement, self.recording.start_ns
        rows = margin_rows(self.recording.bag, found.topics, found.settings, detail=True)
        parts = [named_columns(part, found.settings, start) for part in rows]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _arrow_table(columns: Mapping[str, Column]) -> Table:
    import pyarrow as pa  # noqa: PLC0415 - an extra

    table: Table = arrow_table(pa, columns)
    return table


def _pandas_table(columns: Mapping[str, Column]) -> Table:
    import pandas as pd  # noqa: PLC0415 - an extra

    table: Table = pd.DataFrame(dict(columns))
    return table


_MAKERS = {'arrow': _arrow_table, 'pandas': _pandas_table}
