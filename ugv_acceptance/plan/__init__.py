"""Test plans: what is tested and why, derived from the robot's model, written for people."""
