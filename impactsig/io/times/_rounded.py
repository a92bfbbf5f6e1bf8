"""Rate of a uniform grid from rounded times."""

from __future__ import annotations

import numpy as np

_LIMITS = 64  # times that bound the grid at first; those it violates join them
_ROUNDS = 100
_SLACK = 1e-6  # of a step, for the tolerance of the solver
_TIES = 1 + 1e-6  # times half way between two digits are rounded either way


def step_bounds(times: np.ndarray, halves: np.ndarray) -> tuple[float, float] | None:
    """Bounds on the step of a uniform grid that rounds to `times`.

    Each time t_i lies within h_i of ``a + i b``. The extreme b under these constraints are two
    linear programs in two unknowns; only a few of the constraints bind, and those are found by
    adding what the solution so far violates most.

    Parameters
    ----------
    times, halves : ndarray, shape (n,)
        Rounded times [s] and half of the last printed digit of each [s].

    Returns
    -------
    tuple of float or None
        Bounds of b [s]; None if no grid rounds to these times.
    """
    from scipy.optimize import linprog

    index = np.arange(len(times))
    step = (times[-1] - times[0]) / index[-1]
    centre = index[-1] / 2
    # Unknowns near 0: shift of the middle and change of the span, both in steps.
    place = (index - centre) / index[-1]
    offset = (times - times[0]) / step - index
    half = halves * _TIES / step + _SLACK
    chosen = np.unique(np.linspace(0, len(times) - 1, _LIMITS).astype(np.intp))
    bounds = []
    for sign in (1.0, -1.0):
        for _ in range(_ROUNDS):
            rows = np.column_stack((np.ones(len(chosen)), place[chosen]))
            found = linprog(
                (0.0, sign),
                np.vstack((rows, -rows)),
                np.concatenate((offset[chosen] + half[chosen], half[chosen] - offset[chosen])),
                bounds=(None, None),
            )
            if not found.success:
                return None
            excess = np.abs(found.x[0] + found.x[1] * place - offset) - half
            worst = int(np.argmax(excess))
            if excess[worst] <= _SLACK:
                break
            chosen = np.append(chosen, worst)
        else:
            return None
        bounds.append(step * (1 + found.x[1] / index[-1]))
    return bounds[0], bounds[1]
