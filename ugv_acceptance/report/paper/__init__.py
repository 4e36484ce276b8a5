"""The page that recomputes the paper: its numbers, tables and figures beside ours."""
