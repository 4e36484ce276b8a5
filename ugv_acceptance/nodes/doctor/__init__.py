"""Checks of a set-up: what is heard of a robot, and what is wrong with it."""
