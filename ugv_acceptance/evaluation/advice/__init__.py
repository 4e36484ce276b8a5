"""Advice to the operator: which motion or action improves a margin that is too small.

In: settings, joint positions, gravity and payload of one moment. Out: `Advice`, best first: move a
joint, turn the robot, or set the load down, as a sentence with the gain; after a fall only to stand
clear (tipped.py). Read search.py first; paths.py makes the candidate motions, words.py says them,
recorded.py gives advice for the alerts of a recording.
"""
