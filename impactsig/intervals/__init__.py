"""Interspike intervals: return map, histogram, variation, period."""
