"""Test plans derived from the robot's model: what is tested and why."""
