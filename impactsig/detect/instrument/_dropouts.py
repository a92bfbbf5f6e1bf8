"""Fill the dropouts of a record; see `dropout_kernels.py`."""

from __future__ import annotations

import numpy as np

from .dropout_kernels import MOST, fill, find_dropouts


def without_dropouts(samples: np.ndarray) -> np.ndarray:
    """The samples, or a copy with filled dropouts if there are any."""
    x = samples.astype(np.float64)
    runs = np.empty((MOST, 2), np.int64)
    runs = runs[: find_dropouts(x, 0.0, np.nan, runs)]
    if not len(runs):
        return samples
    fill(x, runs, np.nan)
    return x
