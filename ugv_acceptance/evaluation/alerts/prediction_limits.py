"""The numbers of the prediction rules, live and recorded: prediction.py, prediction_live.py."""

# Time (ns) between two looks, and number of looks kept.
SPACING, KEPT = 50_000_000, 10
# Rates are taken over this many looks, if these span at most this time (ns).
OVER, LONGEST = 4, 400_000_000
# Time to a limit (s) at which the warning begins, and at which it ends.
SOON, LATER = 1.0, 1.5
# Slowest rates that count: tilt in rad/s, torque as a share of its limit per second.
TILT_RATE, LOAD_RATE = 0.0175, 0.03
# A weak motor: effort is constant to EVEN while the posture needs GROWN more (shares of the limit).
# A frozen encoder: the position is bit-identical for STUCK looks while effort changes by CHANGED,
# or stays within its noise (NOISE in rad or m over LAG looks) while effort changes by more, LEAPT.
EVEN, GROWN, STUCK, CHANGED = 0.015, 0.07, 6, 0.15
NOISE, LAG, LEAPT = 0.002, 4, 0.3
# A motor is weak (1) or not (0).
WEAK = 0.5
# A constant effort may mean a weak motor between these shares of the limit.
LOW, HIGH = 0.3, 0.97
# A change counts as a jump, not as a rate, if one step makes more than this share of it.
JUMP = 0.6
# Looks that may wait for `judge`; the oldest are dropped if time never passes.
MOST = 1024
