"""The physics of a robot: joint torques, centre of gravity, support polygon and tip-over margins.

In: a `Robot` (robot.py, plain data), joint positions (..., j), gravity (..., 3) in `base_link` and
a payload. Out: static and dynamic torques, tip-over margins to each side, payload capacity. All in
SI units and radians; no I/O, no clock. Read robot.py first, then statics.py (torques) and
stability.py (tip-over); both run formulas that mechanics.py compiles once per robot (kernels.py).
"""
