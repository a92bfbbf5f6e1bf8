"""Test of whether an envelope is exponential, as a mode with viscous damping has it."""

from __future__ import annotations

import numpy as np

from ._band import Band
from ._decay import Fit, _columns, _project, _real

BENDS = (2, 3)  # powers of time


def envelope_evidence(band: Band, fit: Fit) -> float:
    """p-value of the improvement of the fit by another envelope.

    The swings are multiplied by t^2 and t^3 besides: friction bends the logarithm of the envelope,
    and a frequency that depends on the amplitude turns the phase. Fisher's test of what these take
    from the residual.
    """
    from scipy.stats import f

    columns, slopes = _columns(band, fit.alpha, fit.omega)
    data = _real(band.values)
    coefficients, residual, _ = _project(columns, slopes, data)
    a, b = coefficients[:2]
    model = [a * slopes[:, 0] + b * slopes[:, 1], a * slopes[:, 2] + b * slopes[:, 3]]
    whole = np.column_stack([columns, *model, *_bent(band, fit)])
    whole /= np.linalg.norm(whole, axis=0)
    free = len(data) - whole.shape[1]
    before = float(residual @ residual)
    if free < 4 or before == 0.0:
        return 1.0
    left = residual - whole @ np.linalg.lstsq(whole, residual, rcond=None)[0]
    after = float(left @ left)
    if after <= 0.0:
        return 0.0
    extra = 2 * len(BENDS)
    return float(f.sf((before - after) / extra / (after / free), extra, free))


def _bent(band: Band, fit: Fit) -> list[np.ndarray]:
    """Transforms of the oscillation times powers of time, cosine and sine."""
    time = np.arange(band.count) / band.rate
    swing = np.exp(complex(-fit.alpha, fit.omega) * time)
    kept = slice(band.first, band.first + len(band.values))
    made = []
    for power in BENDS:
        bent = (time * fit.alpha) ** power * swing
        made += [_real(np.fft.rfft(part)[kept]) for part in (bent.real, bent.imag)]
    return made
