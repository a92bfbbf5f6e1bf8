"""The dynamics behind a series of intervals: embedding, dimension, exponents, surrogates."""

from . import classic
from .correlation import CorrelationSum, correlation_sum
from .delays import DelayChoice, autocorrelation_delay, mutual_information_delay
from .embedding import delay_embed
from .exponents import LyapunovExponent, lyapunov_exponent
from .neighbors import (
    AveragedFalseNeighbors,
    FalseNeighbors,
    averaged_false_neighbors,
    false_nearest_neighbors,
)

__all__ = [
    "AveragedFalseNeighbors",
    "CorrelationSum",
    "DelayChoice",
    "FalseNeighbors",
    "LyapunovExponent",
    "autocorrelation_delay",
    "averaged_false_neighbors",
    "classic",
    "correlation_sum",
    "delay_embed",
    "false_nearest_neighbors",
    "lyapunov_exponent",
    "mutual_information_delay",
]
