"""A recording as a feed of the console: evaluated once, then played, paused and searched."""

import math
import time
from bisect import bisect_right
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ugv_acceptance import BadSample
from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.config import Config
from ugv_acceptance.console.frame import number
from ugv_acceptance.console.hub import number_in
from ugv_acceptance.console.recording_track import Track, TrackMaker, rate_at
from ugv_acceptance.console.snapshot import NO_PAYLOAD, AlertRow, InputRow, LastKnown, Snapshot
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR, has_tipped
from ugv_acceptance.evaluation.alerts.messages import describe, level_words
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, OK, STALE, Alert
from ugv_acceptance.evaluation.ground import FLAT, KINDS, ground_words
from ugv_acceptance.evaluation.inputs.frames import without_prefix
from ugv_acceptance.evaluation.inputs.payload import payload_from
from ugv_acceptance.evaluation.rough_ground import cautious_angles, cautious_mechanics
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.summary import ordered
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.model.shortened_tracks import has_tracks
from ugv_acceptance.model.stability import RAISED
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.evaluation import Evaluation
from ugv_acceptance.offline.judge import Options
from ugv_acceptance.type_aliases import Times

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)


@dataclass(slots=True)
class Playhead:
    """The position in a recording, in seconds from its start; stops at `duration`."""

    duration: float
    position: float = 0.0
    speed: float = 1.0
    playing: bool = True

    def advance(self, seconds: float) -> None:
        """Move on by `seconds` of real time, at the chosen speed."""
        if self.playing:
            self.position += self.speed * seconds
        if self.position >= self.duration:
            self.position, self.playing = self.duration, False

    def play(self) -> None:
        """Start playing; from the start if it is at the end."""
        if self.position >= self.duration:
            self.position = 0.0
        self.playing = True

    def pause(self) -> None:
        """Stop playing."""
        self.playing = False

    def seek(self, position: float) -> None:
        """Go to a position (s), limited to the recording."""
        self.position = min(max(position, 0.0), self.duration)


# An alert stays on the page this long (ns) after it is over.
LINGER = 10_000_000_000
INPUTS = ('joint_states', 'imu')


@dataclass(frozen=True, slots=True, eq=False)
class ShownRecording:
    """An evaluated recording; `snapshot_at` gives any moment of it. Times are log times, ns.

    `payloads` are those that count, and since when; `declared` (n,) when any message of one came.
    """

    evaluation: Evaluation
    track: Track
    worst: TrackMaker
    alerts: tuple[Alert, ...]
    payloads: tuple[tuple[int, Payload], ...]
    declared: Times

    @property
    def settings(self) -> Settings:
        """The settings it was evaluated with."""
        return self.evaluation.judgement.settings

    @property
    def bag(self) -> Bag:
        """The recording's files."""
        return self.evaluation.recording.bag

    def snapshot_at(self, when: int) -> Snapshot:
        """Return the snapshot of what was known at `when` (ns)."""
        alerts = tuple(self._alert(k, a, when) for k, a in self._near(when))
        active = [row.level for row in alerts if row.end is None]
        k = self.track.row(when)
        payload = self.payloads[bisect_right(self.payloads, when, key=lambda p: p[0]) - 1][1]
        running = (when - self.bag.start_ns) / 1e9
        first = Snapshot(when, payload=payload, running=running, source='bag')
        if k < 0:
            return replace(first, problem='nothing was received yet')
        track = self.track
        inputs = (*(self._input(w, k, when) for w in self._used()), self._payload_input(when))
        told = replace(
            first,
            q=_numbers(track.q[k]),
            effort=_numbers(track.effort[k]),
            alerts=alerts,
            inputs=inputs,
        )
        if not track.known[k] or any(self._silent(w, when) for w in range(2)):
            told = replace(told, level=max([*active, STALE]), last=self._last(k))
            return replace(told, **self._ground(k, when, payload, known=False))
        if has_tipped(track.angle[k]):
            alerts = tuple(replace(a, advice=a.advice if a.end else STAND_CLEAR) for a in alerts)
        return replace(
            told,
            alerts=alerts,
            level=max([*active, OK]),
            known=True,
            gravity=_vector(track.gravity[k]),
            torque=_numbers(track.torque[k]),
            angle=_numbers(track.angle[k]),
            state=int(track.state[k]),
            countdown=track.countdown(self.settings, k),
            **self._ground(k, when, payload, known=True),
        )

    def _last(self, k: int) -> LastKnown | None:
        """Return the margins known last, up to row `k` of the track; None if none ever were."""
        at, track = self.track.last_known(k), self.track
        if at < 0:
            return None
        when = int(track.time[at])
        angle, torque = _numbers(track.angle[at]), _numbers(track.torque[at])
        return LastKnown(when, angle, torque, self._kind(when) != FLAT)

    def _kind(self, when: int) -> str:
        """Return what kind of ground it is at `when` (ns)."""
        seconds = np.array([(when - self.bag.start_ns) / 1e9])
        return KINDS[int(self.settings.ground.numbers_at(seconds)[0])]

    def _ground(self, k: int, when: int, payload: Payload, *, known: bool) -> dict[str, Any]:
        """Return what a snapshot says of the ground at `when` (ns), in row `k` of the track."""
        settings, track = self.settings, self.track
        ground = settings.ground
        seconds = (when - self.bag.start_ns) / 1e9
        kind = self._kind(when)
        entered = ground.kind or any(w.start <= seconds < w.end for w in ground.windows)
        rough = kind != FLAT and settings.judges_tilt
        cautious = math.nan
        if rough and known:
            q, gravity = _numbers(track.q[k]), _numbers(track.gravity[k])
            short = cautious_mechanics(settings.robot, ground.pitch)
            cautious = min(cautious_angles(short, q, gravity, payload))  # type: ignore[arg-type]
        return {
            'ground': ground_words(kind if entered else None) if settings.judges_tilt else '',
            'rough': rough,
            'cautious': cautious,
            'carried': not rough and int(track.state[k]) == RAISED and has_tracks(settings.robot),
        }

    def _used(self) -> list[int]:
        """Return the numbers of the inputs that the configuration uses."""
        used = (self.settings.hears_joints, self.settings.hears_imu)
        return [which for which in range(2) if used[which]]

    def _near(self, when: int) -> list[tuple[int, Alert]]:
        return [
            (k, alert)
            for k, alert in enumerate(self.alerts)
            if alert.start <= when and (alert.end is None or when < alert.end + LINGER)
        ]

    def _alert(self, k: int, alert: Alert, when: int) -> AlertRow:
        rule = alert.rule
        over = alert.end is not None and alert.end <= when
        # As it was known then: the worst up to now, not what was yet to come.
        peak, worst = self.track.worst_of(alert, when)
        alert = replace(alert, peak=peak)
        return AlertRow(
            f'{rule.code}-{rule.subject}-{LEVELS[rule.level]}-{k}',
            rule.code,
            rule.subject,
            rule.level,
            'over' if over else 'active',
            describe(alert, self.settings),
            self.evaluation.alerts[k].advice,
            alert.start,
            alert.end if over else None,
            worst=worst,
            peak=peak,
        )

    def _silent(self, which: int, when: int) -> bool:
        return any(a <= when < b for a, b in self.evaluation.judgement.evaluator.gaps[which])

    def _input(self, which: int, k: int, when: int) -> InputRow:
        heard = int(self.track.heard[k, which])
        silent = heard < 0 or self._silent(which, when)
        topics = self.evaluation.judgement.topics
        topic = (topics.joint_states, topics.imu)[which] or ''
        bad = self._bad(INPUTS[which], when)
        gaps = self.evaluation.judgement.evaluator.gaps[which]
        since = max((b for _, b in gaps if b <= when), default=0)
        rate = rate_at(when, self.track.heard[:, which], self.track.taken[:, which], since)
        return InputRow(
            INPUTS[which],
            topic,
            max([a.rule.level for a in bad], default=STALE if silent else OK),
            0.0 if silent else rate,
            math.nan if heard < 0 else (when - heard) / 1e9,
            ('the recording',),
            '; '.join(describe(a, self.settings) for a in bad),
        )

    def _payload_input(self, when: int) -> InputRow:
        """Return the state of the payload's topic, which may be silent or absent."""
        came = bisect_right(self.declared, when)
        bad = self._bad('payload', when)
        return InputRow(
            'payload',
            self.evaluation.judgement.topics.payload or '',
            max([a.rule.level for a in bad], default=OK),
            rate_at(when, self.declared, np.arange(len(self.declared))),
            (when - int(self.declared[came - 1])) / 1e9 if came else math.nan,
            ('the recording',) if self.evaluation.judgement.topics.payload else (),
            '; '.join(describe(a, self.settings) for a in bad) or ('' if came else NO_PAYLOAD),
        )

    def _bad(self, subject: str, when: int) -> list[Alert]:
        """Return the alerts about an input that are active at `when` (ns)."""
        return [
            a
            for a in self.alerts
            if a.rule.subject == subject and a.start <= when and (a.end is None or when < a.end)
        ]

    def timeline(self) -> dict[str, Any]:
        """Return the overview of the run: worst margins of each part, alerts, verdict."""
        start = self.bag.start_ns
        return {
            'duration_s': self.bag.duration_s,
            'verdict': self.evaluation.verdict,
            'tilt_deg': [number(math.degrees(x)) for x in self.worst.tilt],
            'use': [number(x) for x in self.worst.use],
            'alerts': [
                {
                    'code': a.rule.code,
                    'level': LEVELS[a.rule.level],
                    'word': level_words(a.rule.level),
                    'text': describe(a, self.settings),
                    'from_s': (a.start - start) / 1e9,
                    'to_s': ((self.bag.end_ns if a.end is None else a.end) - start) / 1e9,
                }
                for a in self.alerts
            ],
        }


def shown_recording(recording: Recording, config: Config) -> ShownRecording:
    """Return a recording ready to be shown; it is read and evaluated once as a whole."""
    maker = TrackMaker(config.settings, recording.bag.start_ns, recording.bag.end_ns)
    found = evaluate(recording, config=config, options=Options(takers=(maker,)))
    alerts = tuple(ordered(found.judgement.evaluator.watch.log))
    declared, payloads = _payloads(recording.bag, found.judgement.topics, config.settings)
    return ShownRecording(found, maker.track(), maker, alerts, payloads, declared)


def _payloads(
    bag: Bag, topics: Topics, settings: Settings
) -> tuple[Times, tuple[tuple[int, Payload], ...]]:
    """Return when payloads were declared (ns), and the valid ones with their start."""
    found, times = [(-1, settings.robot.payload)], list[int]()
    if topics.payload is None:
        return np.array(times, np.int64), tuple(found)
    for batch in bag.batches(Topics(None, None, topics.payload)):
        for part in batch.payload:
            frame = without_prefix(part.frame_id, settings.frame_prefix)
            times += part.log_time.tolist()
            for when, mass, com in zip(part.log_time, part.mass, part.com, strict=True):
                load = payload_from(settings.robot, float(mass), com.tolist(), frame)
                found += [(int(when), load)] if load else []
    return np.array(sorted(times), np.int64), tuple(sorted(found, key=lambda entry: entry[0]))


def _vector(row: np.ndarray[Any, Any]) -> Vector:
    x, y, z = row.tolist()
    return x, y, z


def _numbers(row: np.ndarray[Any, Any]) -> tuple[float, ...]:
    return tuple(row.tolist())


@dataclass(slots=True)
class RecordingFeed:
    """Plays a recording as a feed; `now` reads a monotonic clock (s)."""

    recording: ShownRecording
    now: Any = time.monotonic
    settings: Settings = field(init=False)
    head: Playhead = field(init=False)
    _then: float = field(init=False)

    def __post_init__(self) -> None:
        self.settings = self.recording.settings
        self.head = Playhead(self.recording.bag.duration_s)
        self._then = self.now()

    def describe(self) -> dict[str, Any]:
        """Return the recording's name and its timeline."""
        title = ', '.join(Path(path).name for path in self.recording.bag.paths)
        return {'source': 'bag', 'title': title, 'timeline': self.recording.timeline()}

    def snapshot(self) -> Snapshot:
        """Return the snapshot at the playhead's position."""
        now = self.now()
        self.head.advance(now - self._then)
        self._then = now
        start = self.recording.bag.start_ns
        return self.recording.snapshot_at(start + round(self.head.position * 1e9))

    def extra(self) -> dict[str, Any]:
        """Return the playhead's position and speed for the frame."""
        head = self.head
        return {
            'playback': {
                'position_s': round(head.position, 3),
                'playing': head.playing,
                'speed': head.speed,
            }
        }

    def command(self, do: str, values: dict[str, Any]) -> str:
        """Carry out play, pause, seek (`to_s`) or `speed`; return what was done."""
        head = self.head
        if do == 'play':
            head.play()
        elif do == 'pause':
            head.pause()
        elif do == 'seek':
            head.seek(number_in(values, 'to_s'))
        elif do == 'speed':
            speed = number_in(values, 'speed')
            if speed not in SPEEDS:
                raise BadSample(f'speed: expected one of {SPEEDS}, got {speed}')
            head.speed = speed
        else:
            raise BadSample(f'a recording cannot do {do!r}')
        return do
