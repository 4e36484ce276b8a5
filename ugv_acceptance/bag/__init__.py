"""MCAP to columns of numbers, salvage, and a writer with checksums."""
