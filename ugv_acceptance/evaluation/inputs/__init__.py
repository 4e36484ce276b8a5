"""Messages to the robot's joints, its attitude and its payload, and whether they still arrive."""
