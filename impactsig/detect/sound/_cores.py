"""Noise of the cores of a record, and the background of each BLOCK of its frames.

CORE frames share one noise level, which is estimated from all frames within four seconds; a window
contains one or more of these cores. The noise is at least that of the rounding of the samples and
of the step of the converter; `background` (`powers/floor.py`) accounts for strong sound nearby.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ._core_kernels import extremes
from ._kernels import BLOCK, EDGE, GROUP, Scale, octave_powers
from ._nearby import middle
from .powers.band_kernels import background
from .powers.bands import ROUNDING, Bands, degrees_of_freedom
from .powers.fades import beside_fades
from .powers.floor import NEARBY, WITHIN, noise_power, quantile_bias
from .powers.holes import has_holes
from .powers.hum import bands_below, crests_at, hum_bands

CORE = 64 * BLOCK  # frames that share one noise
LENGTH = 1 << 17  # samples of a window, unless a core is longer
PER = BLOCK // GROUP  # frames of the narrow bands that share one background
PART = 8  # frames of the octaves that share one power that the background is read from
TOGGLING = 0.25  # greatest variance, in squared steps, of a sample that is one of two codes


class Core(NamedTuple):
    """What is known of the samples of CORE frames, or fewer at the end of a segment."""

    blocks: int
    least: float
    greatest: float
    resolution: float  # of the numbers that hold the samples
    step: float  # least difference of two samples in a row; infinite if there is none


class Levels(NamedTuple):
    """Mean powers of a window that the background is read from."""

    parts: np.ndarray  # (octaves, PARTs in whole BLOCKs)
    parts_sound: np.ndarray  # those that digital silence does not touch
    octaves: np.ndarray  # (octaves, BLOCKs)
    low: np.ndarray  # (low octaves, BLOCKs)
    bands: np.ndarray  # (bands, BLOCKs)
    sound: np.ndarray  # BLOCKs that are not all digital silence
    silent: np.ndarray  # PARTs that are digital silence
    steps: tuple[np.ndarray, np.ndarray]  # where it ends and begins (`edge_steps`)
    falls: np.ndarray  # of bands (`falls_of`)
    cores: list[Core]

    @property
    def blocks(self) -> int:
        return len(self.sound)


@dataclass
class Backgrounds:
    """Works out the background window by window. `low_bias` is that of `noise_power`."""

    scale: Scale
    rate: float
    bands: Bands
    low_bias: np.ndarray
    gains: np.ndarray = field(init=False)  # power of octaves for white noise of power 1
    noise: list[np.ndarray] = field(default_factory=list)  # of the octaves, in each core
    below_step: int = 0  # cores whose noise the converter does not resolve
    with_holes: int = 0  # cores beside which a codec left holes
    hum: int = 0  # narrow bands, from the lowest up, that octaves should not hear (`hum.py`)
    hum_crest: float = 1.0  # power of its crests over the noise of an octave

    def __post_init__(self) -> None:
        scale = self.scale
        self.gains = white_gains(scale)
        self.middle_gain = middle(self.gains)
        block = BLOCK * scale.hop / self.rate
        self.within, self.nearby = round(WITHIN / block), round(NEARBY / block)
        self.part_bias = quantile_bias(PART * scale.hop / 2.0 ** (1 + np.arange(scale.octaves)))
        self.hum_crests = crests_at(scale, self.rate, self.bands.hop)
        self.below = bands_below(scale, self.rate, self.bands.hop)
        self.mean_bias = quantile_bias(degrees_of_freedom(self.rate, GROUP * scale.hop, PER))

    @property
    def unresolved(self) -> bool:
        """Whether the noise is mostly weaker than a quantisation step."""
        return self.below_step > 0.5 * len(self.noise)

    @property
    def coded(self) -> bool:
        """Whether a codec left holes in most of the record."""
        return self.with_holes > 0.5 * len(self.noise)

    def of(self, windows: list[Levels], which: int) -> list[np.ndarray]:
        """Of octaves, low ones and narrow bands, in the BLOCKs of one window of these in a row."""
        parts = np.concatenate([one.parts for one in windows], axis=1)
        parts_sound, sound = (
            np.concatenate([getattr(one, name) for one in windows])
            for name in ("parts_sound", "sound")
        )
        steps = [np.concatenate(side) for side in zip(*(one.steps for one in windows), strict=True)]
        if len(steps[0]) or len(steps[1]):
            silent = np.concatenate([one.silent for one in windows])
            fading = beside_fades(steps, parts_sound, silent, PART * self.scale.hop / self.rate)
            if fading is not None:
                parts_sound &= ~fading
                sound &= ~fading.reshape(len(sound), -1).any(axis=1)
        holes = has_holes(np.sum([one.falls for one in windows], axis=0))
        cores = [core for one in windows for core in one.cores]
        blocks = [core.blocks for core in cores]
        first = sum(len(one.cores) for one in windows[:which])
        at, count = sum(blocks[:first]), len(windows[which].cores)
        skipped, last = max(at - self.within, 0), at + windows[which].blocks + self.within
        octaves, low, bands = (
            _columns([getattr(one, name) for one in windows], skipped, last)
            for name in ("octaves", "low", "bands")
        )
        ends = at + np.cumsum(blocks[first : first + count])
        begins = ends - blocks[first : first + count]
        begins = np.maximum(begins - self.within, 0)
        ends = np.minimum(ends + self.within, len(sound))
        of_near = begins - skipped, ends - skipped
        near_parts = BLOCK // PART * begins, BLOCK // PART * ends
        sound = sound[skipped:last]
        noises = (
            noise_power(parts, parts_sound, near_parts, self.part_bias, holes),
            noise_power(low, sound, of_near, self.low_bias, holes),
            noise_power(bands, sound, of_near, self.mean_bias, holes),
        )
        for k in range(count):
            of_octaves, of_low, of_bands = (noise[:, k] for noise in noises)
            near = slice(*reaching(blocks, first + k, self.within))
            _, least, greatest, resolution, step = zip(*cores[near], strict=True)
            toggling = TOGGLING * min(step) ** 2 if math.isfinite(min(step)) else 0.0
            size = max(-min(least), max(greatest))
            rounding = (max(resolution) * size) ** 2
            self.noise.append(of_octaves.copy())
            self.with_holes += holes
            self.below_step += middle(of_octaves) < toggling * self.middle_gain / 3.0
            np.maximum(of_octaves, np.maximum(toggling * self.gains, rounding), out=of_octaves)
            # White noise of rounding or of a step is about as strong in the next octaves.
            np.maximum(of_low, max(rounding, toggling * self.gains[-1]), out=of_low)
            hum = hum_bands(of_octaves, of_bands, self.hum_crests, self.below)
            if hum:
                crest = self.hum_crests[:, : self.below] @ of_bands[: self.below]
                self.hum = max(self.hum, hum)
                self.hum_crest = max(self.hum_crest, float((crest / of_octaves).max()))
            leakage = max((ROUNDING * size) ** 2, toggling) * self.bands.gain
            np.maximum(of_bands, leakage, out=of_bands)
        out = []
        for noise, means in zip(noises, (octaves, low, bands), strict=True):
            out.append(np.empty((len(noise), windows[which].blocks)))
            background(noise, CORE // BLOCK, means, at - skipped, self.nearby, out[-1])
        return out


def _columns(parts: list[np.ndarray], first: int, last: int) -> np.ndarray:
    """Columns from `first` to before `last` of arrays side by side."""
    some, begin = [], 0
    for part in parts:
        some.append(part[:, max(first - begin, 0) : max(last - begin, 0)])
        begin += part.shape[1]
    return np.concatenate(some, axis=1)


def window_size(scale: Scale) -> int:
    """Samples of a window, in whole cores."""
    return max(LENGTH // (CORE * scale.hop), 1) * CORE * scale.hop


def cores_of(samples: np.ndarray, hop: int) -> list[Core]:
    """The cores of a window."""
    resolution, out = resolution_of(samples.dtype), []
    for k in range(0, len(samples), CORE * hop):
        part = samples[k : k + CORE * hop]
        least, greatest, step = extremes(part)
        out.append(Core(-(-len(part) // (BLOCK * hop)), least, greatest, resolution, step))
    return out


def reaching(blocks: list[int], which: int, within: int) -> tuple[int, int]:
    """First and end of the stretches, of so many blocks each, that lie `within` some of one."""
    begin, end, before, after = which, which + 1, 0, 0
    while begin > 0 and before < within:
        begin -= 1
        before += blocks[begin]
    while end < len(blocks) and after < within:
        after += blocks[end]
        end += 1
    return begin, end


@functools.cache
def resolution_of(kind: np.dtype) -> float:
    """Relative resolution of numbers of a kind; 0 for integers."""
    return float(np.finfo(kind).eps) if np.issubdtype(kind, np.floating) else 0.0


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
