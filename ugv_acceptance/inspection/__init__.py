"""Looks at a robot or a recording before it is judged: what is there, what is wrong, what is asked.

`doctor` and `info` speak from here. The checks need only numbers (`Heard`): a live robot
(nodes/doctor/probe.py) and a recording (recorded.py) both feed them. No ROS.
"""
