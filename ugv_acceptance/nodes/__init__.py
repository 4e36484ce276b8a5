"""ROS 2 nodes: convert messages, evaluate, convert back; the only room that imports ROS.

In: topics, services and parameters (docs/ros_interface.md), and the other rooms, which do the
work. Out: margins, verdict, alerts and diagnostics as messages; a replayed or simulated robot; the
worlds of the console and of `run`. A message that cannot be read is counted and reported; no
message ends a node. Read `monitor/node.py` first, then `executor.py`, which runs every node.
"""
