"""Interspike intervals: return map, histogram, variation, period."""

from .histogram import IntervalHistogram, interval_histogram
from .maps import return_map
from .variation import coefficient_of_variation, cv2, local_variation

__all__ = [
    "IntervalHistogram",
    "coefficient_of_variation",
    "cv2",
    "interval_histogram",
    "local_variation",
    "return_map",
]
