"""Interspike intervals: return map, histogram, variation, period."""

from .histogram import IntervalHistogram, interval_histogram
from .maps import return_map
from .period import identify_period
from .periodicity import Periodicity
from .variation import coefficient_of_variation, cv2, local_variation

__all__ = [
    "IntervalHistogram",
    "Periodicity",
    "coefficient_of_variation",
    "cv2",
    "identify_period",
    "interval_histogram",
    "local_variation",
    "return_map",
]
