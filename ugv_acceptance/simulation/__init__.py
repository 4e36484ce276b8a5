"""The robot in MuJoCo, made from its description; no ROS."""
