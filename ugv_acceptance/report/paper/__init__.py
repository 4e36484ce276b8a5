"""The page that computes the paper again."""
