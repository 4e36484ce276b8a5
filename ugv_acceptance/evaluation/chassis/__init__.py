"""Brakes, turns and bumps: whether the chassis's own acceleration tips it, live and recorded.

filters.py turns IMU messages into what the chassis feels, motion.py holds that against the edges
the robot stands on and raises the alerts, examination.py states what of it counts in a verdict.
Formulas: model/tipping.py.
"""
