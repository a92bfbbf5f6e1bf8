"""A resonance in its spectrum, and its decay."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import BLUE, GREY, VERMILLION, axes, frame, seconds, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...identify.resonance import Resonance


@checked
def resonance(result: Resonance, ax: Axes | None = None) -> Axes:
    """Draw the power spectral density in the band with the fitted one and the estimates.

    Parameters
    ----------
    result : Resonance
        From `identify_resonance`.

    See Also
    --------
    impactsig.identify_resonance, impactsig.plot.decay

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Recording, identify_resonance, plot
    >>> time = np.arange(5000) / 1000
    >>> swings = np.exp(-0.7 * time) * np.cos(140 * time)
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal(5000)
    >>> found = identify_resonance(Recording(swings + noise, 1000), "decay")
    >>> ax = plot.resonance(found)
    """
    ax = axes(ax)
    ax.semilogy(result.frequency, result.density, color=BLUE, linewidth=0.7, label="recording")
    text = f"{result.natural_frequency:.5g} Hz, damping ratio {result.damping_ratio:.3g}"
    ax.semilogy(result.frequency, result.model, color=VERMILLION, linewidth=1.3, label=text)
    ax.axvline(result.natural_frequency, color=GREY, linewidth=0.8, linestyle=":", zorder=1)
    # Single ordinates of a periodogram may be next to nothing.
    ax.set_ylim(bottom=0.2 * float(np.quantile(result.density, 0.02)))
    ax.set_xlim(result.frequency[0], result.frequency[-1])
    density = with_unit("power density", f"{result.unit}^2/Hz" if result.unit else "1/Hz")
    return frame(ax, "frequency [Hz]", density, "above")


@checked
def decay(result: Resonance, ax: Axes | None = None) -> Axes:
    """Draw the envelope of a decay over time, with the fitted decay.

    Parameters
    ----------
    result : Resonance
        From `identify_resonance`, from a decay.

    See Also
    --------
    impactsig.identify_resonance, impactsig.plot.resonance

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Recording, identify_resonance, plot
    >>> time = np.arange(5000) / 1000
    >>> swings = np.exp(-0.7 * time) * np.cos(140 * time)
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal(5000)
    >>> found = identify_resonance(Recording(swings + noise, 1000), "decay")
    >>> ax = plot.decay(found)
    """
    ax = axes(ax)
    time, size = result.envelope_time[:-2], result.envelope[:-2]
    ax.semilogy(time, size, color=BLUE, marker="o", markersize=3, linewidth=0.7, label="swings")
    rate = 2 * np.pi * result.natural_frequency * result.damping_ratio
    first = min(2, len(size) - 1)
    line = size[first] * np.exp(-rate * (time - time[first]))
    shown = line > size.min()
    label = f"damping ratio {result.damping_ratio:.3g}"
    ax.semilogy(time[shown], line[shown], color=VERMILLION, linewidth=1.2, label=label)
    seconds(ax.xaxis, "time", time)
    return frame(ax, None, with_unit("swing", result.unit), "above")
