"""Surrogate series, test statistics, and the surrogate test."""
