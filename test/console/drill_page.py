"""A drill on the page, four times as fast as for people. Arguments: situation, record to write."""

import sys
import time
from pathlib import Path

from ugv_acceptance.config import load
from ugv_acceptance.drill.course import Course
from ugv_acceptance.drill.feed import DrillFeed
from ugv_acceptance.drill.page import serve_drill

FASTER = 4.0

if __name__ == '__main__':
    course = Course(load('packbot'), seed=1, names=(sys.argv[1],))
    serve_drill(
        DrillFeed(course, now=lambda: FASTER * time.monotonic()),
        lambda: course.drill('Ada', '2026-05-04T09:30:00Z', 1.0),
        Path(sys.argv[2]),
        ready=lambda url: print(f'Console on {url}', flush=True),  # noqa: T201 - for the test
    )
