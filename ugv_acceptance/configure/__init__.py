"""Derives a robot's configuration from what ROS already knows: its URDF, a recording, live topics.

In: a URDF or xacro, and what messages tell (`evidence.py`). Out: the text of a YAML file in which
every line says where its value comes from and how sure it is, what has to be asked, a picture, and
checks that fail while something is wrong. Read draft.py first: the draft that every part fills.
"""
