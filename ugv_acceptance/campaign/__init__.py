"""Many recorded runs to one statement of reliability."""
