"""Correlation sums: pairs of vectors nearer than a radius."""
