"""Reads the failure log that people write beside a campaign: YAML or CSV.

Every entry names its run. Fields: run, what, class, impact, repairability, repair_h, at_s, alert,
chargeable; all but run may be left out.
"""

import csv
import io
import math
from codecs import BOM_UTF8
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import read_document
from ugv_acceptance.config.files import text as text_of
from ugv_acceptance.evaluation.alerts.failure_source import FailureSource

UNKNOWN = 'unknown'
TERMINAL, NON_TERMINAL = 'terminal', 'non-terminal'
FIELD, NOT_FIELD = 'field-repairable', 'not field-repairable'
LARGEST = 20_000_000

# Field -> its permitted words.
CHOICES = {
    'class': (*(source.value for source in FailureSource), UNKNOWN),
    'impact': (TERMINAL, NON_TERMINAL, UNKNOWN),
    'repairability': (FIELD, NOT_FIELD, UNKNOWN),
    'chargeable': ('yes', 'no'),
}
NUMBERS = ('repair_h', 'at_s')
TEXTS = ('run', 'what', 'alert')
FIELDS = (*TEXTS, *CHOICES, *NUMBERS)


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of the failure log; `where` says file and line. `at_s` in s since the run's start.

    `alert` is a code such as TIP_OVER: the entry then adds to the failure that this alert shows.
    `repair_h` is in h.
    """

    where: str
    run: str
    what: str = ''
    source: str = UNKNOWN
    impact: str = UNKNOWN
    repairability: str = UNKNOWN
    repair_h: float | None = None
    at_s: float | None = None
    alert: str | None = None
    chargeable: bool = True

    def wrong(self, field: str, text: str) -> BadConfig:
        """Return the error to raise for a field with a wrong value."""
        return BadConfig(f'{self.where}: {field}: expected {text}')

    def run_of(self, runs: Mapping[str, str]) -> str:
        """Return the name of the run this entry is about, given in full or by its last parts.

        Raises BadConfig where no run, or more than one, has that name.
        """
        wanted = _parts(self.run)
        found = sorted(
            {run for name, run in runs.items() if _parts(name)[-len(wanted) :] == wanted}
        )
        if len(found) != 1:
            much = f'{len(found)} run names end with it' if found else 'no run name ends with it'
            raise self.wrong('run', f'one run of the campaign, got {self.run!r}: {much}')
        return found[0]


def _parts(name: str) -> tuple[str, ...]:
    return PurePosixPath(name).parts


def read_log(path: Path) -> list[Entry]:
    """Return the entries of a failure log, .csv or YAML.

    Raises BadConfig with file, line and field where something is missing or wrong.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise BadConfig(f'{path}: expected a failure log below 20 MB, got a larger file')
        content = path.read_bytes().removeprefix(BOM_UTF8)
    except OSError as error:
        raise BadConfig(f'{path}: expected a failure log, got: {error.strerror}') from None
    told = text_of(content, path)
    rows = _csv_rows(told, path) if path.suffix.lower() == '.csv' else _yaml_rows(told, path)
    return [_entry(where, row) for where, row in rows]


def _csv_rows(text: str, path: Path) -> list[tuple[str, dict[str, object]]]:
    reader = csv.DictReader(io.StringIO(text, newline=''))
    rows: list[tuple[str, dict[str, object]]] = []
    try:
        for row in reader:
            if None in row:
                raise BadConfig(
                    f'{path}:{reader.line_num}: expected as many fields as the head has'
                )
            filled = {k.strip(): v.strip() for k, v in row.items() if v is not None and v.strip()}
            if filled:
                rows.append((f'{path}:{reader.line_num}', dict(filled)))
    except csv.Error as error:
        at = reader.reader.line_num  # the line read last, also one that is none
        raise BadConfig(f'{path}:{at}: expected CSV, got: {error}') from None
    return rows


def _yaml_rows(text: str, path: Path) -> list[tuple[str, dict[str, object]]]:
    document = read_document(text, str(path))
    data = document.data
    first: tuple[str, ...] = ()
    if isinstance(data, dict) and set(data) == {'failures'}:
        data, first = data['failures'], ('failures',)
    if data is None:
        return []
    if not isinstance(data, list):
        raise BadConfig(f'{path}:1: expected a list of failures, got {type(data).__name__}')
    rows = []
    for k, row in enumerate(data):
        where = document.where((*first, k)).rpartition(':')[0]
        if not isinstance(row, dict):
            raise BadConfig(f'{where}: expected fields of a failure, got {type(row).__name__}')
        rows.append((where, {str(key): value for key, value in row.items()}))
    return rows


def _entry(where: str, row: dict[str, object]) -> Entry:
    unknown = sorted(set(row) - set(FIELDS))
    if unknown:
        raise BadConfig(f'{where}: {unknown[0]}: expected one of {", ".join(FIELDS)}')
    texts = {name: str(row[name]) for name in TEXTS if row.get(name) is not None}
    if not texts.get('run', '').strip('/ '):
        raise BadConfig(f'{where}: run: expected the name of a run, got none')
    words = {name: _word(where, name, row[name]) for name in CHOICES if row.get(name) is not None}
    numbers = {
        name: _number(where, name, row[name]) for name in NUMBERS if row.get(name) is not None
    }
    return Entry(
        where,
        texts['run'],
        texts.get('what', ''),
        words.get('class', UNKNOWN),
        words.get('impact', UNKNOWN),
        words.get('repairability', UNKNOWN),
        numbers.get('repair_h'),
        numbers.get('at_s'),
        texts.get('alert'),
        words.get('chargeable', 'yes') == 'yes',
    )


def _word(where: str, field: str, value: object) -> str:
    # YAML reads yes and no as truth.
    word = {True: 'yes', False: 'no'}[value] if isinstance(value, bool) else str(value)
    if word not in CHOICES[field]:
        raise BadConfig(
            f'{where}: {field}: expected one of {", ".join(CHOICES[field])}, got {word!r}'
        )
    return word


def _number(where: str, field: str, value: object) -> float:
    try:
        number = float(str(value))
    except ValueError:
        number = math.nan
    if not 0.0 <= number < math.inf:
        raise BadConfig(f'{where}: {field}: expected a number of 0 or more, got {value!r}')
    return number
