"""A recording judged: evaluation, tables, annotation, verification."""
