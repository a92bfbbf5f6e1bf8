"""A small picture of a recording as inline SVG; no plotting library needed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .recording import Recording

WIDTH, HEIGHT = 360, 60


def sparkline(recording: Recording) -> str:
    """The first channel as inline SVG; empty if it has no finite sample."""
    samples = recording.samples if recording.samples.ndim == 1 else recording.samples[:, 0]
    one = replace(recording, samples=samples, units=(), channels=())
    _, low, high = one.envelope(WIDTH)
    good = np.isfinite(low) & np.isfinite(high)
    if not good.any():
        return ""
    floor, ceiling = float(low[good].min()), float(high[good].max())
    scale = HEIGHT / ((ceiling - floor) or 1.0)
    x = np.arange(len(low)) * (WIDTH / len(low))
    top, bottom = HEIGHT - (high - floor) * scale, HEIGHT - (low - floor) * scale
    shown = np.flatnonzero(good)
    if len(low) == len(recording):  # a line, as there is but one sample in each span
        begins = good & ~np.concatenate(([False], good[:-1]))
        parts = [f"{'M' if begins[i] else 'L'}{x[i]:.1f} {top[i]:.1f}" for i in shown]
    else:
        parts = [f"M{x[i]:.1f} {bottom[i]:.1f}V{top[i] - 0.5:.1f}" for i in shown]
    return (
        f'<svg width="{WIDTH}" height="{HEIGHT}" role="img" aria-label="waveform">'
        f'<path d="{"".join(parts)}" stroke="#1f77b4" fill="none"/></svg>'
    )
