"""Strikes on a part that still rings from the strikes before them.

Every record has its own modes, of 400 Hz to 8 kHz or 0.42 of the rate, in new phases at each strike
of a contact of 0.3 ms, and 1/f noise 20 dB below the median peak. Prints the mean F1 (10 ms) for 2,
6 and 12 modes, the median of the scatter of the instants (by the median deviation), and that of the
errors over those stated (RMS).

    python -m benchmarks.ringing --seeds 300:304
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np
from scipy import signal

from impactsig import Recording, detect_impacts
from impactsig._numerics.spread import DEVIATION_BY_MEDIAN

from .recordings import coloured, score
from .seeds import add_seeds

RATES = 8000, 22_050, 44_100
MODES = 2, 6, 12
STRIKES = (
    (0.2, (0.3, 0.6)),
    (0.5, (0.3, 0.6)),
    (0.5, (0.1, 0.3)),
    (1.0, (0.05, 0.6)),
    (0.1, (0.03, 0.1)),
)
"""Mean time between strikes, and time constants of the decays [s]."""
SECONDS, CONTACT, BELOW = 12.0, 0.3e-3, 20.0
TOLERANCE = 10e-3  # [s]


def struck(
    rate: int,
    modes: int,
    every: float,
    decays: tuple[float, float],
    seed: int,
    phases: np.ndarray | None = None,
    lowest: float = 400.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Samples and instants of strikes; each has phases of its own, unless `phases` are given.

    The modes have frequencies from `lowest` [Hz] on.
    """
    rng = np.random.default_rng([seed, rate, modes])
    gaps = every * rng.uniform(0.6, 1.4, int(2 * SECONDS / every))
    time = 0.15 + np.cumsum(gaps)
    time = time[time < SECONDS - 0.1]
    tones = rng.uniform(lowest, min(0.42 * rate, 8000.0), modes)
    decay, share = rng.uniform(*decays, modes), rng.uniform(0.4, 1.0, modes)
    x = np.zeros(round(SECONDS * rate))
    for start, strength in zip(time, np.exp(0.3 * rng.standard_normal(len(time))), strict=True):
        first = int(np.ceil(start * rate))
        since = (np.arange(first, min(first + int(12 * max(decay) * rate), len(x))) / rate) - start
        phase = rng.uniform(0.0, 2.0 * np.pi, modes) if phases is None else phases
        for tone, tau, part, at in zip(tones, decay, share, phase, strict=True):
            wave = np.exp(-since / tau) * np.sin(2.0 * np.pi * tone * since + at)
            x[first : first + len(since)] += strength * part * wave
    size = max(round(CONTACT * rate), 2)
    push = np.sin(np.pi * (np.arange(size) + 0.5) / size)
    x = signal.fftconvolve(x, push / push.sum())[: len(x)]
    peaks = [np.abs(x[int(a * rate) : int((a + 5e-3) * rate)]).max() for a in time]
    noise = np.median(peaks) * 10 ** (-BELOW / 20.0)
    return x + noise * coloured(rng, len(x), rate), time


def measured(
    x: np.ndarray, rate: int, time: np.ndarray, tolerance: float = TOLERANCE
) -> tuple[float, float, float]:
    """F1, scatter of the instants [s], and their RMS in standard errors."""
    found = detect_impacts(Recording(x, rate, sensor="sound"))
    f1, _, pairs = score(found.time, time, tolerance)
    if not len(pairs):
        return f1, np.nan, np.nan
    off = found.time[pairs[:, 0]] - time[pairs[:, 1]]
    off = off - np.median(off)
    scatter = DEVIATION_BY_MEDIAN * float(np.median(np.abs(off)))
    return f1, scatter, float(np.sqrt(np.mean((off / found.time_error[pairs[:, 0]]) ** 2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "300:304")
    seeds = parser.parse_args().seeds
    warnings.simplefilter("ignore")
    print("every [s], decays [s], rate [Hz]: F1 of 2, 6, 12 modes; scatter [us], errors / stated")
    for every, decays in STRIKES:
        for rate in RATES:
            made = [[struck(rate, modes, every, decays, seed) for seed in seeds] for modes in MODES]
            rows = np.array([[measured(x, rate, time) for x, time in row] for row in made])
            f1 = ", ".join(f"{value:.2f}" for value in rows[:, :, 0].mean(axis=1))
            scatter, z = np.nanmedian(rows[:, :, 1:], axis=(0, 1))
            print(f"{every}, {decays}, {rate}: {f1}; {1e6 * scatter:.0f}, {z:.1f}", flush=True)


if __name__ == "__main__":
    main()
