"""Spread of values by their median, which outliers hardly move."""

DEVIATION_BY_MEDIAN = 1.4826
"""Standard deviation of normal values over the median of their magnitudes."""
