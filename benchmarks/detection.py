"""Impact detection beside the tools a user would pick instead: error against time.

Both synthetic recordings (`recordings.py`) are searched by impactsig, with defaults, and by the
peers, on the same array in the same process; tuned peers are tuned on the truth. Writes
results/detection.json, detection.md and detection.png.

    python -m benchmarks.detection            # needs: pip install -e ".[benchmarks]"
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np

import impactsig

from .detectors import (
    by_aubio,
    by_impactsig,
    by_librosa,
    find_peaks_above,
    find_peaks_passed,
    linear_crossings,
    sta_lta,
    timed,
    tuned,
)
from .recordings import PULSES, load_cell, microphone, score
from .saving import result_file, save, versions


def row(name: str, find: Callable, truth, tolerances) -> dict:
    """One line of the table: F1 at each tolerance, timing and contact time errors, speed."""
    (instants, contacts), seconds = timed(find, truth.samples, truth.rate)
    line = {"detector": name, "MS/s": len(truth.samples) / seconds / 1e6}
    for tolerance in tolerances:
        f1, rms, pairs = score(instants, truth.time, tolerance)
        line[f"F1 {tolerance * 1e3:g} ms"] = f1
        if tolerance == tolerances[0]:
            line["timing RMS us"] = rms * 1e6
            if contacts is not None and np.isfinite(truth.contact_time).all():
                error = (contacts[pairs[:, 0]] - truth.contact_time[pairs[:, 1]]) * 1e6
                line["contact bias us"] = error.mean()
                line["contact RMS us"] = np.sqrt(np.mean(error**2))
    return line


# -- tables ------------------------------------------------------------------------------------


def force_table() -> list[dict]:
    truth = load_cell()
    stations = {"sta": [1e-4, 3e-4, 1e-3], "lta": [0.01, 0.03, 0.1], "on": [3, 5, 8, 12]}
    detectors = [
        ("impactsig, defaults", by_impactsig("force")),
        ("scipy find_peaks, 0.6", find_peaks_above(lambda x: 0.6)),
        ("scipy find_peaks, mean + 4 sigma", find_peaks_above(lambda x: x.mean() + 4 * x.std())),
        ("band-pass, 5 MAD, find_peaks, widths x 1.5", find_peaks_passed),
        ("band-pass, 5 MAD, linear crossings", linear_crossings),
    ]
    for kind in ("classic", "recursive"):
        find, best = tuned(sta_lta(kind), stations, truth)
        detectors.append((f"obspy {kind} STA/LTA, tuned {best}", find))
    detectors.append(("librosa, default", by_librosa()))
    find, best = tuned(by_librosa, {"hop": [64], "delta": [0.02, 0.07, 0.2, 0.4]}, truth)
    detectors.append((f"librosa, tuned {best}", find))
    return [row(name, find, truth, [1e-3]) for name, find in detectors]


def sound_table() -> list[dict]:
    truth = microphone()
    detectors = [("impactsig, defaults", by_impactsig("sound"))]
    stations = {"sta": [1e-3, 2e-3, 4e-3], "lta": [0.02, 0.05, 0.1], "on": [2, 3, 4, 6]}
    for kind in ("classic", "recursive"):
        find, best = tuned(sta_lta(kind), stations, truth)
        detectors.append((f"obspy {kind} STA/LTA, tuned {best}", find))
    methods = {"method": ["hfc", "energy", "complex"], "threshold": [0.1, 0.3, 0.6]}
    find, best = tuned(by_aubio, methods, truth)
    detectors.append((f"aubio, tuned {best}", find))
    detectors.append(("librosa, default", by_librosa()))
    find, best = tuned(by_librosa, {"hop": [64, 128], "delta": [0.02, 0.07, 0.2]}, truth)
    detectors.append((f"librosa, tuned {best}", find))
    return [row(name, find, truth, [1e-3, 25e-3]) for name, find in detectors]


def shape_table() -> list[dict]:
    """Contact time on pulses of other shapes, five recordings of each."""
    lines = []
    for pulse in PULSES:
        errors, timings, scores = [], [], []
        for seed in range(5):
            truth = load_cell(pulse=pulse, seed=seed)
            found, contacts = by_impactsig("force")(truth.samples, truth.rate)
            f1, rms, pairs = score(found, truth.time)
            errors.append(contacts[pairs[:, 0]] - truth.contact_time[pairs[:, 1]])
            timings.append(rms)
            scores.append(f1)
        error = np.concatenate(errors) * 1e6
        lines.append(
            {
                "pulse": pulse,
                "F1 least of 5": min(scores),
                "timing RMS us, greatest of 5": max(timings) * 1e6,
                "contact bias us": error.mean(),
                "contact RMS us": np.sqrt(np.mean(error**2)),
            }
        )
    return lines


def skip_table() -> list[dict]:
    """What skipping saves: the same recording with and without, and how much of it is silent."""
    lines = []
    rng = np.random.default_rng(0)
    burst = load_cell(duration=2.0, noise=0.05, drift=False).samples
    for share in (0.0, 0.9, 0.99, 1.0):
        x = np.zeros(20_000_000)
        for start in range(0, len(x), len(burst)):
            if rng.random() >= share:
                x[start : start + len(burst)] = burst
        x[1000:1010] += 1.0
        rec = impactsig.Recording(x, 50_000.0)
        (kept, with_skip), (all_, without) = (
            timed(lambda y, rate, r=rec, s=s: impactsig.detect_impacts(r, skip_quiet=s), x, 5e4)
            for s in (True, False)
        )
        lines.append(
            {
                "silent share": share,
                "MS/s with": len(x) / with_skip / 1e6,
                "MS/s without": len(x) / without / 1e6,
                "gain": without / with_skip,
                "same result": bool(np.array_equal(kept.time, all_.time)),
            }
        )
    return lines


def timing_table() -> list[dict]:
    """How well sound is timed: the chaotic beam, heard alike each time or each time different.

    Median and RMS of what instants are off, a constant latency apart.
    """
    from dataclasses import replace

    beam = impactsig.scenes.karpodinis(20.1)
    motion = impactsig.simulate(beam, periods=4000, transient=900)
    truth = replace(motion.impacts, time=motion.impacts.time - motion.start, start=0.0)
    lines = []
    for rate, noise, phases in product(
        (8000.0, 22_050.0, 44_100.0, 96_000.0), (2e-3, 5e-3, 20e-3), ((0.3, 1.9, 4.0), None)
    ):
        near = impactsig.Microphone(distance=0.3, gain=0.15, noise=noise, phases=phases)
        sound = impactsig.synthesize(truth, near, rate=rate, bits=16, full_scale=1.0, seed=101)
        found = impactsig.detect_impacts(sound)
        f1, rms, pairs = score(found.time, truth.time, 3e-3)
        off = found.time[pairs[:, 0]] - truth.time[pairs[:, 1]]
        lines.append(
            {
                "rate": rate,
                "noise": noise,
                "sounds": "different" if phases is None else "alike",
                "F1 3 ms": f1,
                "timed by waveform": found.settings["alike"],
                "off us, median": 1e6 * float(np.median(np.abs(off - np.median(off)))),
                "off us, RMS": 1e6 * rms,
            }
        )
    return lines


def markdown(lines: list[dict]) -> str:
    columns = list(dict.fromkeys(key for line in lines for key in line))

    def shown(value) -> str:
        return f"{value:.4g}" if isinstance(value, float) else str(value)

    head = f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}\n"
    return head + "".join(
        f"| {' | '.join(shown(line.get(key, '–')) for key in columns)} |\n" for line in lines
    )


def figure(tables: dict[str, list[dict]], path: Path) -> None:
    from matplotlib.figure import Figure

    picture = Figure(figsize=(11, 4.5), layout="constrained")
    for ax, name in zip(picture.subplots(1, 2), ("load cell", "microphone"), strict=True):
        for k, line in enumerate(tables[name]):
            ax.loglog(
                1 / line["MS/s"],
                max(1 - line["F1 1 ms"], 1e-4),
                "*" if k == 0 else "osD^v<>ph"[k % 9],
                markersize=14 if k == 0 else 8,
                linestyle="none",
                label=line["detector"].split(", tuned")[0],
            )
        ax.legend(fontsize=7)
        ax.grid(alpha=0.3)
        ax.set(xlabel="time per sample [µs]", ylabel="1 − F1 at ±1 ms", title=name)
    picture.savefig(path, dpi=150)


def main() -> None:
    warnings.filterwarnings("ignore", category=UserWarning)
    tables = {
        "load cell": force_table(),
        "pulse shapes": shape_table(),
        "microphone": sound_table(),
        "timing of sound": timing_table(),
        "skipping": skip_table(),
    }
    about = versions("numpy", "scipy", "numba", "obspy", "librosa", "aubio")
    text = "".join(f"## {name}\n\n{markdown(lines)}\n" for name, lines in tables.items())
    save("detection", {"about": about, **tables}, text)
    figure(tables, result_file("detection.png"))
    print(text)


if __name__ == "__main__":
    main()
