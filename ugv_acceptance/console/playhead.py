"""Where a recording is being played: a position that moves with the time it is told."""

from dataclasses import dataclass

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)


@dataclass(slots=True)
class Playhead:
    """`position` in seconds from the beginning, at most `duration`; it stops at the end."""

    duration: float
    position: float = 0.0
    speed: float = 1.0
    playing: bool = True

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        if self.playing:
            self.position += self.speed * seconds
        if self.position >= self.duration:
            self.position, self.playing = self.duration, False

    def play(self) -> None:
        """Go on, from the beginning where it has come to the end."""
        if self.position >= self.duration:
            self.position = 0.0
        self.playing = True

    def pause(self) -> None:
        """Stay where it is."""
        self.playing = False

    def seek(self, position: float) -> None:
        """Go to a position (s); beyond an end is that end."""
        self.position = min(max(position, 0.0), self.duration)
