"""From margins to a verdict: criteria, what is measured for them, how sure it is."""
