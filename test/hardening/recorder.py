"""A recorder as a process of its own: 600 messages a second, flushed as a run and a black box do.

The first argument is a folder; a second, a file that holds the number of messages taken so far.
After each flush it prints how many messages it was promised are kept; it runs until it is killed,
or ends with exit code 3 and a line where it cannot write.
"""

import os
import sys
import time
from pathlib import Path

from hardening.robot import imu_of, joints_of, say

from ugv_acceptance.bag.writer import BagWriter

# Seconds between flushes: that of nodes/monitor/black_box.py and of a run.
FLUSH = 0.25
TOPICS = ('/joint_states', 'sensor_msgs/msg/JointState'), ('/imu/data', 'sensor_msgs/msg/Imu')


def main() -> None:
    """Record until killed."""
    joints, imu = joints_of(''), imu_of('')
    assert joints is not None and imu is not None  # noqa: PT018 - of no fault
    count, due = 0, time.monotonic() + FLUSH
    counts = os.open(sys.argv[2] if len(sys.argv) > 2 else os.devnull, os.O_WRONLY | os.O_CREAT)
    try:
        with BagWriter(Path(sys.argv[1]), compression='') as writer:
            for topic, kind in TOPICS:
                writer.add_topic(topic, kind)
            while True:
                for topic, data in zip(('/joint_states', '/imu/data'), (joints, imu), strict=True):
                    writer.write(topic, time.time_ns(), bytes(data))
                    count += 1
                os.pwrite(counts, count.to_bytes(8, 'little'), 0)
                if time.monotonic() >= due:
                    writer.flush()
                    due += FLUSH
                    say(str(count))
                time.sleep(1 / 300)
    except OSError as error:
        say(f'cannot write: {error.strerror}')
        sys.exit(3)


if __name__ == '__main__':
    main()
