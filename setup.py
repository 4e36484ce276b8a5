"""Packaging for pip and for colcon (ament_python): what is installed, and where."""

import re
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'ugv_acceptance'
HERE = Path(__file__).resolve().parent
SHARE = f'share/{NAME}'

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
SIMULATION = ['mujoco']
CONSOLE = ['starlette', 'textual', 'uvicorn', 'websockets']
FOXGLOVE = ['foxglove-sdk']
PDF = ['weasyprint']  # over Debian's libpango-1.0-0 and libpangoft2-1.0-0
TABLE = ['pyarrow']
# Older ones of s3fs know no `endpoint_url`; pip falls back to them beside a newer botocore.
CLUSTER = ['dask', 'distributed', 'fsspec', 's3fs>=2023.1']
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
    *CLUSTER,
    *CONSOLE,
    *FOXGLOVE,
    *PDF,
    *SIMULATION,
    *TABLE,
]
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
    text = (HERE / NAME / '__init__.py').read_text(encoding='utf-8')
    match = re.search(r"^__version__ = '([^']+)'$", text, re.MULTILINE)
    if match is None:
        msg = f'{NAME}/__init__.py: expected a line __version__ = "X.Y.Z", found none'
        raise SystemExit(msg)
    return match.group(1)


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
        f'{NAME}.report': ['templates/*'],
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
    extras_require={
        'console': CONSOLE,
        'foxglove': FOXGLOVE,
        'sim': SIMULATION,
        'fast': ['isal'],
        'pdf': PDF,
        'table': TABLE,
        'cluster': CLUSTER,
        'test': TEST,
        'lint': LINT,
    },
    entry_points={
        'console_scripts': [
            'ugv-acceptance = ugv_acceptance.cli:main',
            'acceptance_monitor = ugv_acceptance.nodes.monitor:main',
            'bag_player = ugv_acceptance.nodes.player:main',
            'packbot_simulator = ugv_acceptance.nodes.simulator:main',
        ],
    },
    zip_safe=True,
)
