"""What the model is asked before a test: maps, validity of statics, capacity, risk, reliability."""
