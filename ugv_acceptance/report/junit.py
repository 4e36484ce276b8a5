"""Results as JUnit XML for `colcon test-result`: a suite per recording, a case per criterion."""

import re
from collections.abc import Sequence
from typing import Any

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from ugv_acceptance.report.format import worst_text
from ugv_acceptance.report.training import training_lines
from ugv_acceptance.type_aliases import Json

# Characters that XML 1.0 cannot hold, even escaped.
_FORBIDDEN = re.compile('[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]')


def junit_of(results: Sequence[Json]) -> bytes:
    """Return the XML: FAIL is a failure; INCONCLUSIVE or an unreadable recording an error."""
    document: Any = JUnitXml('ugv_acceptance')  # half of junitparser is annotated
    for result in results:
        document.add_testsuite(_suite(result))
    document.update_statistics()
    return bytes(document.tostring())


def _suite(result: Json) -> TestSuite:
    suite = TestSuite(_clean(str(result['bag']['path'][0])))
    if 'criteria' not in result:
        case = TestCase('recording', suite.name)
        case.result = [Error(_clean('; '.join(result['reasons'])), 'BAD INPUT')]
        suite.add_testcase(case)
        return suite
    suite.add_property('bag_sha256', result['bag']['sha256'])
    suite.add_property('criteria_sha256', result['criteria']['sha256'])
    suite.add_property('robot_sha256', result['robot']['sha256'])
    for outcome in result['criteria']['results']:
        suite.add_testcase(_case(outcome, suite.name))
    training = result.get('operator_training')
    if training is not None and training['required'] is not None:
        suite.add_testcase(_trained(result, suite.name))
    return suite


def _trained(result: Json, suite: str) -> TestCase:
    """Return the case of criteria that require a trained operator: an error where none is shown."""
    case = TestCase('operator training', suite)
    lines = _clean('\n'.join(training_lines(result)))
    if not result['operator_training']['met']:
        case.result = [Error(lines, 'INCONCLUSIVE')]
    case.system_out = lines
    return case


def _case(outcome: Json, suite: str) -> TestCase:
    case = TestCase(_clean(outcome['name']), suite)
    reason = _clean(outcome['reason'])
    if outcome['verdict'] == 'FAIL':
        case.result = [Failure(reason, 'FAIL')]
    elif outcome['verdict'] != 'PASS':
        case.result = [Error(reason, outcome['verdict'])]
    measured = f'measured: {worst_text(outcome["measured"])}'
    lines = dict.fromkeys([outcome['demand'], measured, outcome['reason'], *outcome['evidence']])
    case.system_out = _clean('\n'.join(lines))
    return case


def _clean(text: str) -> str:
    return _FORBIDDEN.sub('\N{REPLACEMENT CHARACTER}', text)
