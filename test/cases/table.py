"""The 56 cases of ../shared/bags/cases made anew with other numbers: name, file, what must come."""

from dataclasses import dataclass
from functools import reduce
from pathlib import Path

from cases.base import Base
from cases.files import FILE_CASES
from cases.inputs import IMU_CASES, JOINT_CASES, TIME_CASES, Made
from made.judged import Expected, Verdict, judged
from made.run import write
from made.subjects import ROOT

SHARED = ROOT.parent / 'shared' / 'bags' / 'cases'


@dataclass(frozen=True, slots=True)
class Case:
    """A recording that is made, or one of ../shared, and what must come of it."""

    name: str
    expected: Expected
    shared: bool = False

    def recording(self, folder: Path) -> Path:
        """Return the recording, made in `folder`; one of ../shared stands there by another name."""
        given = SHARED / self.name
        if self.shared:
            if (given / 'metadata.yaml').exists():
                return given
            link = folder / 'run.mcap'
            link.unlink(missing_ok=True)
            link.symlink_to(given / f'{self.name}.mcap')
            return link
        if self.name in FILE_CASES:
            return FILE_CASES[self.name][0](folder)
        made: Base = INPUT_CASES[self.name][0]()
        return write(folder / 'run.mcap', made.messages())

    def verdict(self, folder: Path) -> Verdict:
        """Return what comes of it; a robot.yaml beside the recording is its configuration."""
        path = self.recording(folder)
        robot = (SHARED / self.name if self.shared else folder) / 'robot.yaml'
        return judged(path, robot if robot.exists() else None)


INPUT_CASES: dict[str, tuple[Made, Expected]] = IMU_CASES | JOINT_CASES | TIME_CASES
MADE = {
    name: Case(name, expected)
    for name, (_, expected) in sorted([*INPUT_CASES.items(), *FILE_CASES.items()])
}


def _with_their_names(case: Case) -> Case:
    """Return a case of ../shared: the same must come, with the names that stand in that file."""
    own = {
        'bot7_': 'r1_',
        'monday_0': 'old_0',
        '/imu/raw': '/imu/data_raw',
        '/imu/madgwick': '/imu/filtered',
        r'15 ?%|0\.15': r'12 ?%|0\.12',
    }
    says = tuple(
        reduce(lambda text, pair: text.replace(*pair), own.items(), pattern)
        for pattern in case.expected.says
    )
    expected = Expected(case.expected.verdicts, says, case.expected.never)
    return Case(case.name, expected, shared=True)


GIVEN = {n: _with_their_names(c) for n, c in MADE.items() if n != 'advice_axis_y_turned'}
