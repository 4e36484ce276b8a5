"""How often verdicts are wrong, as it was measured on drawn runs: docs/error_rate.md."""

import json
from importlib.resources import files

from ugv_acceptance.type_aliases import Json

# Written by `make error-rate ARGS=--write`.
FILE = 'error_rate.json'


def error_rate_line() -> str:
    """Return the measured error rate of verdicts as a sentence; it says so if there is none."""
    source = files('ugv_acceptance.report') / FILE
    if not source.is_file():
        return 'Error rate of verdicts: not measured with this installation.'
    told = json.loads(source.read_text(encoding='utf-8'))
    rates = '; '.join(map(_rate, told['rates']))
    return (
        f'Error rate of verdicts, measured on drawn runs of {told["kinds"]} kinds: {rates}. Faults '
        'of other kinds are not in it; docs/error_rate.md has the table.'
    )


def _rate(told: Json) -> str:
    most = f'95 %: at most {100.0 * told["most"]:.2f} %'
    return f'of {told["runs"]} {told["what"]} {told["wrong"]} {told["did"]} ({most})'
