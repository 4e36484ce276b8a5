"""Results as JUnit XML for `colcon test-result`: a suite per recording, a case per criterion."""

import re
from collections.abc import Sequence
from typing import Any

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from ugv_acceptance.report.format import worst_text
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
    # Safeguards and what criteria require of the operator are no cases: they must not look green.
    if result['verdict'] not in {
        'PASS',
        *(one['verdict'] for one in result['criteria']['results']),
    }:
        suite.add_testcase(_verdict(result, suite.name))
    return suite


def _verdict(result: Json, suite: str) -> TestCase:
    """Return a case that carries a verdict which none of the criteria has."""
    case = TestCase('verdict', suite)
    kind = Failure if result['verdict'] == 'FAIL' else Error
    case.result = [kind(_clean('; '.join(result['reasons'])), result['verdict'])]
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
