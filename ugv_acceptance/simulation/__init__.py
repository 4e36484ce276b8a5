"""The robot in MuJoCo: simulated runs with faults, and a tilting plane that checks the margins.

In: a `model` Robot and a `scenario.Scenario` (commands at times, noise of the sensors), or live
commands. Out: a `scenario.Recording` with the readings of joints and IMU, and the truth that no
sensor measures: when the robot tipped, which motors saturated. The MuJoCo model is made from the
robot's description, so that it checks the project's own mechanics. No ROS, no files. Read
`scenario.py` first, then `simulation.py` (a run) and `oracle.py` (does it tip?).
"""
