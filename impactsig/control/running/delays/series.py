"""Arguments of the kernels of `_series`: sizes, work arrays, and instants where steps end."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

if TYPE_CHECKING:
    from ....simulation.basis.delay import Feedback

ORDER = 20  # of the series
FIT = 14  # degree of what is fitted through several rows
REACH = 1.5  # of a step, times the fastest rate: 1.5^21 / 21! is 1e-16
MOST_LAPS = 40


class SeriesRoom(NamedTuple):
    """Work arrays for a step."""

    nodes: np.ndarray  # (FIT + 1,) shares of a step
    fit: np.ndarray  # (FIT + 1, same) from values at nodes, a row each, to Chebyshev coefficients
    shifted: np.ndarray  # (FIT + 1, same) from these, a row each, to powers of the share
    inverse: np.ndarray  # (ORDER + 1,) 1 / (n + 1)
    binomial: np.ndarray  # (ORDER + 1, same)
    bernstein: np.ndarray  # (ORDER + 1, same, same) of a degree: powers, a row each, to Bernstein
    values: np.ndarray  # (2, FIT + 1)
    late: np.ndarray  # (ORDER + 1,) what is fed back from one delay before
    gap: np.ndarray  # (ORDER + 1,) of the control force to its limit
    q: np.ndarray  # (ORDER + 1,) position, from the origin of the mode
    v: np.ndarray  # (ORDER + 1,) velocity
    c: np.ndarray  # (ORDER + 1,) what a root is looked for of
    stack: np.ndarray  # (64, ORDER + 3) for `first_root`


def series_laps(feedback: Feedback) -> np.ndarray:
    """Number of delays after which an event or a limit still makes the force not smooth.

    m delays after a jump of the velocity the force under feedback of it has a jump gain^m times as
    high in its derivative of order m - 1, and under feedback of the displacement in that of order
    2 m - 1. A polynomial misses such a jump by about its height times (h/4)^n / n!, h the step and
    n the order. The limit bends the force: one order more.
    """
    from ....simulation.basis.delay import VELOCITY

    velocity = feedback.signal == VELOCITY
    gain = abs(feedback.gain)

    def missed(m: int) -> float:
        n = m - 1 if velocity else 2 * m - 1
        return float(gain**m * (REACH / 4) ** n / math.factorial(n))

    m = 1
    while missed(m) > 1e-16 and m < MOST_LAPS:
        m += 1
    limit = m - 3 if velocity else m - 2
    laps = np.array([m - 1, max(limit, 1)])
    memory = feedback.memory
    return laps + (math.ceil(math.log(1e-16) / math.log(memory)) if memory > 0 else 0)


def series_room() -> SeriesRoom:
    """Allocate work arrays for a step."""
    nodes, fit, shifted, inverse, binomial, bernstein = _tables()
    return SeriesRoom(
        nodes=nodes,
        fit=fit,
        shifted=shifted,
        inverse=inverse,
        binomial=binomial,
        bernstein=bernstein,
        values=np.zeros((2, FIT + 1)),
        late=np.zeros(ORDER + 1),
        gap=np.zeros(ORDER + 1),
        q=np.zeros(ORDER + 1),
        v=np.zeros(ORDER + 1),
        c=np.zeros(ORDER + 1),
        stack=np.zeros((64, ORDER + 3)),
    )


@lru_cache(maxsize=1)
def _tables() -> tuple[np.ndarray, ...]:
    """The constant tables among them."""
    n = np.arange(FIT + 1)
    nodes = (1 - np.cos(np.pi * n / FIT)) / 2
    fit = np.linalg.inv(chebyshev.chebvander(2 * nodes - 1, FIT))
    shifted = np.zeros(
        (FIT + 1, FIT + 1)
    )  # whole numbers: T_n(2 s - 1) = 2 (2 s - 1) T_n-1 - T_n-2
    shifted[0, 0], shifted[0, 1], shifted[1, 1] = 1.0, -1.0, 2.0
    for k in range(2, FIT + 1):
        shifted[:, k] = -2 * shifted[:, k - 1] - shifted[:, k - 2]
        shifted[1:, k] += 4 * shifted[:-1, k - 1]
    bernstein = np.zeros((ORDER + 1, ORDER + 1, ORDER + 1))
    for degree in range(1, ORDER + 1):
        for i in range(degree + 1):
            for j in range(i + 1):
                bernstein[degree, j, i] = math.comb(i, j) / math.comb(degree, j)
    bernstein[0, 0, 0] = 1.0
    binomial = np.array(
        [[math.comb(m, n) for n in range(ORDER + 1)] for m in range(ORDER + 1)], float
    )
    inverse = 1.0 / (1.0 + np.arange(ORDER + 1))
    by_row = np.ascontiguousarray
    return nodes, by_row(fit.T), by_row(shifted.T), inverse, binomial, bernstein
