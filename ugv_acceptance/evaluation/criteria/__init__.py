"""From the margins of a recording to a verdict on acceptance criteria: PASS, FAIL, INCONCLUSIVE.

In: a `CriteriaSet`, the margins part by part, the alerts and numbers about the data. Out: each
criterion's outcome with its evidence, and the verdict of the run, ready for JSON. Read criteria.py
first (criteria as data), then measurement.py (worst values, time in violation) and verdict.py
(judges); quantities.py lists what a criterion can be about, uncertainty.py bounds the margins,
proposal.py writes criteria from a good run.
"""
