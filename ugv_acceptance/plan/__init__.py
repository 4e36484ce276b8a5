"""Test plans derived from the robot's model: what is tested, where, and why.

In: a robot's settings and what the plan is asked for (`derive.Wanted`: tilt of the ramp, loads,
endurance). Out: a `plan.Plan`, a list of steps that people read and edit as YAML, and its printed
card for the operator. The arm's postures are searched on the model, so that the plan holds the
worst postures and both sides of every limit. `run/` carries the plan out. Read `plan.py` first,
which is the plan as data, then `derive.py`.
"""
