"""From messages to joint positions, gravity in `base_link` and payload, and the faults of inputs.

In: the numbers of JointState, Imu and payload messages with receipt time and header stamp. Out:
positions in the robot's convention (joints.py), gravity from orientation or accelerometer (imu.py,
low_pass.py), the payload in force (payload.py), and when an input is stale or its clock wrong
(timeouts.py). Each is written for one message and for columns, with the same results. Read
joints.py first.
"""
