"""The dynamics behind a series of intervals: embedding, dimension, exponents, surrogates."""

from .correlation import CorrelationSum, correlation_sum

__all__ = ["CorrelationSum", "correlation_sum"]
