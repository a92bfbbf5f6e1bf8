"""Reconstruction of dynamics from intervals: embedding, dimension, exponents, surrogates."""

from . import classic
from .delays import DelayChoice, autocorrelation_delay, mutual_information_delay
from .dimensions.dimension import (
    CorrelationDimension,
    KaplanYorke,
    ScaleSlope,
    correlation_dimension,
)
from .divergence.exponents import LyapunovExponent, lyapunov_exponent
from .embedding import delay_embed
from .information import mutual_information
from .neighbors import (
    AveragedFalseNeighbors,
    FalseNeighbors,
    averaged_false_neighbors,
    false_nearest_neighbors,
)
from .ordinal import OrdinalPatterns, ordinal_patterns
from .recurrences.recurrence import (
    RecurrencePlot,
    RecurrenceQuantification,
    recurrence_plot,
    recurrence_quantification,
)
from .sums.correlation import CorrelationSum, correlation_sum
from .testing.determinism import ReturnMapDeterminism, return_map_determinism
from .testing.prediction import PredictionError, prediction_error, time_reversal_asymmetry
from .testing.surrogate_testing import SurrogateTest, surrogate_test
from .testing.surrogates import Surrogates, surrogates

__all__ = [
    "AveragedFalseNeighbors",
    "CorrelationDimension",
    "CorrelationSum",
    "DelayChoice",
    "FalseNeighbors",
    "KaplanYorke",
    "LyapunovExponent",
    "OrdinalPatterns",
    "PredictionError",
    "RecurrencePlot",
    "RecurrenceQuantification",
    "ReturnMapDeterminism",
    "ScaleSlope",
    "SurrogateTest",
    "Surrogates",
    "autocorrelation_delay",
    "averaged_false_neighbors",
    "classic",
    "correlation_dimension",
    "correlation_sum",
    "delay_embed",
    "false_nearest_neighbors",
    "lyapunov_exponent",
    "mutual_information",
    "mutual_information_delay",
    "ordinal_patterns",
    "prediction_error",
    "recurrence_plot",
    "recurrence_quantification",
    "return_map_determinism",
    "surrogate_test",
    "surrogates",
    "time_reversal_asymmetry",
]
