"""Impact times in cycles of a base period that is refined and followed through the run."""

from __future__ import annotations

import numpy as np

HARMONICS = np.arange(1, 9)
FIRST_WINDOW = 32.0  # [cycles]
BLOCK = 200  # impacts in which the phase is taken as steady
MOST_REFINED = 2000  # impacts used to refine the period; they are spread over the run


def to_cycles(time: np.ndarray, period: float, tolerance: float) -> tuple[np.ndarray, float]:
    """Impact times in cycles of the base period, slow drift of the phase removed.

    The period is first sought within `tolerance` (relative) of the one given, where the harmonics
    of the train are most coherent inside windows of a few cycles, then of ever more, up to a block
    of 200 impacts. Between blocks the phase is followed, so that neither a clock that is off nor
    one that drifts smears the phases of a long run.

    Returns
    -------
    cycles : ndarray, shape (n,)
    period : float
        The refined period [s], its mean over the run.
    """
    cycles = (time - time[0]) / period
    rate = _refine_rate(cycles, tolerance)
    cycles = cycles * rate
    if len(cycles) >= 2 * BLOCK:
        drift = _drift(cycles)
        cycles = cycles - drift
        if np.ptp(drift) > 0.1:  # enough to have blurred the blocks it was read from
            cycles = cycles - _drift(cycles)
    return cycles, float((time[-1] - time[0]) / (cycles[-1] - cycles[0]))


def harmonics(cycles: np.ndarray) -> np.ndarray:
    """exp(2 pi i h u) of every harmonic h, shape (8, n)."""
    turn = np.exp(2j * np.pi * cycles)
    power = np.empty((len(HARMONICS), len(cycles)), complex)
    power[0] = turn
    for h in range(1, len(HARMONICS)):  # by rows, in a third of cumprod's time
        np.multiply(power[h - 1], turn, out=power[h])
    return power


def _refine_rate(cycles: np.ndarray, tolerance: float) -> float:
    """Cycles of the best period per cycle of the one given."""
    rate, span = 1.0, cycles[-1]
    block = BLOCK * max(span / len(cycles), 1e-9)
    longest = min(span, block) * 1.001
    window = min(FIRST_WINDOW, longest)
    limits = rate - tolerance, rate + tolerance
    while True:
        # four samples to a peak of the highest harmonic
        step = 1 / (4 * window * HARMONICS[-1])
        count = int(np.ceil(tolerance / step))
        trial = np.clip(rate + step * np.arange(-count, count + 1), *limits)
        power = _coherence(cycles, window, trial)
        best = int(np.argmax(power))
        rate = float(np.clip(trial[best] + step * _vertex(power, best), *limits))
        if window >= longest:
            return rate
        tolerance = 2 * step
        window = min(8 * window, longest)


def _coherence(cycles: np.ndarray, window: float, trial: np.ndarray) -> np.ndarray:
    """Power of the harmonics inside windows, summed over harmonics and windows, per trial rate."""
    which = (cycles / window).astype(np.intp)
    if len(cycles) > MOST_REFINED:
        first = np.flatnonzero(np.diff(which, prepend=-1))
        size = len(cycles) / len(first)
        keep = max(int(MOST_REFINED / size), 1)
        kept = which[first[np.linspace(0, len(first) - 1, keep).astype(np.intp)]]
        inside = np.isin(which, kept)
        cycles, which = cycles[inside], which[inside]
    first = np.flatnonzero(np.diff(which, prepend=-1))
    centred = cycles - (which + 0.5) * window
    power = np.empty(len(trial))
    for k, rate in enumerate(trial):
        sums = np.add.reduceat(harmonics(rate * centred), first, axis=1)
        power[k] = np.vdot(sums, sums).real
    return power


def _drift(cycles: np.ndarray) -> np.ndarray:
    """Phase of the train against a steady clock [cycles], interpolated between blocks."""
    edges = np.linspace(0, len(cycles), len(cycles) // BLOCK + 1).astype(np.intp)
    sums = np.add.reduceat(harmonics(cycles), edges[:-1], axis=1)
    centre = np.add.reduceat(cycles, edges[:-1]) / np.diff(edges)
    shift = np.linspace(-0.1, 0.1, 201)
    turn = np.exp(-2j * np.pi * shift[:, None] * HARMONICS)
    phase = np.zeros(len(centre))
    template = sums[:, 0].copy()
    for k in range(1, len(centre)):
        turned = sums[:, k] * np.exp(-2j * np.pi * HARMONICS * phase[k - 1])
        overlap = ((turn * turned) @ template.conj()).real
        best = int(np.argmax(overlap))
        moved = shift[best] + (shift[1] - shift[0]) * _vertex(overlap, best)
        phase[k] = phase[k - 1] + moved
        # the template fades, so that it follows an orbit that slowly changes
        template = 0.8 * template + turned * np.exp(-2j * np.pi * HARMONICS * moved)
    drift = np.interp(cycles, centre, phase)
    for end, inner, beyond in ((0, 1, cycles < centre[0]), (-1, -2, cycles > centre[-1])):
        trend = (phase[end] - phase[inner]) / (centre[end] - centre[inner])
        drift[beyond] = phase[end] + trend * (cycles[beyond] - centre[end])
    return drift


def _vertex(values: np.ndarray, best: int) -> float:
    """Where between samples the parabola through the greatest and its neighbours peaks."""
    if not 0 < best < len(values) - 1:
        return 0.0
    below, peak, above = values[best - 1 : best + 2]
    curvature = below - 2 * peak + above
    return float(0.5 * (below - above) / curvature) if curvature < 0 else 0.0
