"""The sentences of alerts about the IMU: what is wrong with it, and what to do."""

from ugv_acceptance.evaluation.alerts.alert_text import AlertText
from ugv_acceptance.evaluation.alerts.failure_source import FailureSource

IMU_ALERTS = {
    'IMU_FRAME': AlertText(
        'the frame_id of {subject} is not the one in the configuration, or has another prefix '
        'than before',
        'check that this is the IMU whose mounting is configured; if so, set topics.imu.frame_id',
        FailureSource.DESIGN,
        'The data are not from the IMU that was configured: tilt cannot be trusted.',
    ),
    'IMU_ORIENTATION': AlertText(
        'the orientation of {subject} is invalid, or level while its acceleration shows a tilt',
        'fix its driver; an IMU without orientation must say so (covariance -1, REP-145)',
        FailureSource.SENSOR,
        'The orientation of the IMU is wrong: the accelerometer is used instead.',
    ),
    'IMU_GRAVITY': AlertText(
        'while it does not turn, the acceleration of {subject} differs from gravity by {off}'
        '{at}{seems}',
        'check its unit (m/s2, not g), and that its driver does not subtract gravity',
        FailureSource.SENSOR,
        'The IMU does not measure gravity correctly: tilt cannot be trusted.',
    ),
    'IMU_INCONSISTENT': AlertText(
        'orientation and acceleration of the IMU disagree by {excess}{at} while it does not turn',
        'check the IMU; its orientation may be a default value, or its axes swapped',
        FailureSource.SENSOR,
        'The IMU contradicts itself: tilt cannot be trusted.',
    ),
    'IMU_NO_GRAVITY': AlertText(
        'the tilt is unknown: {subject} gives no orientation that can be used, and its '
        'acceleration differs from gravity by {off}{at}{seems}',
        'use an IMU that gives an orientation; check the unit of the acceleration (m/s2, not g)',
        FailureSource.SENSOR,
        'Nothing tells the tilt now: no margin is known.',
    ),
    'IMU_FROZEN': AlertText(
        'the values of {subject} kept changing, then stood still to the last digit for 1 s',
        'check the IMU and its driver; of a simulator without noise say imu.noise_free: true',
        FailureSource.SENSOR,
        'The IMU repeats its last values: tilt is not known.',
    ),
    'IMU_CONTRADICTION': AlertText(
        'averaged over {window:.0f} s, the acceleration of {subject} contradicts its orientation '
        'by {excess}{at}',
        'check the IMU; its orientation may be stuck, drift, or have other axes; or its '
        'acceleration',
        FailureSource.SENSOR,
        'Orientation and acceleration of the IMU contradict each other: tilt cannot be trusted.',
    ),
    'IMU_RATES': AlertText(
        'the rates of {subject} do not fit its orientation: {found}',
        'correct the unit (rad/s) or the axes of the rates in its driver',
        FailureSource.SENSOR,
        'The gyro of the IMU is wrong by its unit or axes; it is not used.',
    ),
    'IMU_ROTATION': AlertText(
        'rates and orientation of {subject} contradict each other: {found}',
        'check the IMU; its orientation may be stuck or of another sensor; or its rates',
        FailureSource.SENSOR,
        'The orientation of the IMU does not turn as its rates say: tilt cannot be trusted.',
    ),
    'IMU_MOUNTING': AlertText(
        'from the first message on {subject} leans by over 45 deg, so it seems mounted '
        'otherwise than configured: {found}',
        'set imu.mounting_rpy_deg as named (its heading cannot be told), or let the driver send '
        'z up',
        FailureSource.DESIGN,
        'The IMU is mounted otherwise than configured, or its driver has other axes (z down).',
    ),
    'IMU_MOUNTING_UNKNOWN': AlertText(
        'how {subject} is mounted is not known, so neither is the tilt: {detail}',
        'set imu.mounting_rpy_deg, or let its messages name a frame that the URDF or /tf_static'
        ' knows',
        FailureSource.DESIGN,
        'Nobody says how the IMU is mounted: no margin is known.',
    ),
    'IMU_UNIT': AlertText(
        'the acceleration of {subject} is not in m/s2: {found}',
        'let its driver send m/s2 with gravity in it, as REP-145 says',
        FailureSource.SENSOR,
        'The acceleration of the IMU has another unit, or gravity is missing in it.',
    ),
    'IMU_TWO_SOURCES': AlertText(
        'two sources publish as {subject}: {found}',
        'stop all but one, or give each IMU a topic of its own',
        FailureSource.CONTROL_SYSTEM,
        'The messages of two IMUs are mixed: tilt cannot be trusted.',
    ),
}
