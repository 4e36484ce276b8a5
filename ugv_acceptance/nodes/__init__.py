"""ROS 2 nodes: convert, evaluate, convert back."""
