"""What the verdict tells beside the margins: black box, time, load in force, why not `~/ok`."""

from dataclasses import dataclass, replace

from ugv_acceptance.monitoring.diagnostics import Status
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.black_box import BlackBox
from ugv_acceptance.nodes.monitor.ok_output import OkOutput


@dataclass(frozen=True, slots=True)
class Lamps:
    """The state of an active monitor itself; `since` is when it was activated or reset (ns)."""

    session: Session
    box: BlackBox
    since: int
    ok: OkOutput

    def on(self, status: Status) -> Status:
        """Return a verdict with these values added.

        `black_box` is on, off, or what is wrong with it; `active_s` whole seconds; `payload_kg` and
        `payload_cog_m` are left out while the load is not known; `ok` is `yes`, or why `~/ok` is
        false.
        """
        evaluator = self.session.evaluator
        values: dict[str, object] = {
            'black_box': self.box.state,
            'active_s': (self.session.clock.now() - self.since) // 1_000_000_000,
            'ok': f'no: {self.ok.why_not}' if self.ok.why_not else 'yes',
        }
        if evaluator.load_known:
            load = evaluator.payload
            values['payload_kg'] = load.mass
            values['payload_cog_m'] = ','.join(f'{c:.6g}' for c in load.cog)
        return replace(status, values=status.values | values)
