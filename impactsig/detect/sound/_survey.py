"""First pass over a sound record: rises of its power, in octaves and narrow bands.

Frames wait until the four seconds after them have been read, since the background is estimated from
both sides (`_cores.py`). Little is kept of the whole record: for every 16 frames the rise in narrow
bands, the likelihood of one in a single band and how they go on to rise, and a sample of the rise
in octaves; for every fourth the likelihood of a rise in one octave; and the crests in octaves.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ._core_kernels import reaching
from ._cores import Backgrounds
from ._kernels import (
    EDGE,
    GROUP,
    SAMPLED,
    STEP,
    Scale,
    loudness,
    octave_powers,
    octave_rise,
)
from ._level_kernels import PART, PER, put_known
from ._levels import Levels, Powers, levels_of
from ._rise_kernels import DEEPEST, LOCAL
from ._survey_kernels import clear_unknown, put_crests
from ._survey_lengths import SurveyLengths, survey_lengths_at
from ._windows import Window
from .powers.band_kernels import band_growth, band_rise, frames_above
from .powers.bands import Bands, Spectrum
from .powers.filtering import Filter
from .powers.gate import Gate

RISEN, LIKELY = 0.2, 20.0  # rise in narrow bands, or likelihood of one, for which that is checked
LEAST = 0.5  # crests kept, in standard deviations of the rise in noise


class Passage(NamedTuple):
    """Results for a stretch of the record without gaps, or for a slab of it."""

    segment: int  # its first sample
    octaves: np.ndarray  # rise, of every SAMPLED-th frame
    bands: np.ndarray  # rise, of every GROUP-th frame
    likelihood: np.ndarray  # of a rise in one of these bands
    rises: np.ndarray  # likelihood of one in an octave, of every STEP-th frame
    growth: np.ndarray  # of risen bands, LATER [neper]; or 0
    known: np.ndarray  # where these are; not at both ends
    place: np.ndarray  # frames of the crests in octaves
    height: np.ndarray  # the rise there
    loud: np.ndarray  # the loudness after it
    loudness: np.ndarray  # that after every SAMPLED-th frame
    silent: np.ndarray  # GROUPs in which a gate is closed
    digital: np.ndarray  # those of digital silence


def joined(slabs: list[Passage]) -> Passage:
    """The results for a stretch from those for its slabs."""
    if len(slabs) == 1:
        return slabs[0]
    columns = zip(*(slab[1:] for slab in slabs), strict=True)
    return Passage(slabs[0].segment, *(np.concatenate(column) for column in columns))


@dataclass
class Slab:
    """Powers of a window of the record, until its background is known."""

    segment: int
    first: int  # frame of the segment
    last: bool  # nothing of the segment follows
    telling: tuple[int, int]  # frames, from the first, with all that their rise needs beside them
    octaves: np.ndarray  # powers of frames, from `left` before the first on
    left: int
    frames: int
    low: np.ndarray  # powers of the octaves below those
    power: np.ndarray  # (bands, GROUPs)
    closes: np.ndarray  # GROUPs where a gate closes
    known: np.ndarray  # those whose windows lie in the segment
    silent: np.ndarray  # (GROUPs,)
    levels: Levels


@dataclass
class Survey:
    """Collects the evidence for impacts, window by window.

    `filter` is one before the octaves, for records with hum or ringing (`powers/hum.py`,
    `powers/ringing.py`).
    """

    scale: Scale
    rate: float
    filter: Filter | None = None
    lengths: SurveyLengths = field(init=False)
    spectrum: Spectrum = field(init=False)
    gate: Gate = field(init=False)
    backgrounds: Backgrounds = field(init=False)
    hum_crest: float = 0.0  # of hum that is filtered out, above the noise [neper of power]
    spoilt: int = field(init=False)  # frames at either end of samples that a filter spoils
    margin: tuple[int, int] = field(init=False)  # frames that a window needs beside it
    passages: list[Passage] = field(default_factory=list)
    parts: list[Passage] = field(default_factory=list)  # of the next one
    slabs: list[Slab] = field(default_factory=list)
    done: int = 0  # of the slabs
    tail: np.ndarray = field(init=False)  # rise not yet searched
    tail_loud: np.ndarray = field(init=False)  # the loudness there
    carried: np.ndarray = field(init=False)  # last band powers
    scratch: np.ndarray = field(default_factory=lambda: np.empty((3, 0)))  # of the octaves
    after: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))  # powers after frames
    every: np.ndarray = field(init=False)  # both sides of some

    def __post_init__(self) -> None:
        self.lengths = survey_lengths_at(self.scale, self.rate)
        bands = self.lengths.bands
        self.spectrum = Spectrum(bands)
        self.gate = Gate(self.scale, self.rate, bands)
        self.backgrounds = Backgrounds(self.scale, self.rate, bands, self.filter)
        self.spoilt = 0 if self.filter is None else -(-self.filter.reach // self.scale.hop)
        left, right = self.lengths.margin
        self.margin = -(-(left + self.spoilt) // DEEPEST) * DEEPEST, right + self.spoilt

    @property
    def bands(self) -> Bands:
        """The narrow bands."""
        return self.lengths.bands

    @property
    def spread(self) -> float:
        """Standard deviation of the rise of octaves in noise, about."""
        return self.lengths.spread

    def add(self, window: Window, cores: np.ndarray) -> None:
        """Add the next window of the record, with its `cores_of`."""
        within = self.backgrounds.within
        self.slabs.append(self._slab(window, cores))
        while sum(slab.levels.blocks for slab in self.slabs[self.done + 1 :]) >= within:
            self._settle()

    def finish(self) -> None:
        """Process what waits for further samples, at the end."""
        while self.done < len(self.slabs):
            self._settle()

    def _slab(self, window: Window, cores: np.ndarray) -> Slab:
        scale, (left, right) = self.scale, self.margin
        hop = scale.hop
        core = window.core
        x, valid = window.samples(left * hop, right * hop, hop)
        before = self.filter
        if before is not None and before.predicts:
            x, before = before.of(x), None
        count = -(-len(core) // hop)
        total = len(x) // hop
        power = np.empty((scale.octaves, total))
        half = len(x) // 2
        if self.scratch.shape[1] < half:
            self.scratch = np.empty((3, half))
        even, odd, high = self.scratch[:, :half]
        octave_powers(x, scale.octaves, even, odd, high, power)
        rest, free = (even, odd) if scale.octaves % 2 else (odd, even)
        rest = rest[:total]  # what is left below the octaves
        x = self.gate.bridged(x, power, rest, cores)
        groups = -(-count // GROUP)
        each = [free[: total // 2], free[total // 2 : total // 2 * 2], high[: total // 2]]
        low, low_parts = self.lengths.rises.powers(rest, left, -(-groups // 2), each)
        real = -(-valid[0] // hop) + EDGE * (valid[0] > 0), valid[1] // hop - EDGE
        if window.first == 0:
            self.gate.begin()
        x, continued = self.gate.octaves(x, power, real, count)
        if self.filter is not None:
            real = real[0] + self.spoilt, real[1] - self.spoilt
        if before is not None:
            power = continued = np.empty_like(power)
            octave_powers(before.of(x), scale.octaves, *self.scratch[:, :half], power)
        fine = self.spectrum.powers(x, left * hop, groups)
        size, known = len(self.bands.window), np.empty(groups, np.bool_)
        put_known(left * hop - size // 2, GROUP * hop, size, valid, known)
        powers = Powers(power, left, real, low_parts, fine, known)
        levels, silent = levels_of(powers, cores, PART * hop / self.rate)
        last = (len(core) + len(window.after)) // hop - EDGE - scale.forward - self.spoilt
        first = window.first // hop
        return Slab(
            window.segment,
            first,
            not len(window.after),
            (scale.past + self.spoilt - first, last),
            continued,
            left,
            count,
            low,
            fine,
            self.gate.fill_narrow(fine, left * hop),
            known,
            silent,
            levels,
        )

    def _settle(self) -> None:
        """Determine the background of the first waiting slab, and process it."""
        slab = self.slabs[self.done]
        levels = [one.levels for one in self.slabs]
        blocks = np.array([one.blocks for one in levels])
        begin, end = reaching(blocks, self.done, self.backgrounds.within)
        background = self.backgrounds.of(levels[begin:end], self.done - begin)
        octaves = background[: self.scale.octaves]
        bands = background[len(background) - len(self.bands.first) :]
        if self.after.shape[1] != slab.frames:
            self.after = np.empty((self.scale.octaves, slab.frames))
            self.every = np.empty((2, self.scale.octaves, -(-slab.frames // STEP)))
        if slab.first == 0:
            self.tail = self.tail_loud = np.zeros(2 * self.scale.spacing)
            self.carried = np.empty((len(slab.power), self.lengths.lag))
            self.carried[:] = slab.power[:, :1]
        spacing = self.scale.spacing
        near = np.empty(2 * spacing + slab.frames + spacing * slab.last)
        near[: 2 * spacing] = self.tail
        near[2 * spacing + slab.frames :] = 0.0
        rise = near[2 * spacing : 2 * spacing + slab.frames]
        octave_rise(
            slab.octaves, slab.left, self.scale, octaves, self.lengths.weights,
            self.after, self.every, rise,
        )  # fmt: skip
        first, last = slab.telling
        rise[: max(first, 0)] = 0.0
        rise[max(last, 0) :] = 0.0
        sampled = np.empty(-(-slab.frames // SAMPLED))
        loudness(self.after, octaves, self.lengths.weights, SAMPLED, sampled)
        finer = np.empty((2, slab.power.shape[1]))
        band_rise(self.carried, slab.power, bands, self.lengths.freedom, PER, finer)
        if slab.first == 0:
            slab.known[: self.lengths.begins] = False
        clear_unknown(slab.closes, slab.known, finer)
        place, height, loud = self._crests(near, slab, octaves)
        found = Passage(
            slab.segment,
            octaves=rise[::SAMPLED].astype(np.float32),
            bands=finer[0],
            likelihood=finer[1],
            rises=self._rises(slab, background),
            growth=self._growth(slab, bands, finer),
            known=slab.known,
            place=place,
            height=height,
            loud=loud,
            loudness=sampled,
            silent=slab.silent | self.backgrounds.closed[: len(slab.silent)],
            digital=slab.silent,
        )
        self.parts.append(found)
        if slab.last:
            self.passages.append(joined(self.parts))
            self.parts = []
        # Of the last alone there may be fewer.
        self.carried = slab.power[:, -self.lengths.lag :].copy()
        slab.octaves = slab.low = slab.power = np.empty((0, 0))  # most of the memory
        self.done += 1
        if begin:
            del self.slabs[:begin]
            self.done -= begin

    def _rises(self, slab: Slab, background: np.ndarray) -> np.ndarray:
        """H of the slab whose `every` is known, in whole GROUPs."""
        near = [slab.levels.long_parts]
        if slab.first:
            near.insert(0, self.slabs[self.done - 1].levels.long_parts[:, -LOCAL:])
        first = sum(part.shape[1] for part in near[:-1])
        if not slab.last:
            near.append(self.slabs[self.done + 1].levels.long_parts[:, :LOCAL])
        parts = np.concatenate(near, axis=1) if len(near) > 1 else near[0]
        out = np.zeros(GROUP // STEP * slab.power.shape[1], np.float32)
        self.lengths.rises.likelihood(
            self.every, slab.low, slab.left, parts, first, background, out[: self.every.shape[2]]
        )
        return out

    def _growth(self, slab: Slab, background: np.ndarray, finer: np.ndarray) -> np.ndarray:
        """How narrow bands go on to rise, where they do or one does; 0 elsewhere."""
        out, frames = np.zeros(finer.shape[1]), np.empty(finer.shape[1] + 1, np.int64)
        frames = frames[: frames_above(finer[0], RISEN, finer[1], LIKELY, frames)]
        if not len(frames):
            return out
        parts, later = [slab.power[:, :0]], self.lengths.later
        for following in () if slab.last else self.slabs[self.done + 1 :]:
            parts.append(following.power[:, :later])
            if following.last or sum(part.shape[1] for part in parts) >= later:
                break
        grown, after = np.empty(len(frames)), np.concatenate(parts, axis=1)
        band_growth(self.carried, slab.power, after, later, background, PER, frames, grown)
        out[frames] = grown
        return out

    def _crests(
        self, rise: np.ndarray, slab: Slab, background: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Frames, rise and loudness of the crests of what begins two spacings before the slab."""
        spacing = self.scale.spacing
        most = len(rise) // (spacing + 1) + 1
        place, height, loud = np.empty(most, np.int64), np.empty(most), np.empty(most)
        tail_loud = np.empty(0 if slab.last else 2 * spacing)
        n = put_crests(
            rise, LEAST * self.spread, self.after, background, self.lengths.weights,
            self.tail_loud, tail_loud, place, height, loud,
        )  # fmt: skip
        self.tail, self.tail_loud = rise[-2 * spacing :], tail_loud
        return place[:n] + slab.first, height[:n].copy(), loud[:n].copy()
