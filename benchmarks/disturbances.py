"""Force records with known impacts and one disturbance each, and records without any impact.

Each function is pure: the seed gives the samples, the rate, and the start and contact time of every
impact. Unless stated otherwise the impacts are those of `recordings.load_cell` (half-sine pulses of
0.3 ms and of height 1 in the median, every tenth followed by a second one after 2 ms), in white
noise of 0.1, without drift and hum. A single disturbance points
up with odd seeds and down with even ones, for a detector may fail on one side only.

    from benchmarks.disturbances import records
    for case in records():
        truth = case.make(1)      # truth.samples, truth.rate, truth.time, truth.contact_time
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import signal

from .recordings import PULSES, Truth, add_pulses, load_cell

DURATION = 12.0
TEN_MINUTES = 600.0
RATE = 50_000.0
HALF_SINE = PULSES["half-sine"]


@dataclass(frozen=True)
class Case:
    """A record by name: `make(seed)` gives its `Truth`.

    `allowed` is the number of false impacts wanted at most where there is no impact, else None.
    """

    name: str
    make: Callable[[int], Truth]
    allowed: int | None = None


def stationary(seed, duration=DURATION, *, noise=0.1, **options) -> Truth:
    """White noise only."""
    return load_cell(duration=duration, noise=noise, drift=False, seed=seed, **options)


def chance(seed) -> np.random.Generator:
    """What the disturbance is drawn from: independent of what the impacts are drawn from."""
    return np.random.default_rng([seed, 1])


def side(seed) -> int:
    return 1 if seed % 2 else -1


def clock(truth: Truth) -> np.ndarray:
    return np.arange(len(truth.samples)) / truth.rate


def add(truth: Truth, disturbance) -> Truth:
    return replace(truth, samples=truth.samples + disturbance)


# -- disturbances; a strength is in units of the largest pulse, or of the median one -------------


def step(seed, duration=DURATION, *, strength) -> Truth:
    """The baseline jumps once, in the middle half of the record; in units of the largest pulse."""
    truth, rng = stationary(seed, duration), chance(seed)
    height = side(seed) * strength * truth.amplitude.max()
    return add(truth, height * (clock(truth) >= duration * rng.uniform(0.25, 0.75)))


def bump(seed, duration=DURATION, *, length, strength) -> Truth:
    """The baseline rises and returns as one half-sine; in units of the largest pulse."""
    truth, rng = stationary(seed, duration), chance(seed)
    height = side(seed) * strength * truth.amplitude.max()
    wave = np.zeros(len(truth.samples))
    start = duration * rng.uniform(0.25, 0.75)
    add_pulses(wave, truth.rate, [start], [length], [height], HALF_SINE)
    return add(truth, wave)


def settling(seed, duration=DURATION, *, time_constant) -> Truth:
    """The baseline jumps once by five times the largest pulse and settles exponentially."""
    truth, rng = stationary(seed, duration), chance(seed)
    height = side(seed) * 5 * truth.amplitude.max()
    since = clock(truth) - duration * rng.uniform(0.25, 0.75)
    return add(truth, height * np.where(since >= 0, np.exp(-since.clip(0) / time_constant), 0))


def glitches(seed, duration=DURATION, *, count, strength) -> Truth:
    """Single samples that are off, every other one up; in units of the median pulse."""
    truth, rng = stationary(seed, duration), chance(seed)
    off = np.zeros(len(truth.samples))
    where = rng.choice(len(off), count, replace=False)
    off[where] = side(seed) * strength * (-1.0) ** np.arange(count)
    return add(truth, off)


def converted(seed, duration=DURATION, *, peak, noise, drift=False, gain=1.0, offset=0.0) -> Truth:
    """Codes of an analogue-to-digital converter, or gain times these plus offset.

    The median pulse is `peak` and the noise `noise` steps high. The baseline lies on a code with
    odd seeds and anywhere between two with even ones; with `drift` it moves slowly by three steps.
    """
    truth, rng = stationary(seed, duration, noise=noise / peak), chance(seed)
    steps = truth.samples * peak + (0 if seed % 2 else rng.uniform(0, 1))
    if drift:
        steps += 3 * np.sin(2 * np.pi * clock(truth) / 37 + rng.uniform(0, 2 * np.pi))
    return replace(
        truth, samples=gain * np.rint(steps) + offset, amplitude=gain * peak * truth.amplitude
    )


def single_precision(seed, duration=DURATION, *, offset) -> Truth:
    """An offset so large that single precision rounds the pulses."""
    truth = stationary(seed, duration)
    return replace(truth, samples=(truth.samples + offset).astype(np.float32))


def hum(seed, duration=DURATION, *, contact, strength) -> Truth:
    """Mains within 0.1 % of 50 Hz, third harmonic 0.3 and fifth 0.1 of it; wider pulses."""
    truth, rng = stationary(seed, duration, contact=contact), chance(seed)
    phase = 2 * np.pi * 50 * rng.uniform(0.999, 1.001) * clock(truth)
    wave = sum(
        part * np.sin(k * phase + rng.uniform(0, 2 * np.pi))
        for k, part in ((1, 1.0), (3, 0.3), (5, 0.1))
    )
    return add(truth, strength * wave)


def coupled(seed, duration=DURATION, *, contact, constant, noise=0.1) -> Truth:
    """A sensor behind a high-pass of the first order with that time constant, noise after it."""
    truth, turn = stationary(seed, duration, contact=contact, noise=0), 2 * constant * RATE
    passed = signal.lfilter([turn, -turn], [turn + 1, 1 - turn], truth.samples)
    return add(replace(truth, samples=passed), noise * chance(seed).standard_normal(len(passed)))


def drawn(seed, duration, contact: Callable, second: Callable | None = None) -> Truth:
    """Pulses of contact times `contact(rng, count)`, 8 ms and more between one and the next.

    With `second(rng, count)`, a delay and a part, each is followed by another.
    """
    rng = np.random.default_rng([seed, 2])
    count = int(2 * 20 * duration) + 20
    contacts = contact(rng, count)
    gaps = 0.008 + rng.exponential(1 / 20 - 0.008, count)
    time = 0.02 + np.cumsum(gaps + np.concatenate(([0], contacts[:-1])))
    height = np.exp(0.5 * rng.standard_normal(count))
    kept = time + contacts < duration - 0.02
    time, contacts, height = time[kept], contacts[kept], height[kept]
    if second is not None:
        delay, part = second(rng, len(time))
        time = np.column_stack((time, time + delay)).ravel()
        contacts = np.repeat(contacts, 2)
        height = np.column_stack((height, part * height)).ravel()
    samples = 0.1 * rng.standard_normal(round(duration * RATE))
    add_pulses(samples, RATE, time, contacts, height, HALF_SINE)
    return Truth(samples, RATE, time, contacts, height)


def widths(seed, duration=DURATION, *, ratio) -> Truth:
    """One pulse in ten is wider by `ratio`; no second ones."""

    def contact(rng, count):
        return 300e-6 * np.where(rng.random(count) < 0.1, ratio, 1.0)

    return drawn(seed, duration, contact)


def touching(seed, duration=DURATION, *, apart) -> Truth:
    """Pulses of 2 ms in pairs, the second `apart` after the first and 0.6 to 1 times as high."""
    return drawn(
        seed,
        duration,
        lambda rng, count: np.full(count, 2e-3),
        lambda rng, count: (apart, rng.uniform(0.6, 1.0, count)),
    )


def few_samples(seed, duration=DURATION, *, count) -> Truth:
    """The record, noise included, at `count` samples a contact.

    All above half the new rate is cut off: pulses ring, as behind a converter's steep filter.
    """
    truth = stationary(seed, duration)
    kept = round(len(truth.samples) * count / (truth.rate * truth.contact_time[0]))
    rate = truth.rate * kept / len(truth.samples)
    return replace(truth, samples=signal.resample(truth.samples, kept), rate=rate)


def scaled(seed, duration=DURATION, *, scale) -> Truth:
    truth = stationary(seed, duration)
    return replace(truth, samples=truth.samples * scale, amplitude=truth.amplitude * scale)


# -- records without impacts -------------------------------------------------------------------


def nothing(make: Callable, duration: float) -> Callable[[int], Truth]:
    """`make(seed)` of the samples that `make(time, rng)` gives."""
    none = np.empty(0)

    def without_impacts(seed):
        samples = make(np.arange(round(duration * RATE)) / RATE, chance(seed))
        return Truth(samples, RATE, none, none, none)

    return without_impacts


def white(t, rng):
    return rng.standard_normal(len(t))


def autoregressive(t, rng):
    return signal.lfilter([1.0], [1.0, -0.95], rng.standard_normal(len(t)))


def one_over_f(t, rng):
    """Power density 1/f above 0.1 Hz, constant below."""
    spectrum = np.fft.rfft(rng.standard_normal(len(t)))
    spectrum /= np.sqrt(np.maximum(np.fft.rfftfreq(len(t), 1 / RATE), 0.1))
    return np.fft.irfft(spectrum, len(t))


def sine(t, rng):
    return np.sin(2 * np.pi * 50 * t + rng.uniform(0, 2 * np.pi))


def jump(t, rng):
    return 1.0 * (t >= rng.uniform(0.25, 0.75) * t[-1])


NOISES = {"white noise": white, "AR noise": autoregressive, "1/f noise": one_over_f}
SIGNALS = {
    "ramp": lambda t, rng: t.copy(),
    "integer ramp": lambda t, rng: np.floor(250 * t),
    "constant": lambda t, rng: np.full(len(t), 0.1),
    "sine": sine,
    "sine and noise": lambda t, rng: sine(t, rng) + 0.1 * rng.standard_normal(len(t)),
    "step": jump,
    "step and noise": lambda t, rng: jump(t, rng) + 0.1 * rng.standard_normal(len(t)),
}


def records(duration: float = DURATION) -> list[Case]:
    """Every record, in the order of the table."""
    cases: list[Case] = []

    def put(name: str, make: Callable, **options) -> None:
        cases.append(Case(name, partial(make, duration=duration, **options)))

    for level in (30, 20, 10, 6):
        put(f"stationary, {level} dB", stationary, noise=10 ** (-level / 20))
    for s in (0.5, 1, 2, 5):
        put(f"step, {s}", step, strength=s)
    for name, length in (("bump 0.1 s", 0.1), ("push 0.5 s", 0.5)):
        for s in (0.5, 1, 2, 5):
            put(f"{name}, {s}", bump, length=length, strength=s)
    for tau in (0.05, 0.2, 0.5, 1):
        put(f"settling, {tau} s", settling, time_constant=tau)
    for count in (1, 30):
        for s in (10, 30, 100, 400):
            put(f"glitch x {count}, {s}", glitches, count=count, strength=s)
    for kind, options in (
        ("", {}),
        (" drift", {"drift": True}),
        (" gain", {"gain": 0.00123, "offset": 0.4567}),
    ):
        for peak in (10, 100):
            for noise in (0.1, 0.25, 0.3, 1, 3):
                name = f"ADC{kind}, peak {peak}, noise {noise}"
                put(name, converted, peak=peak, noise=noise, **options)
    for offset in (3e4, 3e5, 1e6):
        put(f"float32, offset {offset:.0e}", single_precision, offset=offset)
    for contact in (1, 2, 3):
        for s in (0.1, 0.2, 0.5, 1):
            put(f"hum, {contact} ms, {s}", hum, contact=contact * 1e-3, strength=s)
    for contact, noise in ((1, 0.1), (3, 0.1), (3, 0.001)):
        for constant in (1, 2, 5, 20):
            name = f"AC coupling of {constant} ms, {contact} ms, noise {noise}"
            options = {"contact": contact * 1e-3, "constant": constant * 1e-3, "noise": noise}
            put(name, coupled, **options)
    for ratio in (3, 10, 30):
        put(f"widths, {ratio}", widths, ratio=ratio)
    for count in (3, 2, 1.5, 1, 0.7):
        put(f"samples a contact, {count}", few_samples, count=count)
    for apart in (2.0, 1.5):
        put(f"touching 2 ms, {apart} ms", touching, apart=apart * 1e-3)
    for scale in (1e-160, 1e90):
        put(f"scale, {scale:.0e}", scaled, scale=scale)
    cases += [Case(f"nothing, {k}", nothing(v, TEN_MINUTES), 1) for k, v in NOISES.items()]
    cases += [Case(f"nothing, {k}", nothing(v, duration), 0) for k, v in SIGNALS.items()]
    return cases
