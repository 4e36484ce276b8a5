"""Evaluates recordings: verdict and result, margins as columns and files, annotated copies.

In: a recording (room bag), a robot's configuration, and optionally acceptance criteria and a
payload. Out: `Evaluation` with verdict, reasons, alerts and margins; CSV and Parquet files; the
messages that the live monitor would have published. Read evaluate.py first (`evaluate`, which every
command and the Python front door use), then evaluation.py for what it returns.
"""
