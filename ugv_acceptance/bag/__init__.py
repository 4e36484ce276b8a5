"""Recordings to columns of numbers and back: readers, salvage of damaged files, writers."""
