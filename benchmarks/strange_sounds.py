"""Standard errors of instants in sounds unlike those of `sound_errors`.

Each record draws one of each: how a sound begins (at once, under a contact of 0.1 to 2 ms, by a
soft onset of 1 to 5 ms, in two steps, as a burst of noise), whether impacts share its modes (own,
shared, alike, and nearly so: frequencies, or strengths and phases, that vary a little from impact
to impact), how many modes it has and how fast they decay, what it stands in (white or 1/f noise,
hum, a room, 8 bits), the rate and the filter before the sampler. Prints the same as
`sound_errors` for each choice, over all records that have it. What `detect/sound/_growth.py` and
`timing/_shift_errors.py` assume of them was chosen on seeds 1 to 400 and looked at on 1001 to 1400.
Writes results/strange_sounds.json.

    python -m benchmarks.strange_sounds --seeds 1:301        # about five minutes
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
from scipy import signal

from .recordings import Truth, coloured
from .saving import save
from .seeds import add_seeds
from .sound_errors import errors, stratum
from .sound_timing import DECIMATORS
from .spread import within

BEGINNINGS = ("at once", "contact", "long contact", "soft", "very soft", "two steps", "burst")
KINDS = ("own", "shared", "alike", "nearly shared", "nearly alike")
ROOMS = ("white", "1/f", "hum", "room", "8 bit")
RATES = {8000: 12, 11_025: 8, 16_000: 6, 22_050: 4, 32_000: 3, 44_100: 2, 48_000: 2}
LEVELS = (6.0, 10.0, 15.0, 20.0, 30.0, 40.0)
COUNT = 80


class Modes(NamedTuple):
    """Frequencies [Hz], decays [s], strengths and phases of the modes of a sound."""

    tone: np.ndarray
    decay: np.ndarray
    share: np.ndarray
    phase: np.ndarray


def rung(since: np.ndarray, modes: Modes, contact: float) -> np.ndarray:
    """Modes struck at 0 by a half-sine force of this duration (0: an impulse)."""
    out = np.zeros(len(since))
    within = np.clip(since, 0.0, contact)
    for tone, decay, share, phase in zip(*modes, strict=True):
        pole = 2j * np.pi * tone - 1.0 / decay
        ringing = np.exp(pole * since + 1j * phase)
        if contact:
            w = np.pi / contact
            held = w - np.exp(-pole * within) * (pole * np.sin(w * within) + w * np.cos(w * within))
            ringing *= w * held / (pole**2 + w**2)
        out += share * ringing.imag
    return np.where(since >= 0.0, out, 0.0)


def begun(rng, beginning: str, since: np.ndarray, modes: Modes, lasting: float) -> np.ndarray:
    """A sound of peak 1 that begins at 0 in one of the ways; `lasting` is that of the record."""
    if beginning == "burst":
        out = np.exp(-since / modes.decay.max()) * rng.standard_normal(len(since))
    else:
        out = rung(since, modes, lasting if "contact" in beginning else 0.0)
    if "soft" in beginning:
        out *= np.sin(0.5 * np.pi * np.minimum(since / lasting, 1.0)) ** 2
    if beginning == "two steps":
        out = 0.3 * out + rung(since - lasting, modes, 0.0)
    return out / np.abs(out).max()


LASTING = {  # [s], of the beginning
    "contact": (0.1e-3, 0.5e-3),
    "long contact": (0.5e-3, 2e-3),
    "soft": (1e-3, 2.5e-3),
    "very soft": (2.5e-3, 5e-3),
    "two steps": (0.5e-3, 2e-3),
}


def drawn_modes(rng, top: float) -> Modes:
    """One to twelve modes, of 1 to 8 kHz at most."""
    number = int(rng.choice([1, 2, 4, 8, 12]))
    slowest = np.exp(rng.uniform(np.log(2e-3), np.log(20e-3)))
    return Modes(
        np.exp(rng.uniform(np.log(1000.0), np.log(top), number)),
        np.exp(rng.uniform(np.log(0.8e-3), np.log(slowest), number)),
        rng.uniform(0.2, 1.0, number),
        rng.uniform(0.0, 2.0 * np.pi, number),
    )


def varied(rng, kind: str, modes: Modes, top: float) -> Modes:
    """The modes of one impact of a record."""
    if kind == "own":
        return drawn_modes(rng, top)
    number = len(modes.tone)
    if "alike" not in kind:
        modes = modes._replace(phase=rng.uniform(0.0, 2.0 * np.pi, number))
    if kind == "nearly shared":
        modes = modes._replace(tone=modes.tone * (1.0 + 0.01 * rng.standard_normal(number)))
    if kind == "nearly alike":
        share = modes.share * np.exp(0.2 * rng.standard_normal(number))
        modes = modes._replace(share=share, phase=modes.phase + 0.2 * rng.standard_normal(number))
    return modes


def record(seed: int, **asked: object) -> tuple[Truth, dict]:
    """A record and what was drawn for it, but for what is `asked`."""
    rng = np.random.default_rng([seed, 77])
    drawn = {"rate": int(rng.choice(list(RATES))), "level": float(rng.choice(LEVELS))}
    for name, choices in (("beginning", BEGINNINGS), ("kind", KINDS), ("in", ROOMS)):
        drawn[name] = str(rng.choice(choices))
    drawn["filter"] = str(rng.choice([*DECIMATORS, ""]))
    drawn |= asked
    rate, level, beginning, kind, room, decimator = drawn.values()
    times = RATES[rate]
    top = min(8000.0, 0.42 * rate)
    if beginning == "burst" and not decimator:
        drawn["filter"] = decimator = "sox"  # its noise would be folded otherwise
    if not decimator:
        times = 1
    lasting = float(np.exp(rng.uniform(*np.log(LASTING.get(beginning, (1.0, 1.0))))))
    time = 0.2 + np.cumsum(0.06 * rng.uniform(0.6, 1.4, COUNT))
    strength = 10.0 ** (level / 20.0) * np.exp(0.35 * rng.standard_normal(COUNT))
    samples = np.zeros(round((time[-1] + 0.3) * rate) * times)
    modes = drawn_modes(rng, top)
    for start, peak in zip(time, strength, strict=True):
        own = varied(rng, kind, modes, top)
        first = int(np.ceil(start * rate * times))
        since = (first + np.arange(round(0.09 * rate * times))) / (rate * times) - start
        samples[first : first + len(since)] += peak * begun(rng, beginning, since, own, lasting)
    if room == "room":
        k = np.arange(round(0.2 * rate * times))
        tail = rng.standard_normal(len(k)) * 10.0 ** (-3.0 * k / len(k))
        tail[: round(3e-3 * rate * times)] = 0.0
        echo = signal.fftconvolve(samples, tail / np.sqrt(np.sum(tail**2)))[: len(samples)]
        samples = samples + 0.2 * echo
    if decimator:
        samples = DECIMATORS[decimator](samples, times)
    white = room in ("white", "8 bit")
    noise = rng.standard_normal(len(samples)) if white else coloured(rng, len(samples), rate)
    if room == "hum":
        angle = 2.0 * np.pi * 50.0 * np.arange(len(samples)) / rate
        noise = noise + 3.0 * sum(np.sin(m * angle + m) / m for m in (1, 2, 3, 5, 7, 11))
    samples = samples + noise
    if room == "8 bit":
        step = np.abs(samples).max() / 127.0
        samples = step * np.rint(samples / step)
    drawn["modes"] = modes
    return Truth(samples, float(rate), time, np.full(COUNT, np.nan), strength), drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "1:301")
    asked = parser.parse_args()
    parts, drawn = [], []
    for seed in asked.seeds:
        truth, about = record(seed)
        parts.append(errors(truth))
        drawn.append(about)
    lines = []
    for factor in ("beginning", "kind", "in", "rate", "level", "filter"):
        for choice in sorted({about[factor] for about in drawn}):
            some = [
                part for part, about in zip(parts, drawn, strict=True) if about[factor] == choice
            ]
            if sum(map(len, some)) >= 30:
                lines.append({factor: choice} | stratum(some))
    for line in lines:
        held = within(line["z"])
        cells = (f"{one:.3g}" if isinstance(one, float) else str(one) for one in line.values())
        print("  ".join(f"{cell:>13}" for cell in cells), "" if held else " (missed)")
    save("strange_sounds", lines)


if __name__ == "__main__":
    main()
