"""From messages to margins, alerts and a verdict, live and recorded by the same rules.

In: `Settings` (settings.py, made by room config) and messages as numbers: one at a time for a
running robot (live.py), in columns for a recording (recorded.py, samples.py). Out: the margins of
every message (margin_table.py), alerts, a summary, and the verdict on acceptance criteria. No I/O,
no ROS, no clock: times come with the messages. Read settings.py and live.py first; recorded.py does
the same for columns. Sub-rooms: inputs (joints, IMU, payload), alerts, criteria, advice, effort.
"""
