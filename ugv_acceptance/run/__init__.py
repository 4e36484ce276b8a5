"""A test plan carried out, simulated or live: each step recorded and judged; no ROS here.

In: a `plan.Plan`, a configuration and a `world.World`, which is a robot with its monitor, over ROS
(`nodes/runner_world.py`) or simulated in this process (`simulated_world.py`). Out: a folder with a
recording and a result for each step, and the verdict and coverage of the whole run. The modules
for `simulate` (`catalogue.py`, `record.py`, `messages.py`) write recordings of simulated runs.
Read `runner.py` first, then `step_verdict.py`.
"""
