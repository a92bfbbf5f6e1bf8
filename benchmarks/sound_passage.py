"""A dense passage of sound: what is in it, what impactsig finds and what others do.

The record of `recordings.microphone` with 30 impacts a second, noise 20 dB below the median peak.
Prints F1 at 10 ms of each method after its best constant latency of up to 40 ms, with its defaults
and tuned on the truth itself, and draws the spectrogram of the densest second with the impacts,
those that are missed, and the instants of each method less its latency. librosa, SuperFlux (by
librosa) and obspy are left out where they are not installed. Writes
results/sound_passage.md and sound_passage.png.

    python -m benchmarks.sound_passage
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .detection import markdown
from .detectors import by_impactsig, by_librosa, find_peaks_passed, sta_lta, tuned
from .recordings import Truth, microphone, score
from .saving import result_file

TOLERANCE = 10e-3
LATE = tuple(np.arange(-40, 41, 10) * 1e-3)
"""About which a detector's latency is looked for: pickers centre their frames differently [s]."""
SPAN = 1.0
"""Of the passage that is drawn [s]."""
DISTANCES = [5e-3, 15e-3, 30e-3]


def by_superflux(hop=128, delta=0.07, lag=2) -> Callable:
    """SuperFlux, as librosa's documentation sets it up: 138 bands, the greatest of three nearby."""
    import librosa

    def find(x, rate):
        bands = librosa.feature.melspectrogram(
            y=x.astype(np.float32), sr=int(rate), n_fft=1024, hop_length=hop,
            fmin=27.5, fmax=min(16_000.0, 0.5 * rate), n_mels=138,
        )  # fmt: skip
        strength = librosa.onset.onset_strength(
            S=librosa.power_to_db(bands, ref=np.max),
            sr=int(rate),
            hop_length=hop,
            lag=lag,
            max_size=3,
        )
        return librosa.onset.onset_detect(
            onset_envelope=strength, sr=int(rate), hop_length=hop, delta=delta, units="time"
        ), None

    return find


def methods() -> dict[str, tuple[Callable, dict]]:
    """Each with what it is tuned over."""
    levels = {"level": [3.0, 5.0, 8.0, 12.0], "distance": DISTANCES}
    every: dict[str, tuple[Callable, dict]] = {
        "impactsig": (partial(by_impactsig, "sound"), {"least_probability": [0.1, 0.3, 0.5, 0.7]}),
        "band-pass": (partial(partial, find_peaks_passed), levels),
    }
    if find_spec("librosa"):
        every["librosa"] = (by_librosa, {"hop": [64, 128, 512], "delta": [0.02, 0.07, 0.2]})
        every["SuperFlux"] = (by_superflux, {"hop": [64, 128], "delta": [0.02, 0.07, 0.2]})
    else:
        print("librosa and SuperFlux are left out: librosa is not installed")
    if find_spec("obspy"):
        grid = {"sta": [1e-3, 2e-3, 4e-3], "lta": [0.02, 0.05, 0.1], "on": [2, 3, 4, 6]}
        every["STA/LTA"] = (sta_lta("classic"), grid)
    else:
        print("STA/LTA is left out: obspy is not installed")
    return every


def densest(time: np.ndarray) -> float:
    """Where the span with the most impacts begins [s]."""
    ends = np.searchsorted(time, time + 0.98 * SPAN)
    return float(time[np.argmax(ends - np.arange(len(time)))] - 0.01 * SPAN)


def draw(truth: Truth, found: dict[str, np.ndarray], path: Path) -> None:
    """Spectrogram of the passage, with the impacts above it and what each method finds."""
    first = densest(truth.time)
    part = slice(round(first * truth.rate), round((first + SPAN) * truth.rate))
    picture = Figure(figsize=(11, 6), layout="constrained")
    above, ax = picture.subplots(2, sharex=True, height_ratios=(0.22 * (len(found) + 1), 2))
    ax.specgram(
        truth.samples[part], NFFT=256, Fs=truth.rate, noverlap=224, xextent=(first, first + SPAN),
        cmap="magma", vmin=-90, vmax=-35,
    )  # fmt: skip
    ax.set(xlabel="time [s]", ylabel="frequency [Hz]", xlim=(first, first + SPAN))
    rows = {"impacts in the record": truth.time} | found
    for k, time in enumerate(rows.values()):
        _, _, pairs = score(time, truth.time, TOLERANCE)
        good = np.isin(np.arange(len(time)), pairs[:, 0])
        colour = "black" if k == 0 else "tab:green"
        for marked, mark, ink in ((good, "|", colour), (~good, "x", "tab:red")):
            at = time[marked & (time >= first) & (time < first + SPAN)]
            above.plot(at, np.full(len(at), -k), mark, color=ink, ms=9 if mark == "|" else 5)
        if k:
            missed = np.delete(truth.time, pairs[:, 1])
            missed = missed[(missed >= first) & (missed < first + SPAN)]
            above.plot(missed, np.full(len(missed), -k), "o", mfc="none", color="tab:orange", ms=5)
    above.set_yticks(-np.arange(len(rows)), list(rows), fontsize=8)
    above.set_ylim(-len(rows) + 0.4, 0.6)
    above.set_title("| found   x false   o missed", fontsize=9, loc="left")
    picture.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=501)
    parser.add_argument("--rate", type=float, default=30.0, help="impacts a second")
    parser.add_argument("--duration", type=float, default=20.0, help="of the record [s]")
    asked = parser.parse_args()
    truth = microphone(duration=asked.duration, mean_rate=asked.rate, seed=asked.seed)
    lines, drawn = [], {}
    for name, (make, grid) in methods().items():
        for best in (False, True):
            find, options = tuned(make, grid, truth, TOLERANCE, LATE) if best else (make(), {})
            time = np.asarray(find(truth.samples, truth.rate)[0])
            f1, _, pairs = score(time, truth.time, TOLERANCE, LATE)
            line = {"method": name, "settings": str(options) if best else "defaults", "F1": f1}
            line["precision"] = len(pairs) / max(len(time), 1)
            line["recall"] = len(pairs) / len(truth.time)
            late = np.median(time[pairs[:, 0]] - truth.time[pairs[:, 1]]) if len(pairs) else 0.0
            line["latency [ms]"] = 1e3 * late
            lines.append(line)
            drawn[name + ", tuned" * best] = time - late
    text = markdown(lines)
    print(text)
    result_file("sound_passage.md").write_text(text)
    draw(truth, drawn, result_file("sound_passage.png"))


if __name__ == "__main__":
    main()
