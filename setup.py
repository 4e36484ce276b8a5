"""Packaging for pip and for colcon (ament_python): what is installed, and where."""

import ast
import re
import sys
from pathlib import Path
from typing import Any

from setuptools import find_packages, setup

NAME = 'ugv_acceptance'
HERE = Path(__file__).resolve().parent
SHARE = f'share/{NAME}'
TOP = (HERE / NAME / '__init__.py').read_text(encoding='utf-8')

# ROS is not among these: on a robot apt brings it, in a virtual environment the Makefile does.
REQUIRES = [
    'PyYAML',
    'defusedxml',
    'jinja2',
    'junitparser',
    'matplotlib',
    'lz4',
    'mcap',
    'numpy>=1.26,<3',
    'pydantic>=2',
    'rich',
    'rosbags',
    'scipy',
    'typer>=0.12.5',
    'zstandard',
]
TEST = [
    'catkin-pkg',
    'flask',  # with flask-cors: the S3 server of moto
    'flask-cors',
    'hypothesis',
    'jsonschema',
    'mcap-ros2-support',
    'moto[s3]',
    'pin',
    'pytest',
    'pytest-cov',
    'pytest-timeout',
    'pytest-xdist',
    'setuptools<80',
    'wheel',
]
# Extras that the tests try too.
TESTED = ('cluster', 'console', 'foxglove', 'init', 'pdf', 'sim', 'table')
DOCS = ['furo', 'myst-parser', 'sphinx']
LINT = [
    'mypy',
    'pre-commit',
    'ruff',
    'scipy-stubs',
    'types-PyYAML',
    'types-defusedxml',
    'types-jsonschema',
]


def version() -> str:
    """Return the version, which stands once in the code: in the package's __init__.py."""
    match = re.search(r"^__version__ = '([^']+)'$", TOP, re.MULTILINE)
    if match is None:
        msg = f'{NAME}/__init__.py: expected a line __version__ = "X.Y.Z", found none'
        raise SystemExit(msg)
    return match.group(1)


def extras() -> dict[str, list[str]]:
    """Return the extras by name: the table EXTRAS of the package's __init__.py, and ours."""
    (table,) = (
        node.value
        for node in ast.parse(TOP).body
        if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == 'EXTRAS' and node.value
    )
    told = {extra: list(needed) for extra, needed in ast.literal_eval(table).items()}
    tested = [name for extra in TESTED for name in told[extra]]
    return told | {'test': TEST + tested, 'lint': LINT, 'docs': DOCS}


def commands() -> dict[str, Any]:
    """Return our own `setup.py develop`, where that is what runs: by colcon --symlink-install.

    It writes the interpreter it runs on into the scripts, heedless of build_scripts in setup.cfg.
    """
    if 'develop' not in sys.argv:
        return {}
    from setuptools.command.develop import develop  # noqa: PLC0415 - not in every setuptools

    # setuptools has no types.
    class Develop(develop):  # type: ignore[misc]
        def write_script(self, name: str, contents: str, *more: Any) -> None:  # noqa: ANN401
            code = contents.partition('\n')[2]
            super().write_script(name, f'#!/usr/bin/env python3\n{code}', *more)

    return {'develop': Develop}


def share(folder: str) -> list[tuple[str, list[str]]]:
    """Return data_files that install every file below `folder`, sub-folders kept."""
    parents = sorted({path.parent for path in (HERE / folder).rglob('*') if path.is_file()})
    return [
        (
            f'{SHARE}/{parent.relative_to(HERE)}',
            [str(path.relative_to(HERE)) for path in sorted(parent.iterdir()) if path.is_file()],
        )
        for parent in parents
        if '__pycache__' not in parent.parts
    ]


setup(
    name=NAME,
    version=version(),
    description='Acceptance monitoring of unmanned ground vehicles: torque and tip-over margins',
    long_description=(HERE / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    license='Apache-2.0',
    maintainer='ugv_acceptance maintainers',
    maintainer_email='maintainers@ugv-acceptance.invalid',
    python_requires='>=3.10',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={
        NAME: ['py.typed'],
        f'{NAME}.report': ['templates/*', 'error_rate.json'],
        f'{NAME}.plan': ['templates/*'],
        f'{NAME}.console': ['static/*'],
        f'{NAME}.nodes': ['loopback.xml'],
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (SHARE, ['package.xml']),
        *share('msg_configs'),
        *share('schema'),
        *share('urdf'),
        *share('launch'),
        *share('rviz'),
        *share('layouts'),
        *share('config'),
        *share('bags'),
    ],
    install_requires=REQUIRES,
    extras_require=extras(),
    cmdclass=commands(),
    entry_points={
        'console_scripts': [
            'ugv-acceptance = ugv_acceptance.cli:main',
            'acceptance_monitor = ugv_acceptance.cli.node_programs:acceptance_monitor',
            'bag_player = ugv_acceptance.cli.node_programs:bag_player',
            'packbot_simulator = ugv_acceptance.cli.node_programs:packbot_simulator',
        ],
    },
    zip_safe=True,
)
