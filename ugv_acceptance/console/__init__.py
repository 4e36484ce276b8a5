"""The operator's page: a robot's state as frames of JSON, served to browsers and terminals.

In: a `snapshot.Feed`, which is a live robot (`nodes/console_feed.py`) or a recording
(`recording.py`), and the commands of the operators. Out: up to 15 frames a second over WebSockets,
the safe map of two joints, and answers to the commands; the same frames drawn in a terminal. The
alerts are those of the monitor: the console judges nothing itself. Read `snapshot.py` first, then
`frame.py` and `hub.py`.
"""
