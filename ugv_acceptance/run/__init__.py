"""A test plan carried out: simulated or live, recorded and judged step by step; no ROS."""
