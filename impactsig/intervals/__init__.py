"""Interspike intervals: return map, histogram, variation, period, repair."""

from .histogram import IntervalHistogram, interval_histogram
from .maps import return_map
from .period import identify_period
from .periodicity import Periodicity, SpeedDrift
from .repair import Join, Repair, Split, repair_intervals
from .track import PeriodTrack, track_period
from .variation import coefficient_of_variation, cv2, local_variation

__all__ = [
    "IntervalHistogram",
    "Join",
    "PeriodTrack",
    "Periodicity",
    "Repair",
    "SpeedDrift",
    "Split",
    "coefficient_of_variation",
    "cv2",
    "identify_period",
    "interval_histogram",
    "local_variation",
    "repair_intervals",
    "return_map",
    "track_period",
]
