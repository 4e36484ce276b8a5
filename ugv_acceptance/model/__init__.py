"""The physics: functions of arrays and one frozen Robot; SI and radians, no I/O."""
