"""Background of a sound, local in time and frequency.

With M the mean powers of groups of frames,

    N_b(t) = quantile_10 %{ M_b within 4 s } / (1 - 2/9n - 1.2816 sqrt(2/9n))^3,
    L_b(t) = max(N_b(t), 1e-4 max{ M_b within 1 s }),

where n is the degrees of freedom of M: in Gaussian noise N is its power (Wilson and Hilferty). The
second bound says that 40 dB below the strongest sound nearby nothing counts. Digital silence is no
background: groups that it touches are left out of the quantile, as is what fades into it
(`fades.py`) and holes of codecs (`holes.py`).
"""

from __future__ import annotations

import numpy as np

from .holes import DEEP

QUANTILE, NORMAL_QUANTILE = 0.1, -1.2815515655446004
WITHIN = 4.0  # [s]
NEARBY = 1.0  # [s]


def quantile_bias(freedom: np.ndarray) -> np.ndarray:
    """Quantile of the mean of `freedom` squares of Gaussian noise, relative to its power."""
    spread = 2.0 / (9.0 * freedom)
    return (1.0 - spread + NORMAL_QUANTILE * np.sqrt(spread)) ** 3


def noise_power(
    means: np.ndarray, sounding: np.ndarray, bias: np.ndarray, holes: bool
) -> np.ndarray:
    """N of each band from means (bands, groups) and their bias; 0 if no group is `sounding`.

    With `holes`, what is DEEP below the strongest of a band is left out.
    """
    kept = means if sounding.all() else means[:, sounding]
    if not kept.shape[1]:
        return np.zeros(len(means))
    place = int(QUANTILE * kept.shape[1])
    if not holes:
        return np.partition(kept, place, axis=1)[:, place] / bias
    ordered = np.sort(kept, axis=1)
    empty = np.count_nonzero(ordered < DEEP * ordered[:, -1:], axis=1)
    places = empty + (QUANTILE * (kept.shape[1] - empty)).astype(int)
    return np.take_along_axis(ordered, places[:, None], axis=1)[:, 0] / bias
