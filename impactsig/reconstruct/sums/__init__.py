"""Correlation sums: pairs of vectors within a radius."""
