"""Checks of a ROS set-up: `probe.py` listens to a robot, `checks.py` lists what is wrong."""
