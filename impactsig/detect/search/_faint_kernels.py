"""Kernel that finds the crests of one width, upward and downward, down to the noise."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import allocating
from ..signal.ladder import FACTOR, Ladder
from ._response_kernels import Stretch, block_means, crests_on


@allocating
def find_faint(here: Stretch, rung: int, least: float, out: np.ndarray) -> tuple[int, int]:
    """Upward, then downward crests of the responses of one width.

    Parameters
    ----------
    here : Stretch
    rung : int
    least : float
        Least response, in either direction.
    out : array (n, CREST), filled
        Crests, upward: centre, 0, response, response over noise.

    Returns
    -------
    (int, int)
        How many upward ones there are, and how many in all.
    """
    rungs, values = here.rungs, here.x
    level = int(rungs.level[rung])
    for _ in range(level):
        means = np.empty(len(values) // FACTOR)
        block_means(values, means)
        values = means
    one = Ladder(
        rungs.level[rung : rung + 1],
        rungs.unit[rung : rung + 1],
        rungs.near[rung : rung + 1],
        rungs.far[rung : rung + 1],
        rungs.gain[rung : rung + 1],
        rungs.width[rung : rung + 1],
    )
    block = FACTOR**level
    origin, total = here.origin // block, here.total // block
    first, last = here.first // block, here.last // block
    thresholds = np.full(1, least)
    upward = crests_on(values, origin, total, first, last, level, one, thresholds, out, 0)
    values = -values
    found = crests_on(values, origin, total, first, last, level, one, thresholds, out, upward)
    for k in range(found):
        out[k, 3] = out[k, 2] / here.noise[rung]
    return upward, found
