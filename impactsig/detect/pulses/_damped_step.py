"""Steps of the method of Levenberg and Marquardt, from normal equations that a model fills.

Their lower triangle comes first, the right side is the last column.
"""

from __future__ import annotations

from ..._compiling.compiled import kernel
from ._small_matrices import factor, solve

FIRST, AGAIN, MOST = 1e-2, 0.01, 1e6
"""Damping at first, at least after a step that failed, and at most."""
UNBOUND = 1e-12
"""To be added to the diagonal where no prior binds a parameter that may change nothing."""


@kernel
def factor_damped(normal, damping, added, low):
    """Put the factors of the damped equations into `low`; False if they are not positive definite.

    `low` says how many parameters there are; `added` goes to the diagonal, UNBOUND for instance.
    """
    for i in range(len(low)):
        for j in range(i):
            low[i, j] = normal[i, j]
        low[i, i] = normal[i, i] * (1.0 + damping) + added
    return factor(low)


@kernel
def damped_step(normal, damping, added, low, step):
    """Put the damped step into `step`, and factors into `low`; whether there is one."""
    if not factor_damped(normal, damping, added, low):
        return False
    right = normal.shape[1] - 1
    for i in range(len(step)):
        step[i] = normal[i, right]
    solve(low, step)
    return True


@kernel
def more_damped(damping):
    """The damping after a step that failed."""
    return max(10.0 * damping, AGAIN)
