"""Lengths and weights of the first pass at a sampling rate, which no record changes."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from ._kernels import EDGE, GROUP, Scale
from ._rises import Rises
from .powers.bands import Bands, bands_at, degrees_of_freedom
from .powers.closings import octave_weights

LAG = 10e-3  # [s], over which narrow bands rise
LATER = 17e-3  # [s] after which it is asked whether they go on to rise
LOW = 200.0  # [Hz], below which a rise in one narrow band is not significant


class SurveyLengths(NamedTuple):
    """Lengths and weights of the first pass; frames are those of the octaves unless it says so."""

    bands: Bands
    rises: Rises
    weights: np.ndarray  # of the octaves
    spread: float  # standard deviation of the rise in noise, about
    freedom: np.ndarray  # degrees of freedom of one frame of each narrow band; 0 below LOW
    lag: int  # frames of the narrow bands
    later: int  # frames of the narrow bands
    begins: int  # frames of the narrow bands that a segment's start spoils
    margin: tuple[int, int]  # frames that a window needs beside it


@functools.lru_cache(maxsize=8)
def survey_lengths_at(scale: Scale, rate: float) -> SurveyLengths:
    """The lengths at a sampling rate."""
    hop = GROUP * scale.hop
    bands, rises = bands_at(rate, hop), Rises(scale)
    count = scale.forward * scale.hop / 2.0 ** (1 + np.arange(scale.octaves))
    freedom = degrees_of_freedom(rate, hop, 1).copy()
    freedom[bands.first * rate < LOW * len(bands.window)] = 0.0
    lag, half = max(round(LAG * rate / hop), 1), len(bands.window) // 2
    beside = max(2 * GROUP, -(-half // scale.hop), scale.past)
    margin = beside + EDGE, beside + max(scale.forward, GROUP) + EDGE
    return SurveyLengths(
        bands,
        rises,
        octave_weights(scale.octaves),
        math.sqrt(scale.octaves) / float(np.sqrt(count).sum()),
        freedom,
        lag,
        max(round(LATER * rate / hop), 1),
        lag + -(-half // hop),
        (max(margin[0], rises.margin[0]), max(margin[1], rises.margin[1])),
    )
