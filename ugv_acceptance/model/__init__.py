"""The physics: functions of arrays and one frozen Robot; SI and radians; no clock, file or logger."""
