"""The recurrence plot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from .._kinds import checked
from ..axes import axes, title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...reconstruct.recurrences.recurrence import RecurrencePlot

MOST_PIXELS = 1000


@checked
def recurrence_plot(result: RecurrencePlot, ax: Axes | None = None) -> Axes:
    """Draw the recurrences as dark points, time to the right and upwards.

    Where the matrix is larger than 1000 by 1000, the darkness of a pixel is the square root of the
    share of recurrences in its square, so that single ones are seen.

    Parameters
    ----------
    result : RecurrencePlot
        From `impactsig.recurrence_plot`.

    See Also
    --------
    impactsig.recurrence_plot

    Examples
    --------
    >>> from impactsig import plot, recurrence_plot
    >>> ax = plot.recurrence_plot(recurrence_plot([0, 1, 0, 1], radius=0.5))
    """
    ax = axes(ax, width=4.4, height=4.2)
    count = len(result.matrix)
    block = -(-count // MOST_PIXELS)
    image = result.matrix
    if block > 1:
        first = np.arange(0, count, block)
        rows = np.add.reduceat(result.matrix, first, axis=0, dtype=np.int32)
        size = np.diff(np.append(first, count))
        image = np.add.reduceat(rows, first, axis=1) / np.outer(size, size)
        image = np.sqrt(image)
    edge = len(image) * block - 0.5
    ax.imshow(
        image, cmap="Greys", origin="lower", interpolation="nearest", vmin=0,
        extent=(-0.5, edge, -0.5, edge),
    )  # fmt: skip
    ax.set(xlim=(-0.5, count - 0.5), ylim=(-0.5, count - 0.5), aspect="equal")
    for axis, letter in ((ax.xaxis, "i"), (ax.yaxis, "j")):
        axis.set_major_locator(MaxNLocator(integer=True, nbins=5))
        axis.set_label_text(f"delay vector ${letter}$")
    title(ax, f"within {result.radius:.3g}, m = {result.dimension}")
    return ax
