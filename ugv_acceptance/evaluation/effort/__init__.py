"""Compares measured joint efforts with the static model's torques.

In: the margins of a recording part by part (which carry the efforts), or one live sample. Out:
bias, scale, sign and friction of each joint with 95 % intervals (model_check.py), and efforts at
rest with the payload that would explain them (plateaus.py). Read model_check.py first.
"""
