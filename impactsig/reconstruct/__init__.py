"""The dynamics behind a series of intervals: embedding, dimension, exponents, surrogates."""

from .correlation import CorrelationSum, correlation_sum
from .dimension import CorrelationDimension, DimensionEstimate, correlation_dimension

__all__ = [
    "CorrelationDimension",
    "CorrelationSum",
    "DimensionEstimate",
    "correlation_dimension",
    "correlation_sum",
]
