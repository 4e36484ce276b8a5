"""Node `acceptance_monitor`: the lifecycle node that watches a robot; read `node.py` first."""
