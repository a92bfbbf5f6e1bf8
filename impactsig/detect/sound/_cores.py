"""Noise of the cores of a record, and the background of each BLOCK of its frames.

CORE frames share one noise level, which is estimated from all frames within four seconds; a window
contains one or more of these cores. The noise is at least that of the rounding of the samples and
of the step of the converter; `background` (`powers/floor.py`) accounts for strong sound nearby.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np

from ._core_kernels import (
    CONVERTER_STEP,
    GREATEST,
    LEAST,
    bound_noise,
    may_hum,
    put_cores,
    put_narrow,
    put_near,
)
from ._kernels import BLOCK, EDGE, GROUP, Scale, octave_powers
from ._level_kernels import PART, PER
from ._levels import Levels, together
from ._rise_kernels import LONG_PART, LOW
from .powers.band_kernels import background
from .powers.bands import Bands, degrees_of_freedom
from .powers.closings import closed_in, opened_noise
from .powers.fades import beside_fades
from .powers.filtering import Filter
from .powers.floor import NEARBY, WITHIN, noise_power, quantile_bias
from .powers.holes import has_holes
from .powers.hum import bands_below, crests_at, hum_bands

CORE = 64 * BLOCK  # frames that share one noise
LEAST_OPEN = 0.25  # of a BLOCK, whose noise is read from what an open gate lets through
OFF_STEPS = 0.02  # of a step, from whole ones
LENGTH = 1 << 17  # samples of a window, unless a core is longer


@dataclass
class Backgrounds:
    """Works out the background window by window."""

    scale: Scale
    rate: float
    bands: Bands
    filter: Filter | None = None  # before the octaves
    gains: np.ndarray = field(init=False)  # power of octaves for white noise of power 1
    noise: list[np.ndarray] = field(default_factory=list)  # of the octaves, in each core
    narrow: list[np.ndarray] = field(default_factory=list)  # that of narrow bands, and the loudest
    below_step: int = 0  # cores whose noise the converter does not resolve
    with_holes: int = 0  # cores beside which a codec left holes
    closed: np.ndarray = field(default_factory=lambda: np.empty(0))  # GROUPs of the last window
    hum: int = 0  # narrow bands, from the lowest up, that octaves should not hear (`hum.py`)
    hum_crest: float = 1.0  # power of its crests over the noise of an octave

    def __post_init__(self) -> None:
        scale = self.scale
        self.gains = white_gains(scale)
        if self.filter is not None:
            self.gains = self.gains * self.filter.gains(scale.octaves)
        block = BLOCK * scale.hop / self.rate
        self.within, self.nearby = round(WITHIN / block), round(NEARBY / block)
        self.part_bias, self.mean_bias = biases_at(scale, self.rate)
        self.hum_crests = crests_at(scale, self.rate, self.bands.hop)
        self.below = bands_below(scale, self.rate, self.bands.hop)

    @property
    def unresolved(self) -> bool:
        """Whether the noise is mostly weaker than a quantisation step."""
        return self.below_step > 0.5 * len(self.noise)

    @property
    def coded(self) -> bool:
        """Whether a codec left holes in most of the record."""
        return self.with_holes > 0.5 * len(self.noise)

    def of(self, windows: list[Levels], which: int) -> np.ndarray:
        """That of octaves, low ones and bands in the BLOCKs of one window of these in a row."""
        near, own = together(windows), windows[which]
        audible, sound = near.parts_sound, near.sound
        if len(near.steps[0]) or len(near.steps[1]):
            part = PART * self.scale.hop / self.rate
            fading = beside_fades(near.steps, audible, near.silent, part)
            if fading is not None:
                audible = audible & ~fading
                sound = sound & ~fading.reshape(len(sound), -1).any(axis=1)
        holes = has_holes(*near.falls)
        first, count = sum(len(one.cores) for one in windows[:which]), len(own.cores)
        beside, spans = np.empty((count, 2), np.int64), np.empty((2, count), np.int64)
        at = put_near(near.cores, first, self.within, beside, spans)
        means, octaves = near.means, self.scale.octaves
        narrow = len(means) - len(self.bands.first)
        noise = np.empty((len(means), count))
        parts = BLOCK // PART * spans
        noise[:octaves] = noise_power(near.parts, audible, parts, self.part_bias, holes)
        noise[octaves:] = noise_power(means[octaves:], sound, spans, self.mean_bias, holes)
        gated = 0
        self.closed = np.zeros(PER * own.blocks, np.bool_)
        for k, (begin, end) in enumerate(spans.T.tolist()):
            closed = self._open(noise[:, k], near, begin, end)
            if closed is not None:
                gated += 1
                inside = self.closed[PER * CORE // BLOCK * k :][: PER * CORE // BLOCK]
                inside[:] = closed[PER * (at + CORE // BLOCK * k - begin) :][: len(inside)]
        bounded, unresolved = np.empty_like(noise), np.empty(count, np.bool_)
        gains, leakage = self.gains, self.bands.gain
        if bound_noise(noise, near.cores, beside, gains, leakage, bounded, unresolved):
            hidden = beside[unresolved].tolist()
            self.below_step += sum(on_steps(near.cores[begin:end]) for begin, end in hidden)
        self.noise.extend(noise[:octaves].T.copy())
        bands = np.empty((count, 2, len(self.bands.first)))
        put_narrow(noise[narrow:], means[narrow:], spans, bands)
        self.narrow.extend(bands)
        self.with_holes += (count - gated) * holes
        if may_hum(bounded[:octaves], noise[narrow:], self.hum_crests[:, : self.below]):
            for k in range(count):
                self._hear_hum(bounded[:octaves, k], noise[narrow:, k])
        out = np.empty((len(means), own.blocks))
        background(bounded, CORE // BLOCK, means, at, self.nearby, out)
        return out

    def _open(self, noise: np.ndarray, near: Levels, begin: int, end: int) -> np.ndarray | None:
        """Make `noise` that behind an open gate. Which GROUPs this attenuates; None without one.

        The noise is read from BLOCKs `begin` to before `end`.
        """
        each, octaves = BLOCK // LONG_PART, self.scale.octaves
        opened = opened_noise(columns(near.long_parts, each * begin, each * end), noise[:octaves])
        if not opened:
            return None
        noise[:octaves] *= opened
        each = BLOCK // PART
        parts = columns(near.parts, each * begin, each * end)
        closed = closed_in(parts, noise[:octaves], PER * (end - begin))
        share = 1.0 - closed.reshape(-1, PER).mean(axis=1)
        heard = share >= LEAST_OPEN
        if heard.any():
            whole = np.array([[0], [len(heard)]])
            filled = near.means[octaves:, begin:end] / np.maximum(share, LEAST_OPEN)
            noise[octaves:] = noise_power(filled, heard, whole, self.mean_bias, False)[:, 0]
        else:
            noise[octaves:] *= opened
        return closed

    def _hear_hum(self, octaves: np.ndarray, bands: np.ndarray) -> None:
        """Note the hum of a core, given its noise."""
        hum = hum_bands(octaves, bands, self.hum_crests, self.below)
        if hum:
            crest = self.hum_crests[:, : self.below] @ bands[: self.below]
            self.hum = max(self.hum, hum)
            self.hum_crest = max(self.hum_crest, float((crest / octaves).max()))


def columns(values: np.ndarray, first: int, last: int) -> np.ndarray:
    """Columns from `first` to before `last`, side by side in memory."""
    return np.ascontiguousarray(values[:, first:last])


def window_size(scale: Scale) -> int:
    """Samples of a window, in whole cores."""
    return max(LENGTH // (CORE * scale.hop), 1) * CORE * scale.hop


def cores_of(samples: np.ndarray, hop: int) -> np.ndarray:
    """What is known of the samples of each core of a window, or part of one at its end.

    Columns are its BLOCKS, the LEAST and the GREATEST sample, the RESOLUTION of the numbers that
    hold them, and the CONVERTER_STEP, the least difference of two in a row, infinite if there is
    none.
    """
    size = CORE * hop
    out = np.empty((-(-len(samples) // size), 5))
    put_cores(samples, size, CORE // BLOCK, resolution_of(samples.dtype), out)
    return out


def on_steps(cores: np.ndarray) -> bool:
    """Whether the samples of some cores are apart by whole steps, as those of a converter are.

    Samples that are no integers have a least difference as well, of which others are no multiples.
    """
    span = (cores[:, GREATEST] - cores[:, LEAST]) / cores[:, CONVERTER_STEP].min()
    return bool((np.abs(span - np.round(span)) < OFF_STEPS).all())


@functools.cache
def resolution_of(kind: np.dtype) -> float:
    """Relative resolution of numbers of a kind; 0 for integers."""
    return float(np.finfo(kind).eps) if np.issubdtype(kind, np.floating) else 0.0


@functools.lru_cache(maxsize=8)
def biases_at(scale: Scale, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Bias of `noise_power` of the octaves, and of the low octaves and narrow bands."""
    octaves = quantile_bias(PART * scale.hop / 2.0 ** (1 + np.arange(scale.octaves)))
    low = quantile_bias(BLOCK / 2.0 ** (1 + np.arange(LOW)))
    bands = quantile_bias(degrees_of_freedom(rate, GROUP * scale.hop, PER))
    return octaves, np.concatenate((low, bands))


@functools.lru_cache(maxsize=8)
def white_gains(scale: Scale) -> np.ndarray:
    """Power of each octave for white noise of power 1."""
    half = EDGE * scale.hop
    impulse = np.zeros(2 * half)
    gains = np.zeros(scale.octaves)
    even, odd, high = np.empty(half), np.empty(half), np.empty(half)
    power = np.empty((scale.octaves, 1))
    for shift in range(scale.hop):
        impulse[:] = 0.0
        impulse[half + shift] = 1.0
        octave_powers(impulse, scale.octaves, even, odd, high, power)
        gains += power[:, 0] * 2 * half / scale.hop
    return gains
