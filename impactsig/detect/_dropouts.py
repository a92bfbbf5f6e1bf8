"""A record without its dropouts, see `_dropout_kernels.py`."""

from __future__ import annotations

import numpy as np

from ._dropout_kernels import LEAST, MOST, fill, find_dropouts


def without_dropouts(samples: np.ndarray) -> np.ndarray:
    """The samples, or where there are dropouts a copy in which these are filled."""
    step = LEAST // 2
    n = len(samples) // step * step
    if not np.any(samples[:n:step] == samples[step - 1 : n : step]):
        return samples
    x = samples.astype(np.float64)
    runs = np.empty((MOST, 2), np.int64)
    runs = runs[: find_dropouts(x, 0.0, np.nan, runs)]
    if not len(runs):
        return samples
    fill(x, runs, np.nan)
    return x
