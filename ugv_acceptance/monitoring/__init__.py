"""Monitors a running robot, without ROS: session, alarms, diagnostics and advice.

In: a `Config` or `Settings`, and messages of the running robot, serialised (session.py, used by the
monitor node) or as numbers (live_evaluator.py, for Python programs). Out: margins, alerts, the
verdict line for the operator, diagnostics, and shapes to draw, all as plain values. Read session.py
first, then diagnostics.py; faults.py has the faults that only a live input shows, alarm_tracker.py
what people acknowledged.
"""
