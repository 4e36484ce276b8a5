"""A MuJoCo vehicle made from the robot description (no ROS)."""
