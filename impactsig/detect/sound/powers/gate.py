"""Noise gates: powers as if the sound before a digital silence went on.

A gate opens and closes in steps, and what sounds before it opens begins at once when it does. Both
raise the power of octaves and bands as an impact does. So steps become ramps, and silence has the
power that the sound before it ends with. The background leaves silence out (`floor.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .._core_kernels import limits_of
from .._kernels import EDGE, GROUP, Scale
from .._nearby import greatest_within
from ._gate_kernels import (
    CLOSED,
    bridge,
    heard_shares,
    hold,
    hold_bands,
    renew_powers,
    silent_frames,
    silent_samples,
    soften,
)
from .bands import Bands

RAMP = 4e-3  # [s]


@dataclass
class Gate:
    """Fills digital silence window by window with the sound before it."""

    scale: Scale
    rate: float
    bands: Bands
    octaves_held: np.ndarray = field(init=False)
    bands_held: np.ndarray = field(init=False)
    share: float = field(init=False)  # of the last audible window of the narrow bands
    silent: np.ndarray | None = field(init=False)  # samples of this window, if any

    def begin(self) -> None:
        """Reset at the beginning of a segment."""
        self.octaves_held = np.zeros(self.scale.octaves)
        self.bands_held = np.zeros(len(self.bands.first))
        self.share, self.silent = 1.0, None

    def bridged(
        self, x: np.ndarray, power: np.ndarray, rest: np.ndarray, cores: np.ndarray
    ) -> np.ndarray:
        """Samples without silences too short to be held; their powers are renewed.

        `power` is that of the octaves of x, and `rest` what is left below them, in frames; `cores`
        are those that x contains.
        """
        least, greatest, step = limits_of(cores)
        if step == np.inf or power[0].min() > 0.0:
            return x
        hop = self.scale.hop
        out, changed = np.empty(len(x)), np.zeros(power.shape[1], np.bool_)
        if not bridge(x, hop, step, least, greatest, out, changed):
            return x
        renew_powers(out, hop, greatest_within(changed, EDGE), power, rest)
        return out

    def octaves(
        self, x: np.ndarray, power: np.ndarray, real: tuple[int, int], core: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Samples with ramps, and the powers of their frames; `core` of these lie in the window.

        Frames are silent only between those of `real`.
        """
        hop, past = self.scale.hop, self.scale.past
        next_held = min(core + past + 1, power.shape[1] - 1)  # a silence there has its power
        self.silent = None
        if power[0, slice(*real)].min(initial=1.0) == 0.0:
            closed, silent = np.empty(power.shape[1], np.bool_), np.empty(len(x), np.bool_)
            runs, count = np.empty((len(closed) // CLOSED, 2), np.int64), 0
            if silent_frames(power, *real, closed):
                count = silent_samples(x, closed, hop, silent, runs)
            if count:
                self.silent, x, power = silent, x.astype(float), power.copy()
                changed = np.zeros(len(closed), np.bool_)
                soften(x, runs[:count], round(RAMP * self.rate), hop, changed)
                wanted = greatest_within(changed, EDGE) & ~closed
                renew_powers(x, hop, wanted, power, np.empty(len(closed)))
                hold(power, closed, past, self.octaves_held)
        self.octaves_held = power[:, next_held].copy()
        return x, power

    def fill_narrow(self, power: np.ndarray, left: int) -> np.ndarray:
        """Complete the powers of the narrow bands (bands, frames); where the gate closes in them.

        The window of the first frame is centred on x[left].
        """
        closes = np.zeros(power.shape[1], np.bool_)
        if self.silent is None:
            self.share = 1.0
            return closes
        share = np.empty(power.shape[1])
        heard_shares(self.silent, left, GROUP * self.scale.hop, self.bands.window, share)
        np.less(share, np.append(self.share, share[:-1]), out=closes)
        hold_bands(power, share, closes, self.bands_held)
        self.share = share[-1]
        return closes
