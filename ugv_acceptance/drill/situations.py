"""The seven situations, each drawn with numbers of a seed: angles, sides, loads, sensors.

In each the course of things ends badly by itself: on the simulated robot one can see that going on
tips it, overloads a joint, or moves it while nobody knows its margins.
"""

from math import degrees, pi, radians

from ugv_acceptance.drill.arm import FOLD, FOLDED, Rng, between, posture, side_of, tilt_left
from ugv_acceptance.drill.situation import (
    ADVICE,
    GO_ON,
    Act,
    Case,
    Choice,
    Setup,
    Situation,
    Trouble,
)
from ugv_acceptance.evaluation.ground import FLAT, STAIRS
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.simulation.faults import Fault
from ugv_acceptance.simulation.shape import stairs

STOP = Act('stop')
ON, OFF = 'Go on as planned', 'Acknowledge the alert and go on'
ADVISED = Choice(ADVICE, '')


def _going_on(lesson: str) -> tuple[Choice, Choice]:
    """Return the answers that change nothing, one of them with the alert acknowledged."""
    told = 'to acknowledge says that you have seen it; it changes nothing of the margin'
    seen = Choice('acknowledge', OFF, (Act('acknowledge'),), told, halts=False)
    return Choice(GO_ON, ON, (), lesson, halts=False), seen


def slope(robot: Robot, rng: Rng) -> Case:
    """Draw a raised arm that swings out over the low side of a slope."""
    sign, side = side_of(rng)
    load, shoulder, elbow = between(rng, 2.6, 3.2), rng.uniform(72, 80), rng.uniform(-70, -55)
    tilt, low = radians(float(rng.integers(12, 16))), sign * pi / 2.0

    def left(turret: float) -> float:
        arm = posture(shoulder, elbow, sign * turret)
        return tilt_left(robot, arm, (tilt, low), load)

    while left(90.0) > radians(-7.0):
        tilt += radians(1.0)
    start = next(a for a in range(90, -91, -5) if left(a) > radians(12.0) or a == -90)
    wrong = (
        Choice(
            'faster',
            'Swing the arm on quickly, to have it done',
            (Act('joint_to', 0.0, 'turret_joint', low, rate=0.5),),
            'a motion that brings the robot to its edge does so sooner when it is quick',
        ),
        Choice(
            'reach',
            'Lower the arm while it swings, to bring the load near the ground',
            (
                Act('joint_to', 0.0, 'turret_joint', low, rate=0.2),
                Act('joint_to', 0.0, 'shoulder_joint', radians(40), rate=0.2),
            ),
            'an arm that is lowered outwards reaches further out over the low side',
        ),
    )
    return Case(
        f'The robot stands on a slope of {degrees(tilt):.0f} degrees that falls to its {side},'
        f' with {load} kg in its raised arm. The arm swings slowly out to the {side}, to hand the'
        ' load over.',
        'The alert is there and the arm still moves. What do you do?',
        Setup(posture(shoulder, elbow, sign * start), (tilt, low), load),
        (Act('joint_to', 1.5, 'turret_joint', low, rate=0.06),),
        Trouble(frozenset({'TIP_OVER'})),
        (ADVISED, *wrong, _going_on('the tilt left shrinks as long as the arm moves downhill')[0]),
        (STOP, *FOLD),
        ('ended',),
        'On a slope stop first; then bring the load back over the tracks, or set it down.',
        patience=10.0,
    )


def load(_: Robot, rng: Rng) -> Case:
    """Draw an arm that is stretched out with more than its shoulder holds."""
    mass = between(rng, 3.6, 4.4)
    shoulder, elbow = rng.uniform(79, 83), rng.uniform(-108, -102)
    turret = rng.uniform(-15.0, 15.0)
    out = (
        Act('joint_to', 1.5, 'shoulder_joint', radians(rng.uniform(28, 36)), rate=0.04),
        Act('joint_to', 1.5, 'elbow_joint', radians(rng.uniform(-30, -15)), rate=0.04),
    )
    wrong = (
        Choice(
            'drop',
            'Lower the shoulder quickly to set the load on the ground ahead',
            (Act('joint_to', 0.0, 'shoulder_joint', radians(15), rate=0.5),),
            'the load moves away from the shoulder first: that needs more torque, not less',
        ),
        Choice(
            'slower',
            'Lower the shoulder slowly, to put the load on the ground',
            (Act('joint_to', 0.5, 'shoulder_joint', radians(20), rate=0.15),),
            'torque grows with the distance between load and joint, however slowly it moves',
        ),
    )
    return Case(
        f'The robot holds {mass} kg on level ground and has told the monitor so. It stretches its'
        ' arm slowly forward, to put the load on a table.',
        'The shoulder is near its limit and the arm still moves. What do you do?',
        Setup(posture(shoulder, elbow, turret), load=mass),
        out,
        Trouble(frozenset({'TORQUE_LIMIT'})),
        (ADVISED, *wrong, _going_on('a motor at its limit cannot hold: the arm falls')[0]),
        (STOP, Act('joint_to', 1.5, 'elbow_joint', radians(-140))),
        ('ended',),
        'Bring the load closer to the joint that is at its limit, or set it down.',
        patience=9.0,
    )


def _dead(rng: Rng) -> tuple[Fault, str, str]:
    """Draw a sensor that dies: its fault, what the operator is told of it, what to check."""
    kinds = (
        (Fault('dead', 'imu'), 'IMU'),
        (Fault('dead', 'joint_states'), 'joint encoders'),
        (Fault('nan', 'imu'), 'IMU'),
        (Fault('nan', 'joint_states'), 'joint encoders'),
    )
    fault, what = kinds[int(rng.integers(len(kinds)))]
    return fault, what, f'Stop; do not move; have the driver of the {what} started anew'


def _blindly(speed: float) -> tuple[Choice, ...]:
    """Return the wrong answers to a dead sensor, driving at `speed` (m/s)."""
    return (
        Choice(
            'fold',
            'Fold the arm first, then stop',
            (*FOLD, Act('drive', 6.0)),
            'without its sensors nobody knows what a motion does: stop, then do not move',
        ),
        Choice(
            'slow',
            'Drive on at half the speed, by sight',
            (Act('drive', 0.0, amount=speed / 2.0),),
            'slow is not safe: the ground gets steeper and nobody would be told',
        ),
        *_going_on('NO DATA is worse than DANGER: it may be tipping, and nobody is told'),
    )


def sensor(robot: Robot, rng: Rng) -> Case:
    """Draw a sensor that dies while the robot drives along a slope that gets steeper."""
    sign, side = side_of(rng)
    fault, what, check = _dead(rng)
    mass, speed = between(rng, 2.0, 3.0), between(rng, 0.1, 0.3)
    arm = posture(rng.uniform(72, 80), rng.uniform(-65, -55), sign * 90.0)
    low, tilt = sign * pi / 2.0, 0.0
    while tilt_left(robot, arm, (tilt, low), mass) > radians(-6.0):
        tilt += radians(1.0)
    begin = tilt - radians(24.0) if tilt > radians(26.0) else radians(2.0)
    course = (
        Act('drive', 1.0, amount=speed),
        Act('slope', 1.0, amount=tilt, other=low, rate=0.03),
        Act('fail', 4.0),
    )
    wrong = _blindly(speed)
    return Case(
        f'The robot drives along a bank that falls to its {side} and gets steeper. Its arm with'
        f' {mass} kg points down the bank.',
        'The numbers are gone. What do you do?',
        Setup(arm, (begin, low), mass),
        course,
        Trouble(frozenset({'INPUT_STALE', 'INPUT_INVALID', 'INPUT_INCOMPLETE'}), 4.0, 0.3),
        (ADVISED, *wrong),
        (STOP, Act('mend', 4.0)),
        ('known', 'not_blind'),
        f'NO DATA means stop: see to the {what} first; it moves when the numbers are back.',
        check,
        sensor=(fault,),
        patience=8.0,
    )


def braking(_: Robot, rng: Rng) -> Case:
    """Draw a robot that brakes hard downhill with its arm stretched out ahead."""
    tilt, mass = float(rng.integers(8, 12)), between(rng, 3.0, 3.5)
    shoulder, speed = rng.uniform(85, 88), between(rng, 1.6, 1.9)
    drive = Act('drive', 5.0, amount=speed)
    course = (
        Act('drive', 1.0, amount=0.6, rate=2.0),
        Act('drive', 3.0, rate=3.5),
        drive,
        Act('drive', 14.0, rate=15.0),
    )
    wrong = (
        Choice(
            'hard',
            'Drive on, and brake hard when somebody steps in the way',
            (Act('drive', 1.0, amount=speed), Act('drive', 5.0, rate=15.0)),
            'the harder it brakes, the more it turns over its front edge',
        ),
        Choice(
            'reverse',
            'Drive on, then reverse at once to stop',
            (Act('drive', 1.0, amount=speed), Act('drive', 6.0, amount=-speed, rate=15.0)),
            'to reverse at once is to brake twice as hard',
        ),
        *_going_on('the first stop lifted its tracks: the next, from a higher speed, tips it'),
    )
    again = Act('drive', 8.0, amount=speed / 2.0), Act('drive', 12.0, rate=0.5)
    return Case(
        f'The robot drives down a slope of {tilt:.0f} degrees with {mass} kg in its arm, which is'
        ' stretched out ahead. It has stopped once; now it is to go on at'
        f' {speed} m/s to the gate and stop there.',
        'What do you do before and during the next stop?',
        Setup(posture(shoulder, -30.0), (radians(tilt), 0.0), mass),
        course,
        Trouble(frozenset({'ACCELERATION'}), 2.0, 0.1),
        (ADVISED, *wrong),
        (STOP, *FOLD, *again),
        ('ended',),
        'Fold the arm over the tracks before you drive fast, and brake gently.',
        patience=11.0,
    )


_MISLED = (
    Choice(
        'silence',
        'Switch the monitor off: it is plainly wrong',
        (Act('silence'),),
        'a monitor that is off says nothing of the next edge either',
        halts=False,
    ),
    *_going_on('while one alarm is wrong, nobody sees the next, which is right'),
)


def false_alarm(robot: Robot, rng: Rng) -> Case:
    """Draw a payload declared far too heavy: an alert that the robot itself contradicts."""
    sign, _ = side_of(rng)
    mass, typed = between(rng, 1.0, 1.8), 4.0
    shoulder, elbow = rng.uniform(66, 74), rng.uniform(-65, -55)
    low, tilt = sign * pi / 2.0, radians(20.0)
    arm = posture(shoulder, elbow, sign * 90.0)
    while tilt_left(robot, arm, (tilt, low), mass) > radians(-5.0):
        tilt += radians(1.0)
    while tilt_left(robot, posture(shoulder, elbow), (0.0, 0.0), typed) > radians(2.0):
        typed += 0.5
    course = (
        Act('drive', 1.0, amount=0.3),
        Act('declare', 3.0, amount=typed),
        Act('slope', 7.0, amount=tilt, other=low, rate=0.05),
        Act('joint_to', 7.0, 'turret_joint', low, rate=0.25),
    )
    right = Choice(
        'look',
        'Stop, look into the gripper, declare what it really holds, acknowledge',
        (STOP, Act('declare', 4.0, amount=-1.0), Act('acknowledge', 5.0)),
        'it takes a moment until the alert ends',
    )
    return Case(
        f'The robot drives over level ground with {mass} kg in its gripper, towards a bank.'
        f' Somebody has just typed {typed:g} kg into the monitor.',
        'DANGER, but the robot stands firmly and its motors hardly work. What do you do?',
        Setup(posture(shoulder, elbow), load=mass),
        course,
        Trouble(frozenset({'TIP_OVER', 'TORQUE_LIMIT'}), 3.0),
        (ADVISED, right, *_MISLED),
        (STOP, *FOLD),
        ('ended', 'heard'),
        'Treat an alert as true until you have looked; then correct what it was told.',
        patience=13.0,
    )


_AFTER_A_FALL = (
    Choice(
        'help',
        'Send somebody to pull it back onto its tracks',
        (Act('near', 2.0), Act('pull', 4.0, amount=160.0, other=0.2), Act('pull', 7.0)),
        'nobody goes near a robot that lies with its motors on: it can slide and strike',
    ),
    Choice(
        'push',
        'Push it up again with its arm',
        (Act('joint_to', 1.0, 'shoulder_joint', radians(-30), rate=0.6),),
        'lying on its arm, each motion makes it slide or roll somewhere else',
    ),
    Choice(
        'drive',
        'Drive out of it: one track still touches the ground',
        (Act('drive', 1.0, amount=0.5),),
        'on one track it does not drive, it turns and slides',
    ),
    Choice(GO_ON, ON, (), 'after a fall the task is over', halts=False),
)


def fall(robot: Robot, rng: Rng) -> Case:
    """Draw a robot that tips over on a slope, and lies there with its motors on."""
    sign, side = side_of(rng)
    mass, low = between(rng, 3.2, 3.8), sign * pi / 2.0
    shoulder, elbow, tilt = rng.uniform(58, 64), rng.uniform(-55, -45), radians(12.0)
    while tilt_left(robot, posture(shoulder, elbow, sign * 90), (tilt, low), mass) > radians(-8.0):
        tilt += radians(1.0)
    course = (
        Act('joint_to', 1.0, 'turret_joint', low, rate=0.8),
        Act('joint_to', 14.0, 'shoulder_joint', radians(10), rate=0.5),
        Act('drive', 16.0, amount=0.3),
    )
    return Case(
        f'The robot hands {mass} kg over on a slope that falls to its {side}, and it goes wrong.'
        f' A colleague waits three metres away.',
        'It lies on its side, and its motors are on. What do you do?',
        Setup(posture(shoulder, elbow), (tilt, low), mass),
        course,
        Trouble(after=2.0, lasting=1.0),
        (ADVISED, *_AFTER_A_FALL),
        (STOP, Act('switch_off', 1.0)),
        ('off', 'nobody_near', 'lay_still'),
        'After a fall: stand clear, do not move the arm, switch it off before anyone comes near.',
        'Stand clear; do not move the arm; switch it off',
        watched=12.0,
    )


def on_stairs(_: Robot, rng: Rng) -> Case:
    """Draw a robot that climbs stairs with its load behind it."""
    mass = between(rng, 2.6, 3.4)
    rise, shoulder = round(float(rng.uniform(0.055, 0.065)), 3), rng.uniform(72, 78)
    back = Act('drive', 1.5, amount=-0.12), Act('drive', 9.0)
    course = (Act('drive', 1.0, amount=0.2), Act('drive', 3.0, amount=0.05))
    wrong = (
        Choice(
            'flat',
            'Tell the monitor that the ground is flat, so that it is quiet',
            (Act('ground', subject=FLAT),),
            'on stairs the tilt left for flat ground is an upper bound: it is too good',
            halts=False,
        ),
        Choice(
            'faster',
            'Drive faster, to be up before it tips',
            (Act('drive', 0.0, amount=0.25),),
            'each step lifts the front further over the load behind it',
        ),
        *_going_on('it climbs until its load behind pulls it over'),
    )
    return Case(
        f'The robot climbs stairs of {rise * 100:.1f} cm with {mass} kg in its arm, which points'
        ' back. The monitor knows that these are stairs.',
        'What do you do?',
        Setup(
            posture(shoulder, -40.0, 180.0),
            load=mass,
            ground=STAIRS,
            blocks=stairs(0.6, rise, 0.25, 8),
        ),
        course,
        Trouble(frozenset({'TIP_TREND'}), 4.5),
        (ADVISED, *wrong),
        (STOP, *back, *(Act('joint_to', 9.0, name, at) for name, at in FOLDED)),
        ('ended', 'true_ground'),
        'On stairs stop at the first warning, drive back slowly, bring the arm to the high side.',
        patience=8.0,
    )


SITUATIONS: dict[str, Situation] = {
    s.name: s
    for s in (
        Situation('slope', 'A raised arm on a slope', slope),
        Situation('load', 'A heavy load', load),
        Situation('sensor', 'A dead sensor', sensor),
        Situation('braking', 'Braking with the arm out', braking),
        Situation('false_alarm', 'A false alarm', false_alarm),
        Situation('fall', 'After a fall', fall),
        Situation('stairs', 'Ground that is not flat', on_stairs),
    )
}
