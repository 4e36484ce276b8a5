"""Damaged and hostile MCAP files; short forms of what the hardening run does by the thousand."""

from pathlib import Path

from hardening import damage
from hardening.outcome import Outcome


def hold(outcome: Outcome) -> None:
    """Fail with the figures of a trial that did not hold."""
    assert outcome.held, outcome.measured


def test_a_cut_recording_never_says_it_is_whole(tmp_path: Path) -> None:
    """Cut at any byte, what was written before is read or refused, and the break is told."""
    hold(damage.cuts(tmp_path, step=61))


def test_a_flipped_bit_is_seen_where_a_checksum_protects(tmp_path: Path) -> None:
    """No value changes and no message goes unsaid; without checksums "none" is said."""
    hold(damage.flips(tmp_path, 160, seed=5))


def test_lengths_and_offsets_of_an_attacker_end_the_reading(tmp_path: Path) -> None:
    """Records of any length and indexes that point at themselves give no crash and no hang."""
    hold(damage.hostile(tmp_path, 60, seed=5))


def test_bombs_are_refused_before_they_unpack(tmp_path: Path) -> None:
    """A few kB that unpack to more than is allowed are refused before they are unpacked."""
    hold(damage.bombs(tmp_path, 100 << 20))
