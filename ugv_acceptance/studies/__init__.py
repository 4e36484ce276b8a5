"""Studies of the model before a test: maps, validity of the statics, capacity, risk, reliability.

In: a `Robot` of room model, with ranges of its joints, torque limits or spreads of uncertain
numbers; for reliability.py and two_groups.py hours and failures. Out: maps over two joints, largest
loads, joint speeds up to which the static model holds, probabilities, MTBF with exact bounds. No
messages and no recordings here. Read maps.py first; planar.py holds the paper's two-link arm, whose
closed forms the general code is tested against.
"""
