"""The rows of the table of wrong verdicts, with its own numbers and others, and what must come."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from error_rate.measure import judge, wrong
from error_rate.plan import Kind, Plan
from error_rate.setup import OUTSIDE, VACUOUS
from made.judged import Expected, told
from made.run import messages_of, write
from made.subjects import PACKBOT

from ugv_acceptance.offline.evaluate import evaluate


@dataclass(frozen=True, slots=True)
class Row:
    """A run of a kind with numbers pinned; `says` are patterns of what must be told."""

    name: str
    kind: str
    pinned: Mapping[str, Any] = field(default_factory=dict)
    says: tuple[str, ...] = ()
    number: int = 1

    def wrong(self, plan: Plan, folder: Path) -> str:
        """Make and judge the run; return what is not as it must be, '' where all is."""
        kind: Kind = plan.kinds[self.kind]
        drawn = plan.draw(
            kind, self.number, folder, PACKBOT, **dict(map(_bounds, self.pinned.items()))
        )
        verdict, pardoned = judge(drawn, folder)
        fault = wrong(kind, verdict.word, pardoned=pardoned)
        if fault:
            return f'{fault}: {verdict.word} ({verdict.reason}); truth: {drawn.made.truth}'
        if not self.says:
            return ''
        path = write(folder / 'told.mcap', messages_of(drawn.made.parts))
        result = evaluate(path, config=drawn.made.config).result
        full = type(verdict)(verdict.word, verdict.reason, told(result))
        return Expected((verdict.word,), self.says).wrong(full)


def _bounds(pair: tuple[str, Any]) -> tuple[str, Any]:
    """Return a pinned number or word as bounds that leave nothing else; limits stay numbers."""
    key, value = pair
    if key.startswith(('most_', 'least_')):
        return pair
    return key, [value, value] if isinstance(value, int | float) else [value]


def _each(name: str, kind: str, key: str, words: list[str], **pinned: Any) -> list[Row]:
    return [Row(f'{name}, {w}', kind, {key: w, **pinned}) for w in words]


# Load shares: of the 50 N m of PackBot's shoulder at full reach, 28.08 N m + 11.67 N m a kg.
SIX_KG, ONE_KG, FOUR_KG = 1.962, 0.795, 1.4955
UNSEEN = (r'no margins|without margins|not seen|unseen',)
# Stretched out with 1.8 kg, braked for 0.3 s.
STRETCHED = {'out': 0.97, 'load_share': 0.98, 'lasts_s': 0.3, 'most_share': 0.99, 'shaken': 'no'}
STILL = {'slope_deg': 0, 'drives': 'no'}
FAULTED = [
    Row('1 IMU silent 2.4 s', 'imu_silent', {'blind_s': 2.4, 'past_deg': 12}, UNSEEN),
    Row('1 IMU silent 1.3 s', 'imu_silent', {'blind_s': 1.3, 'past_deg': 4}, UNSEEN),
    Row('1 joints silent 2.7 s', 'joints_silent', {'blind_s': 2.7, 'share': FOUR_KG}, UNSEEN),
    Row('1 both silent 0.9 s', 'both_silent', {'blind_s': 0.9}, UNSEEN),
    Row('2 IMU frozen', 'imu_frozen', {'blind_s': 2, 'stamps': 'running'}, ('IMU_FROZEN',)),
    Row('2 IMU frozen, old', 'imu_frozen', {'blind_s': 3, 'stamps': 'repeated'}, ('IMU_FROZEN',)),
    Row('2 joints repeated', 'joints_repeated', {'blind_s': 3, 'share': FOUR_KG}),
    *_each('3 payload', 'payload_unknown', 'told', ['frame', 'nan', 'negative', 'place nan']),
    Row('3 payload link', 'payload_link_wrong'),
    Row('4 effort 70 of 50', 'effort_saturated', {'share': 1.4, 'lasts_s': 10}),
    Row('4 encoder stuck', 'encoder_stuck', {'noise_mrad': 0, 'share': FOUR_KG}),
    Row('4 encoder stuck, noise', 'encoder_stuck', {'noise_mrad': 0.2, 'share': FOUR_KG}),
    Row('4 six kg, one told', 'payload_heavier', {'share': SIX_KG, 'told_share': ONE_KG}),
    *_each('5 fast', 'fast_swing', 'velocity', ['told', 'zero', 'none'], effort='none', hz=1.8),
    Row('6 told late', 'payload_told_late', {'share': FOUR_KG}),
    Row('6 told after 20 ms', 'payload_first', {'after_s': 0.02}),
    *_each('7 limits wide', 'limits_wide', 'goes', ['tip', 'overload']),
    Row('7 limit null', 'limit_null', {'share': 1.06, **STILL}),
    Row('7 contacts 1 m too wide', 'contacts_wide', {'wide_m': 1.0}, (OUTSIDE,)),
    *_each('8 tips', 'criteria_vacuous', 'criteria', [*VACUOUS], goes='tip', hides='nothing'),
    *_each('8 silent', 'criteria_vacuous', 'criteria', [*VACUOUS], hides='silence'),
    Row('9 gyro in deg/s', 'gyro_deg_stuck', {'lean_deg': 30, 'gyro_degps': 2}),
    Row('9 shaken', 'shaken_stuck', {'lean_deg': 25}),
    Row('9 stuck while it leans', 'stuck_from'),
    Row('9 off by 20 deg', 'tilt_offset', {'offset_deg': 20}),
    Row('10 degrees at rest', 'degrees_at_rest', {}, ('degree',)),
    Row('10 degrees moving', 'degrees_moving', {}, ('degree',)),
    Row('11 never at rest', 'never_at_rest', {}, ('never[^"]*rest',)),
    Row('12 brake lifts 47 mm', 'brake_lifts', {'lift_m': 0.047, 'over': 'front', **STRETCHED}),
    Row('12 turn lifts 30 mm', 'brake_lifts', {'lift_m': 0.03, 'over': 'left', 'shaken': 'yes'}),
    Row('W orientation says 50 deg', 'disagreeing', {'lean_deg': 50, 'start_s': -1}),
    Row('W orientation later', 'disagreeing', {'lean_deg': 45, 'start_s': 20}),
    *_each('W IMU', 'mounted_wrongly', 'mounted', ['upside down', 'on its side', 'on end']),
    Row('T falls', 'falls'),
    Row('T overloads', 'overloads', {'share': FOUR_KG}),
]
GOOD = [
    Row('10 % lost', 'lossy', {'loss': 0.1}),
    Row('30 % lost', 'lossy', {'loss': 0.3}),
    Row('20 ms jitter', 'jittery', {'jitter_ms': 20}),
    Row('vibration', 'vibrating', {'gyro_radps': 0.14, 'force_mps2': 0.9}),
    Row('driving', 'ordinary', {'drives': 'yes'}),
    Row('driving, shaken', 'shaken_drive'),
    Row('arm at 7 deg/s', 'ordinary', {'rate_degps': 7, 'reach_deg': 40}),
    Row('encoder noise', 'encoder_noise', {'noise_mrad': 0.2}),
    Row('brakes that lift nothing', 'brake_holds', {'over': 'front', 'of_balance': 0.6}),
    Row('turns that lift nothing', 'brake_holds', {'over': 'left', 'of_balance': 0.4}),
    Row('silent for 0.3 s', 'short_silence', {'silent_s': 0.3}),
    Row('prefix of tf', 'payload_prefixed', {'prefix': 'ra/'}),
    Row('an IMU that never varies', 'noise_free', {'rests': 'yes'}, ('var(y|ied|ies)|noise',)),
    Row('no uncertainty', 'no_uncertainty', {}, ('without a bound',)),
    Row('no IMU', 'no_imu', {}, ('tip-over[^"]*not (checked|judged)|not checked[^"]*tip',)),
    Row('no joint states', 'no_joint_states'),
]
ROWS = {row.name: row for row in [*FAULTED, *GOOD]}
