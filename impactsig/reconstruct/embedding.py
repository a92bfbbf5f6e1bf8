"""Delay vectors of a series."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arguments import whole
from ..errors import InvalidInput
from ._series import known, series, unbroken


def delay_embed(x: Any, dimension: int, delay: int = 1) -> np.ndarray:
    """Delay vectors of a series, the oldest coordinate first [Takens1981]_.

    Row i is (x_i, x_{i+delay}, ..., x_{i+(m-1) delay}), i = 0 ... n - 1 - (m-1) delay, counted from
    0, with m the dimension. The intervals of an integrate-and-fire model embed like samples of a
    coordinate [Sauer1994]_; for them the natural delay is 1.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s]. No vector reaches
        across a gap of the run.
    dimension : int
        m, coordinates of a vector, 1 or more.
    delay : int
        Between two coordinates, in values of the series, 1 or more.

    Returns
    -------
    ndarray, shape (n - (dimension - 1) * delay, dimension)
        Delay vectors, a read-only view (of `x` itself if that is a contiguous float64 array). If
        the run has gaps, there are fewer vectors, and they are a copy.

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, or too short for one vector.

    See Also
    --------
    embedding_delay, false_nearest_neighbors

    Examples
    --------
    >>> from impactsig import delay_embed
    >>> delay_embed([0, 1, 2, 3, 4], dimension=2, delay=2)
    array([[0., 2.],
           [1., 3.],
           [2., 4.]])
    """
    dimension, delay = whole("dimension", dimension, 1), whole("delay", delay, 1)
    values = series(x, least=1, gap=1)
    span = (dimension - 1) * delay + 1
    usable = unbroken(values, span)
    if not usable.any():
        raise InvalidInput(
            "x",
            f"{len(known(values))} values",
            f"at least {span} for dimension {dimension}, delay {delay}"
            + (", all of them between the same gaps" if np.isnan(values).any() else ""),
        )
    vectors = np.lib.stride_tricks.sliding_window_view(values, span)[:, ::delay]
    if usable.all():
        return vectors
    kept = vectors[usable]
    kept.flags.writeable = False
    return kept
