"""Runs without ROS: simulated recordings, steps judged, folders of results, labelled runs."""
