"""Standard errors of what force detection measures, against the errors that it makes.

Impacts of one shape and 6 to 40 dB (peak over the noise's standard deviation) in white noise, or of
one level, where no clear impacts show the shape of faint ones (`--level`). For each shape, rate and
level: the z-scores (error over standard error) of instants, contact times, peaks and impulses, as
root mean square and shares beyond 2 and 3 (4.6 and 0.3 % of a Gaussian); and the median standard
error of the instants over their Cramér-Rao bound, for a pulse of given shape whose amplitude, start
and length are not given.

Impacts of one second are measured by one shape, so errors of contact times, and much of those of
instants and peaks at high levels, are common to them: z-scores of few records lie outside 0.8-1.25
by chance. The last lines therefore give, beside the share of strata within that range, how many
contradict it, and which: those whose interval of 95 % over records (see `spread.py`) lies above or
below: for the root mean square of z, and for its standard deviation about the mean of the stratum
(what a shape is off by in every record is in the first only).

    python -m benchmarks.errors                     # the shapes of recordings.PULSES, seeds 11:23
    python -m benchmarks.errors --seeds 5:17 --shapes others --contact 0.3
    python -m benchmarks.errors --shapes laws       # contacts integrated from laws of force
    python -m benchmarks.errors --shapes strangers  # what neither the family nor a law makes
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
from scipy import integrate, signal

import impactsig

from .laws import LAWS
from .recordings import PULSES, Truth, add_pulses, score
from .saving import save
from .seeds import add_seeds
from .spread import WANTED, contradicted, spread_over_records, within
from .strangers import STRANGERS

RATES = (20_000.0, 50_000.0, 200_000.0)
LEVELS = (6.0, 10.0, 20.0, 30.0, 40.0)
OTHERS = {
    "sine^1.5": lambda u: np.sin(np.pi * u) ** 1.5,
    "raised cosine": lambda u: 0.5 * (1.0 - np.cos(2.0 * np.pi * u)),
    "skewed late": lambda u: np.sin(np.pi * u**1.3),
    "skewed early": lambda u: np.sin(np.pi * u**0.6),
}
GROUPS = {"recordings": PULSES, "others": OTHERS, "laws": LAWS, "strangers": STRANGERS}
SHAPES = PULSES | OTHERS | LAWS | STRANGERS
MEASURED = ("time", "contact_time", "peak", "impulse")
SPREADS = {"rms": False, "about mean": True}
"""Standard deviations of z: about 0 and about the mean of a stratum."""


def record(
    pulse: str,
    rate: float,
    seed: int,
    *,
    contact: float = 1e-3,
    count: int = 300,
    levels=LEVELS,
    cutoff: float = 0.0,
    step: float = 0.0,
    scatter: float = 0.0,
) -> Truth:
    """`count` impacts in noise of standard deviation 1, of random levels, gaps of 20-30 contacts.

    Contact times are log-normal, with the standard deviation `scatter` of their logarithms.
    Noise is white, or low-passed at the share `cutoff` of the Nyquist frequency; rounded to
    multiples of `step`.
    """
    rng = np.random.default_rng([seed, int(rate), list(SHAPES).index(pulse)])
    time = 0.05 + np.cumsum(contact * rng.uniform(20.0, 30.0, count))
    amplitude = 10.0 ** (rng.choice(levels, count) / 20.0)
    samples = rng.standard_normal(round((time[-1] + 0.05) * rate))
    if cutoff:
        samples = signal.sosfilt(signal.butter(4, cutoff, output="sos"), samples)
        samples /= samples.std()
    contacts = contact * np.exp(scatter * rng.standard_normal(count))
    add_pulses(samples, rate, time, contacts, amplitude, SHAPES[pulse])
    if step:
        samples = step * np.round(samples / step)
    return Truth(samples, rate, time, contacts, amplitude)


def cramer_rao(
    pulse: Callable, amplitude: float, samples: float, *, length_given: bool = False
) -> float:
    """Least standard error of the start, in contacts, of a pulse of `samples` samples.

    For noise of standard deviation 1, and amplitude, start and, unless given, length to be
    estimated. The sums over samples are taken as integrals.
    """
    u = np.linspace(0.0, 1.0, 4001)
    slope = np.gradient(pulse(u), u, edge_order=2)
    columns = np.stack([amplitude * slope, pulse(u), amplitude * u * slope])
    columns = columns[:2] if length_given else columns
    information = samples * integrate.trapezoid(columns[:, None] * columns[None], u, axis=-1)
    return float(np.sqrt(np.linalg.inv(information)[0, 0]))


def errors(pulse: str, rate: float, seed: int, **options) -> list[dict]:
    """Of each impact that is found: its level, and for each thing measured error and its guess."""
    truth = record(pulse, rate, seed, **options)
    found = impactsig.detect_impacts(
        impactsig.Recording(truth.samples, rate), polarity="positive", sensor="force"
    )
    contact = float(np.median(truth.contact_time))
    pairs = score(found.time, truth.time, 0.7 * contact)[2]
    u = np.linspace(0.0, 1.0, 4001)
    shape = SHAPES[pulse](u)
    true = {
        "time": truth.time,
        "contact_time": truth.contact_time,
        "peak": truth.amplitude * shape.max(),
        "impulse": truth.amplitude * truth.contact_time * integrate.trapezoid(shape, u),
    }
    rows = []
    for i, k in pairs:
        level = 20.0 * np.log10(truth.amplitude[k])
        row = {"pulse": pulse, "rate": rate, "level": round(level), "flags": int(found.flags[i])}
        row["bound"] = contact * cramer_rao(SHAPES[pulse], truth.amplitude[k], contact * rate)
        row["second"] = (seed, int(found.time[i]))
        for name in MEASURED:
            row[name] = float(getattr(found, name)[i] - true[name][k])
            row[f"{name}_error"] = float(getattr(found, f"{name}_error")[i])
        rows.append(row)
    return rows


def stratum(rows: list[dict]) -> dict:
    """The z-scores of some impacts, and their standard errors beside the bound."""
    line: dict = {"found": len(rows)}
    records = np.array([row["second"][0] for row in rows])
    for name in MEASURED:
        z = np.array([row[name] / row[f"{name}_error"] for row in rows])
        groups = [z[records == one] for one in np.unique(records)]
        spreads = {
            of: spread_over_records(groups, about_mean=about) for of, about in SPREADS.items()
        }
        line[name] = {of: spread for of, (spread, _, _) in spreads.items()}
        line[name] |= {
            "mean": float(z.mean()),
            "of 95 %": {of: ends for of, (_, *ends) in spreads.items()},
            "beyond 2": float(np.mean(np.abs(z) > 2)),
            "beyond 3": float(np.mean(np.abs(z) > 3)),
        }
    bound = np.array([row["bound"] for row in rows])
    line["error / bound"] = float(np.median([row["time_error"] for row in rows] / bound))
    line["RMS / bound"] = float(
        np.sqrt(np.mean((np.array([r["time"] for r in rows]) / bound) ** 2))
    )
    return line


def say_what_is_outside(lines: list[dict]) -> None:
    """Print how many strata are outside WANTED, and which contradict it."""
    for of in SPREADS:
        spread = np.array([[line[name][of] for name in MEASURED] for line in lines])
        print(f"z of {WANTED[0]}-{WANTED[1]} ({of}): {np.mean(within(spread)):.1%}", end="; ")
        print(f"above: {np.mean(spread > WANTED[1]):.1%}", end="; contradicted: ")
        outside: dict[str, list[str]] = {"above": [], "below": []}
        for line in lines:
            for name in MEASURED:
                low, high = line[name]["of 95 %"][of]
                side = contradicted(low, high)
                if not side:
                    continue
                words = f"{line['pulse']} {line['rate'] / 1e3:g} {line['level']:g} {name}"
                words += f" {line[name][of]:.2f} ({low:.2f}-{high:.2f})"
                outside[side].append(words)
        print(", ".join(f"{len(some)} {side}" for side, some in outside.items()))
        for side, some in outside.items():
            for words in some:
                print(f"  {side}: {words}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "11:23")
    parser.add_argument("--shapes", choices=GROUPS, default="recordings")
    parser.add_argument("--contact", type=float, default=1.0, help="contact time [ms]")
    parser.add_argument("--cutoff", type=float, default=0.0, help="of the noise, of Nyquist's")
    parser.add_argument("--step", type=float, default=0.0, help="of the converter, in sigma")
    parser.add_argument("--scatter", type=float, default=0.0, help="of the contact times")
    parser.add_argument("--level", type=float, help="of all impacts of a record [dB]")
    parser.add_argument("--count", type=int, default=300, help="impacts a record")
    parser.add_argument("--write", action="store_true", help="write results/errors.json")
    given = parser.parse_args()
    options = {"contact": 1e-3 * given.contact, "cutoff": given.cutoff, "step": given.step}
    options["scatter"] = given.scatter
    levels = LEVELS if given.level is None else (given.level,)
    options["levels"] = levels
    head = "".join(f"| {name}: z, >2, >3 [%]    " for name in MEASURED)
    print(f"{'shape, kS/s, dB':24} found {head}| error/bound RMS/bound")
    lines, every = [], []
    for pulse in GROUPS[given.shapes]:
        for rate in RATES:
            rows = [
                row
                for seed in given.seeds
                for row in errors(pulse, rate, seed, count=given.count, **options)
            ]
            every += rows
            for level in levels:
                here = [row for row in rows if row["level"] == level]
                name = f"{pulse[:12]:12} {rate / 1e3:4g} {level:4g}"
                if len(here) < 10:
                    print(f"{name:24} {len(here):5d}")
                    continue
                line = stratum(here)
                lines.append({"pulse": pulse, "rate": rate, "level": level} | line)
                cells = "".join(
                    f"| {one['rms']:5.2f} ({one['mean']:+5.2f}) {100 * one['beyond 2']:4.1f}"
                    f" {100 * one['beyond 3']:4.1f} "
                    for one in (line[name] for name in MEASURED)
                )
                print(
                    f"{name:24} {len(here):5d} {cells}"
                    f"| {line['error / bound']:6.2f} {line['RMS / bound']:6.2f}",
                    flush=True,
                )
    ratios = [row["time_error"] / row["bound"] for row in every]
    say_what_is_outside(lines)
    print(f"median error/bound: {np.median(ratios):.2f}", end="")
    for name, of in [(f"{one:g} dB", ("level", one)) for one in levels] + [
        (one, ("pulse", one)) for one in GROUPS[given.shapes]
    ]:
        few = [row["time_error"] / row["bound"] for row in every if row[of[0]] == of[1]]
        print(f"; {name}: {np.median(few):.2f}", end="")
    print()
    if given.write:
        save("errors", lines)


if __name__ == "__main__":
    main()
