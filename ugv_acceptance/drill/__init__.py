"""Drills: the operator is shown a situation on the simulator, acts, and is told what came of it."""
