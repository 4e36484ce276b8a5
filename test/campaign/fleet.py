"""Small fleets for the tests: real recordings of standing robots; and campaigns on them."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.campaign.sources import Source
from ugv_acceptance.campaign.work import Brief, Done
from ugv_acceptance.config import load
from ugv_acceptance.simulation.poses import STOWED as FOLDED

HOUR = 3_600_000_000_000
EPOCH = 1_748_854_800_000_000_000
GRAVITY = 9.80665
NONE = [0.0] * 9
STOWED = dict(FOLDED)


def write_run(
    folder: Path,
    hour: int,
    *,
    tilt_deg: float = 0.0,
    silent_s: float = 0.0,
    effort: float | None = None,
) -> Path:
    """Write a standing run of 4 s, begun in some hour; the ground tilts sideways in its middle.

    The joints are silent for the last `silent_s`. The shoulder measures `effort` (N m) meanwhile,
    all efforts are 0 else; with None no effort is measured.
    """
    settings = load().settings
    names = [joint.topic_name for joint in settings.joints]
    pairs = zip(settings.robot.joint_names, settings.joints, strict=True)
    still = [(STOWED.get(name, 0.0) - j.offset) / j.sign for name, j in pairs]
    calm = [0.0] * len(names)
    with BagWriter(folder) as bag:
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        for k in range(200):
            now = EPOCH + hour * HOUR + k * 20_000_000
            angle = np.radians(tilt_deg) if 80 <= k < 140 else 0.0
            if k * 0.02 < 4.0 - silent_s:
                efforts = [0.0] * len(names) if effort is not None else []
                if effort and 80 <= k < 140:
                    efforts[settings.robot.joint_names.index('shoulder_joint')] = effort
                state = joint_state_cdr(now, '', names, still, calm, efforts)
                bag.write('/joint_states', now, state)
            up = [0.0, GRAVITY * float(np.sin(angle)), GRAVITY * float(np.cos(angle))]
            turned = [float(np.sin(angle / 2.0)), 0.0, 0.0, float(np.cos(angle / 2.0))]
            bag.write(
                '/imu/data',
                now,
                imu_cdr(now, 'imu_link', turned, [0.0] * 3, up, (NONE, NONE, NONE)),
            )
    return folder


def write_fleet(folder: Path) -> Path:
    """Write six runs: two good, one that tips, one half silent, a copy, and one that is no bag."""
    write_run(folder / 'good_a', 0)
    write_run(folder / 'tips', 1, tilt_deg=60.0)
    write_run(folder / 'silent', 2, silent_s=2.0)
    write_run(folder / 'good_b', 3)
    shutil.copytree(folder / 'good_b', folder / 'good_copy')
    (folder / 'nothing.mcap').write_bytes(b'no recording')
    return folder


MAIN = 'from ugv_acceptance.cli import main; main()'


def campaign(out: Path, *arguments: str | Path) -> tuple[int, str]:
    """Run `ugv-acceptance campaign` and return its exit code and what it printed."""
    command = [sys.executable, '-c', MAIN, 'campaign', '--out', out]
    done = subprocess.run(
        [str(part) for part in (*command, *arguments)], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


def said(out: Path) -> dict[str, Any]:
    """Return the campaign.json of a folder."""
    found: dict[str, Any] = json.loads((out / 'campaign.json').read_text())
    return found


def brief() -> Brief:
    """Return the default robot and its limits."""
    return Brief(load())


def exit_at_b(source: Source) -> Done:
    """Die as a crash in a library does, at the source named b."""
    if source.name == 'b':
        os._exit(1)
    return Done(source, key=source.name)
