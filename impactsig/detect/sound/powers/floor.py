"""Background of a sound, local in time and frequency.

With M the mean powers of groups of frames,

    N_b(t) = quantile_10 %{ M_b within 4 s } / (1 - 2/9n - 1.2816 sqrt(2/9n))^3,
    L_b(t) = max(N_b(t), 1e-4 max{ M_b within 1 s }),

where n is the degrees of freedom of M: in Gaussian noise N is its power (Wilson and Hilferty). The
second bound says that 40 dB below the strongest sound nearby nothing counts. Digital silence is no
background: groups that it touches are left out of the quantile, as is what fades into it
(`fades.py`), what a gate attenuates (`closings.py`) and holes of codecs (`holes.py`).
"""

from __future__ import annotations

import numpy as np

from ._floor_kernels import low_quantiles
from .holes import DEEP

QUANTILE, NORMAL_QUANTILE = 0.1, -1.2815515655446004
WITHIN = 4.0  # [s]
NEARBY = 1.0  # [s]


def quantile_bias(freedom: np.ndarray) -> np.ndarray:
    """Quantile of the mean of `freedom` squares of Gaussian noise, relative to its power."""
    spread = 2.0 / (9.0 * freedom)
    return (1.0 - spread + NORMAL_QUANTILE * np.sqrt(spread)) ** 3


def noise_power(
    means: np.ndarray,
    sounding: np.ndarray,
    spans: np.ndarray,
    bias: np.ndarray,
    holes: bool,
) -> np.ndarray:
    """N of each band and window (bands, windows); 0 if no group is `sounding`.

    Parameters
    ----------
    means : (bands, groups)
    sounding : which groups count
    spans : first group of each window, and before which it ends (2, windows); neither falls
    bias : that of the means, by `quantile_bias`
    holes : bool
        Whether what is DEEP below the strongest of a band is left out.
    """
    out = np.empty((len(means), spans.shape[1]))
    low_quantiles(means, sounding, spans, QUANTILE, DEEP if holes else 0.0, bias, out)
    return out
