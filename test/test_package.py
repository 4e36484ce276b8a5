"""The package as pip, colcon and a reader of the repository meet it."""

import re
from pathlib import Path

from defusedxml import ElementTree

import ugv_acceptance


def test_changelog_has_the_version_on_top(repository: Path) -> None:
    """The newest entry of CHANGELOG.rst (REP-132) is the version of the code."""
    heads = re.findall(
        r'^(\S+) \(\d{4}-\d\d-\d\d\)$', (repository / 'CHANGELOG.rst').read_text(), re.MULTILINE
    )
    assert heads[0] == ugv_acceptance.__version__


def test_package_xml_has_the_version_of_the_code(repository: Path) -> None:
    """package.xml and the code name one version."""
    package = ElementTree.parse(repository / 'package.xml')
    assert package.findtext('version') == ugv_acceptance.__version__
