"""Likelihood H of a rise in one octave, down to about 170 Hz.

The octaves of `_kernels.py` end near 1.4 kHz, and narrow bands extend over 23 ms: a low tone that
decays within 5 ms hardly raises either. So the wavelet has three further octaves, whose
coefficients last 2 to 8 frames. With F_b the mean power of octave b from a frame on, weighted by a
line that falls to zero, over 4 ms or four coefficients if that is longer, A_b that over as long
before it, L_b the background (`floor.py`), and M_b the median power of its LONG_PARTs within about
0.1 s, freed from its bias,

    H = max(3, n_b / 2 (x_b - 1 - ln x_b)),    x_b = F_b / max(A_b, L_b, M_b) > 1,

where n_b is the degrees of freedom of F_b: the logarithm of the likelihood ratio of a rise in
Gaussian noise of known power. A_b has few degrees of freedom. In varying noise it sometimes falls
far below its power, and the median prevents that from being taken for a rise. In a dense train of
impacts the median is the power half way between two of them.
"""

from __future__ import annotations

import numpy as np

from ._kernels import EDGE, Scale
from ._rise_kernels import DEEPEST, LONG_PART, LOW, OctaveMeans, low_powers, rise_likelihood

FEWEST = 4  # coefficients of a mean
CLEAR = 3.0  # H without a rise: smaller values mean little


class Rises:
    """Takes H window by window."""

    def __init__(self, scale: Scale) -> None:
        size = 2 ** (1 + np.arange(LOW))
        low = np.maximum(np.round(scale.forward / size).astype(int), FEWEST)
        width = np.concatenate((np.full(scale.octaves, scale.forward), low))
        per = np.concatenate((scale.hop / 2.0 ** (1 + np.arange(scale.octaves)), np.ones(LOW)))
        freedom = 1.5 * per * width * (width + 1.0) / (2.0 * width + 1.0)
        frames = np.concatenate((np.ones(scale.octaves), size))
        coefficients = LONG_PART * per / frames
        bias = (1.0 - 2.0 / (9.0 * coefficients)) ** 3
        clear = clear_ratio(*freedom.tolist())
        self.means = OctaveMeans(size, low, bias, freedom, clear)
        # Frames that a window needs beside it; whole coefficients, for cuts not to change them.
        self.margin = DEEPEST * (EDGE + FEWEST), DEEPEST * (EDGE + FEWEST + 1)

    def powers(
        self, x: np.ndarray, left: int, parts: int, scratch: list[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Powers of the low octaves, and their means over the LONG_PARTs of the core.

        x is what the octaves leave below them, one value a frame; `left` frames precede the core.
        `scratch` are three arrays of half the length of x.
        """
        power, means = np.empty((LOW, len(x) // 2)), np.empty((LOW, parts))
        low_powers(x, left, *scratch, power, means)
        return power, means

    def likelihood(
        self,
        every: np.ndarray,
        low: np.ndarray,
        left: int,
        parts: np.ndarray,
        first: int,
        background: np.ndarray,
        out: np.ndarray,
    ) -> None:
        """Put H of every STEP-th frame of a window in `out`.

        Parameters
        ----------
        every : ndarray
            Mean powers after and before every STEP-th frame, in each octave.
        low : ndarray
            Powers of the low octaves, from `left` frames before the first on.
        parts : ndarray
            Mean powers of LONG_PARTs of all octaves; the window begins with column `first`.
        background : ndarray
            L of all octaves, in BLOCKs, and of what follows them.
        """
        out[:] = CLEAR
        rise_likelihood(every, low, left, parts, first, background, self.means, out)


def clear_ratio(*freedom: float) -> np.ndarray:
    """The ratio x > 1 at which n / 2 (x - 1 - ln x) is CLEAR, for each n degrees of freedom."""
    x, level = np.full(len(freedom), 100.0), 2.0 * CLEAR / np.array(freedom)
    for _ in range(30):  # Newton's method from above, where the function is convex
        x -= (x - 1.0 - np.log(x) - level) / (1.0 - 1.0 / x)
    return x
