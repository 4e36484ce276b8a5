"""The table of hardening trials: what is tried, what must hold, and the function that runs it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from hardening.outcome import Outcome

from bench.hardening import deaths, messages, processes, recordings, suite, wire

# Lines beside that of the rows that need a processor for themselves.
SOAK, WIRE = 1, 2


@dataclass(frozen=True, slots=True)
class Row:
    """A trial: `run(share)` makes that share of its long form and yields what was measured.

    Rows of a line of their own (`beside`, not 0) take minutes but little of the processor: each
    line is made beside the others, in a process and a ROS domain of its own.
    """

    number: int
    trial: str
    must_hold: str
    run: Callable[[float], Iterable[Outcome]]
    beside: int = 0


ROWS = (
    Row(
        1,
        'a million mutated CDR messages of each input type, decoded and evaluated',
        'no uncaught exception, growth under 10 MB',
        messages.mutants,
    ),
    Row(
        2,
        'MCAP cut, flipped, bombs, wrong lengths, loops, conformance files',
        'no crash, 5 s a file, no silent change under a checksum, over 64 MiB refused',
        recordings.damaged,
    ),
    Row(
        3,
        'the same bag again, in parts, turned round, 1, 2 and 4 threads, message by message',
        'the same bytes',
        recordings.same,
    ),
    Row(
        4,
        'the same messages by DDS and from the bag',
        'equal margins (1e-12), equal alerts',
        suite.of_tests('test_live_equals_bag.py', 'evaluation/test_live_equals_recorded.py'),
    ),
    Row(
        5,
        '24 h at 50 Hz simulated, faults sprinkled',
        'no critical alert missed or false, drift under 5 MB',
        messages.day,
    ),
    Row(
        5,
        '10 min of real time over DDS at 200 + 400 Hz, a fault every 5 s',
        'no critical alert missed or false, drift under 5 MB, 0 messages lost',
        wire.real_time,
        beside=SOAK,
    ),
    Row(
        6,
        'publisher killed, stopped, mismatched QoS, never started, half the joints gone, over DDS',
        'STALE in max(3 periods, 0.1 s) + a tick, never OK',
        wire.silences,
        beside=WIRE,
    ),
    Row(
        7,
        'clocks: an hour either way, frozen, zero, nine days off, restarting',
        'CLOCK within 1 s, staleness and margins undisturbed',
        messages.clocks,
    ),
    Row(
        8,
        'what broken drivers send, case by case',
        'each named with advice, no margin from it',
        messages.values,
    ),
    Row(
        9,
        'a second publisher on an input',
        'warned within 2 s, naming the node',
        wire.strangers,
        beside=WIRE,
    ),
    Row(
        9,
        'a publisher that `allowed_publishers` does not name',
        'warned, naming the node',
        suite.of_tests('nodes/test_monitor_inputs.py', words='not_allowed'),
    ),
    Row(
        10,
        'recordings of which messages, bursts are lost, or all are late',
        'the same verdict or INCONCLUSIVE',
        recordings.lossy,
    ),
    Row(
        10,
        'recordings played through a lossy relay over DDS, monitored and recorded',
        'the same verdict or INCONCLUSIVE, short coverage marked, live as recorded',
        wire.lossy,
        beside=WIRE,
    ),
    Row(
        11,
        'kill -9 of recorder, monitor, campaign and report, 20 times each',
        'all readable, at most 1 s lost, nothing told lost, resumed, no half result',
        deaths.kills,
        beside=WIRE,
    ),
    Row(
        11,
        'kill -9 of run, at 20 random moments',
        'all files readable, at most 1 s lost, nothing runs on, it can be resumed',
        processes.kills,
        beside=WIRE,
    ),
    Row(
        11,
        'a disk that is full, a folder that is read-only',
        'exit code 2 and one line, older results whole, the watch goes on',
        deaths.disks,
        beside=WIRE,
    ),
    Row(
        12,
        '10,000 random sets of parameters while running',
        'wholly taken or wholly refused with the reason',
        messages.parameters,
    ),
    Row(
        13,
        'fuzzed YAML and URDF, bombs, cycles, masses, 500 links, 100 branches',
        'refused with file and field, or right',
        recordings.robots,
    ),
    Row(
        14,
        'console: Host, Origin, token, cross-site, traversal, flooding',
        '400/403, nothing leaks',
        suite.of_tests('console/test_security.py', 'console/test_server.py'),
    ),
    Row(
        15,
        'the SROS 2 policy',
        'names every topic the code uses',
        suite.of_tests('hardening/test_policy.py'),
    ),
    Row(
        16,
        '300 mutants drawn from all of model/ and evaluation/',
        '85 % killed',
        processes.mutation,
    ),
    Row(
        17,
        'lines and branches of every room, in child processes too',
        '95 % of model/, studies/, evaluation/, bag/; 85 % of the others',
        suite.branches,
    ),
)
