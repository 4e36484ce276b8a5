"""What to do about a margin: the moves that help, live and for a recording."""
