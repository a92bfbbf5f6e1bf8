"""How well impacts are timed in sound records that a linear-phase filter has band-limited.

A structure rings at fixed frequencies, in phases that are new at each impact; the record is made at
88 or 96 kHz, with instants between its samples, and brought to 8, 11 and 16 kHz by the decimators
that people use. Noise is 1/f and added afterwards. Beside impactsig: the first crossing of 30 % of
the peak, and of 20 % of the peak of the envelope, looked for about the true instant. Writes
results/sound_timing.json and sound_timing.md.

    python -m benchmarks.sound_timing                    # about five minutes
    python -m benchmarks.sound_timing --seeds 3:6 --modes five
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
from scipy import signal

import impactsig

from .detection import markdown
from .recordings import Truth, coloured, score
from .saving import save
from .seeds import add_seeds

MODES = {
    "sample": ((2140.0, 6e-3, 1.0), (3710.0, 4e-3, 0.6), (5930.0, 2e-3, 0.4)),
    "three": ((1600.0, 5e-3, 1.0), (2900.0, 3e-3, 0.8), (4400.0, 2e-3, 0.5)),
    "five": (
        (1500.0, 6e-3, 0.7),
        (2300.0, 4e-3, 1.0),
        (3300.0, 3e-3, 0.6),
        (5200.0, 2.5e-3, 0.6),
        (7100.0, 1.5e-3, 0.4),
    ),
}
TIMES = {8000: 12, 11_025: 8, 16_000: 6, 22_050: 4, 44_100: 2}  # the rate at which sounds are made
NOISES = 49.0, 20.0  # [dB] below the median peak


def linear_phase(x: np.ndarray, times: int) -> np.ndarray:
    """As `rate -h` of sox does: -6 dB at 0.95 of half the rate, nothing above half the rate."""
    taps = signal.firwin(128 * times + 1, 0.95 / times, window=("kaiser", 12.0))
    return signal.resample_poly(x, 1, times, window=taps)


DECIMATORS: dict[str, Callable[[np.ndarray, int], np.ndarray]] = {
    "resample": lambda x, times: signal.resample(x, len(x) // times),
    "resample_poly": lambda x, times: signal.resample_poly(x, 1, times),
    "decimate": signal.decimate,
    "sox": linear_phase,
}


def train(seed: int, count: int, gap: float = 0.045) -> impactsig.Impacts:
    """Impacts 0.6 to 1.4 gaps apart, of log-normal strengths (sigma 0.35)."""
    rng = np.random.default_rng(seed)
    time = 0.1 + np.cumsum(gap * rng.uniform(0.6, 1.4, count))
    impacts = impactsig.Impacts.from_times(time, start=0.0, duration=time[-1] + 0.2)
    return replace(impacts, peak=np.exp(0.35 * rng.standard_normal(count)))


def band_limited(
    rate: int, decimator: str, noise: float, seed: int, *, modes, count: int = 200, phases=None
) -> Truth:
    """A record at `rate`; `noise` dB below the median peak. No decimator: sampled as it is."""
    times = TIMES[rate] if decimator else 1
    impacts = train(seed, count)
    near = impactsig.Microphone(distance=1e-9, gain=1e-9, modes=modes, phases=phases)
    sound = impactsig.synthesize(impacts, near, rate=float(times * rate), seed=seed).samples
    x = sound[: len(sound) // times * times]
    if decimator:
        x = DECIMATORS[decimator](x, times)
    first = (impacts.time * rate).astype(int)
    peaks = [np.abs(x[k : k + round(4e-3 * rate)]).max() for k in first]
    level = np.median(peaks) * 10 ** (-noise / 20)
    x = x + level * coloured(np.random.default_rng([seed, 1]), len(x), rate)
    return Truth(x, float(rate), impacts.time, np.full(count, np.nan), impacts.peak)


def crossing(truth: Truth, share: float, envelope: bool) -> np.ndarray:
    """Where the high-passed sound, or its envelope, first exceeds a share of its peak."""
    high = signal.butter(4, 800.0, "highpass", fs=truth.rate, output="sos")
    y = signal.sosfiltfilt(high, truth.samples)
    found = []
    for start in truth.time:
        first = int((start - 6e-3) * truth.rate)
        part = y[first : first + round(16e-3 * truth.rate)]
        size = np.abs(signal.resample(signal.hilbert(part) if envelope else part, 8 * len(part)))
        near = slice(*(8 * round(t * truth.rate) for t in (4e-3, 10e-3)))
        above = np.flatnonzero(size[near] >= share * size[near].max())
        found.append((first + (near.start + above[0]) / 8) / truth.rate)
    return np.array(found)


def scatter(found: np.ndarray, truth: Truth) -> tuple[float, float, float]:
    """F1 at 3 ms; standard deviation of the errors, and 1.48 times their median size [us]."""
    f1, deviation, pairs = score(found, truth.time, 3e-3)
    off = found[pairs[:, 0]] - truth.time[pairs[:, 1]]
    return f1, 1e6 * deviation, 1.4826e6 * float(np.median(np.abs(off - np.median(off))))


def line(rate: int, decimator: str, noise: float, name: str, seeds) -> dict:
    """One row: the least F1, the scatter in all records, and the greatest in one of some seeds."""
    rows = []
    for seed in seeds:
        truth = band_limited(rate, decimator, noise, seed, modes=MODES[name])
        recording = impactsig.Recording(truth.samples, truth.rate, sensor="sound")
        f1, deviation, middle = scatter(impactsig.detect_impacts(recording).time, truth)
        plain = [scatter(crossing(truth, *how), truth)[1] for how in ((0.3, False), (0.2, True))]
        rows.append((-f1, deviation, middle, *plain))
    f1, *others = np.max(rows, axis=0)
    head = {"rate": rate, "decimator": decimator, "noise dB": -noise, "modes": name, "F1": -f1}
    columns = ("impactsig us", "1.48 MAD us", "30 % of peak us", "20 % of envelope us")
    row = {key: round(float(value)) for key, value in zip(columns, others, strict=True)}
    together = float(np.sqrt(np.mean(np.square(rows), axis=0)[1]))  # all have as many impacts
    return head | {"impactsig, all seeds us": round(together)} | row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "101:104")
    parser.add_argument("--modes", nargs="+", default=list(MODES), choices=list(MODES))
    asked = parser.parse_args()
    lines = []
    for noise, name, rate, decimator in product(
        NOISES, asked.modes, (8000, 11_025, 16_000), DECIMATORS
    ):
        lines.append(line(rate, decimator, noise, name, asked.seeds))
        print(*lines[-1].values(), flush=True)
    head = "Standard deviation of the instants, of all seeds and the greatest of one.\n\n"
    save("sound_timing", lines, head + markdown(lines))


if __name__ == "__main__":
    main()
