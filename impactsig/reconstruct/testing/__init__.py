"""Surrogate series, statistics and the test of them."""
