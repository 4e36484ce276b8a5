"""Diagnostics of the monitor and its inputs: rates, ages, publishers, faults, version, files."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from ugv_acceptance import __version__
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts import OK, STALE, Alert
from ugv_acceptance.nodes.session import Session
from ugv_acceptance.nodes.status import Status, margin_statuses

if TYPE_CHECKING:
    from ugv_acceptance.nodes.inputs import Inputs


def unavailable(problem: str) -> Status:
    """Return the verdict of a monitor that is not active."""
    text = f'the monitor is not active: {problem}' if problem else 'the monitor is not active'
    return Status(STALE, '', text, {'do': problem or 'configure and activate it'})


def diagnostics_of(
    verdict: Status, config: Config | None, session: Session | None, inputs: 'Inputs | None'
) -> list[Status]:
    """Return all statuses for /diagnostics; the first is the monitor itself."""
    statuses = [_monitor(verdict, config, session)]
    if session is not None:
        active = session.active
        statuses += margin_statuses(session.settings, session.evaluator.margins, active)
        statuses += [_input(name, session, inputs, active) for name in session.counts]
    return statuses


def _monitor(verdict: Status, config: Config | None, session: Session | None) -> Status:
    values: dict[str, object] = {'version': __version__}
    if config is not None:
        values |= {
            'robot': config.name,
            'config': config.path,
            'sha256': config.sha256,
            'warnings': len(config.warnings),
        }
    if session is not None:
        values |= {
            'evaluated': session.evaluator.evaluated,
            'use_sim_time': session.clock.simulated,
        }
    return Status(verdict.level, 'Monitor', verdict.message, {**values, **verdict.values})


def _input(name: str, session: Session, inputs: 'Inputs | None', active: list[Alert]) -> Status:
    count, now = session.counts[name], session.clock.now()
    mine = [a for a in active if a.rule.subject == name]
    nodes = inputs.publishers.get(name, []) if inputs else []
    age = (now - count.last) / 1e9 if count.taken else float('nan')
    rate = session.rates.get(name, 0.0)
    values: dict[str, object] = {
        'topic': inputs.subscriptions[name].topic_name if inputs else '',
        'rate_hz': rate,
        'age_s': age,
        'messages': count.taken,
        'malformed': count.malformed,
        'lost': count.lost,
        'publishers': len(nodes),
        'published_by': ', '.join(nodes),
    }
    if inputs and inputs.voices[name].restarted:
        values['restarted'] = ', '.join(inputs.voices[name].restarted)
    if name == 'imu':
        of = session.evaluator.orientations
        values |= {f'orientation_{how}': number for how, number in of.items()}
    if count.reason:
        values['last_malformed'] = count.reason
    level = max([a.rule.level for a in mine], default=OK)
    if not count.taken and name != 'payload':
        level = STALE
    text = '; '.join(session.faults.sentence(a, session.settings) for a in mine)
    return Status(level, f'Input {name}', text or f'{rate:.1f} Hz', values)


class Watcher(Protocol):
    """What `guarded` needs of a monitor."""

    session: Session | None

    def get_logger(self) -> Any:  # noqa: ANN401 - rclpy's logger
        """Return its logger."""


def guarded(watcher: Watcher, work: Callable[[], None]) -> Callable[[], None]:
    """Return a timer's work that outlives a fault of ours: the watch goes on, and says so."""

    def run() -> None:
        try:
            work()
        except Exception as error:  # noqa: BLE001 - a fault in our code must not end the watch
            text = f'{work.__name__}: fault of the monitor: {error!r}'
            watcher.get_logger().error(text, throttle_duration_sec=5.0)
            if watcher.session is not None:
                watcher.session.fail(work.__name__, error)

    return run
