"""A running robot watched: session, alarms, diagnostics and advice, without ROS."""
