"""Recordings of which a part is lost or late: the verdict stays, or is that too little is known."""

from pathlib import Path
from random import Random

from bag.bag_cases import Message, write_mcap
from hardening.outcome import Outcome

from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.offline.evaluate import evaluate

MS = 1_000_000
# Share of messages lost one by one, bursts lost a minute and their length (s), jitter (s).
WAYS = {
    '10 % lost': (0.1, 0.0, 0.0, 0.0),
    '30 % lost': (0.3, 0.0, 0.0, 0.0),
    'bursts of 0.3 s': (0.0, 20.0, 0.3, 0.0),
    'bursts of 2 s': (0.0, 6.0, 2.0, 0.0),
    'jitter of 20 ms': (0.0, 0.0, 0.0, 0.02),
    'all of these': (0.1, 20.0, 0.3, 0.02),
}


def relayed(recording: Path, way: str, seed: int) -> list[Message]:
    """Return the messages of a recording as a lossy relay passes them on."""
    share, a_minute, length, jitter = WAYS[way]
    bag, rng = open_bag(recording), Random(seed)
    bursts = [
        bag.start_ns + rng.randrange(int(bag.duration_s * 1e9))
        for _ in range(round(bag.duration_s / 60 * a_minute) or bool(a_minute))
    ]
    found: list[Message] = []
    for message in messages(bag, bag.topics):
        kept = rng.random() >= share
        kept = kept and not any(0 <= message.log_time - t < length * 1e9 for t in bursts)
        if kept:
            late = message.log_time + int(rng.random() * jitter * 1e9)
            found.append((message.topic, bag.topics[message.topic].type, late, message.data))
    return sorted(found, key=lambda message: message[2])


def verdict(path: Path) -> str:
    """Return the verdict of a recording."""
    return evaluate(path).verdict


def trial(recording: Path, folder: Path, way: str, seeds: int) -> Outcome:
    """Lose parts of a recording in one way, `seeds` times."""
    whole = verdict(recording)
    found = [
        verdict(write_mcap(folder / 'lossy.mcap', relayed(recording, way, seed), chunk_size=60_000))
        for seed in range(seeds)
    ]
    counts = ', '.join(f'{found.count(v)} {v}' for v in sorted(set(found)))
    text = f'{recording.name} ({whole}), {way}: {counts}'
    return Outcome(text, set(found) <= {whole, 'INCONCLUSIVE'})
