"""The physics: functions of arrays and one frozen Robot; SI, radians; no clock, file or logger."""
