"""Many recorded runs judged together: a statement of reliability."""
