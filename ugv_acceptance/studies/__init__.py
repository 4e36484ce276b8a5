"""Studies of the model before a test: maps, validity, capacity, risk, reliability."""
