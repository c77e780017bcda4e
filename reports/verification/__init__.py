"""Verification: each row a truth, its source, our figure, the tolerance."""
