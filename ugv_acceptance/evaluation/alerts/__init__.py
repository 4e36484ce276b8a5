"""From margins and input faults to alerts, and from alerts to alarms that a person acknowledges.

In: values of one sample at a time, or columns of a recording. Out: `Alert`s with code, subject,
level, begin and end, and their sentences. Read state_machine.py first (limit, deadband, delays),
then rules.py (which values are watched); prediction.py warns ahead, messages.py has the sentences,
alarms.py adds acknowledging, shelving and latching.
"""
