"""Timing of impacts in a band-limited sound record, from the modes that they share.

The filter before a sampler of 8 to 16 kHz rings before an impact as long as after it, and any
method that looks for the first change finds that ringing. The instant is determined by a model of
sounds with an abrupt start behind the filter: impacts of one structure have the same frequencies
and decays, in any phases. The modes are the poles of the sounds of up to LEARN impacts [Roy1989]_;
the filter is that of `_edge.responses` under which these sounds are the most probable, given the
modes; the instant of an impact is the mean of its probability, given both, with any amplitudes of
the modes (`_shift_kernels.py`), and the standard deviation is its standard error, increased by
what the model leaves of other sounds in the direction of a shift.

Modes above the band leave an impulse and its slope behind the filter. Their amplitudes, relative to
the energy of the sound, are normal with variances estimated from the record: without a bound, a
slightly later impact with other phases gives the same samples.

The method does not apply where sounds are more probable without any filter, where modes are not
shared, or where they leave more than UNLIKE of the energy. If the sounds of a slow record then do
not begin abruptly, the instant is where the modulus first crosses a fraction of its maximum;
otherwise it is the attack. A crossing is as uncertain as the time from an earlier one to it.
Instants by modes of sounds that begin gradually scatter as attacks do (`../_growth.py`).

Results do not depend on how the record is divided. Memory is bounded by the LEARN sounds kept at
first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...._numerics.spread import DEVIATION_BY_MEDIAN
from .._growth import FAINTEST
from .._growth_kernels import spread_of
from .._nearby import middle
from ._edge import high_pass, whitening
from ._shared_exponents import may_share
from ._shared_modes_choice import chosen_model
from ._shared_modes_fit import FIRST_ERROR, LEAST, Model
from ._shared_modes_kernels import NEAR_TAPS, abruptness, crossings, high_passed

FASTEST = 24_000.0  # [Hz]: above, the attack is timed to less than 20 us by itself
SLOW = 16_000.0  # [Hz]: up to it, ringing before an impact is worse than a crossing
BEFORE, AFTER = 6e-3, 10e-3  # [s], of what is kept about an attack
NOISE = 4.5e-3  # [s] of it, whose spectrum is that of noise
QUIET = 3e-3  # [s] of it, once filtered, that noise is read from
SEARCH = (3e-3, 8.5e-3)  # [s] of it, once filtered, in which the crossing lies
SHARES = (0.3, 4.0, 0.6)  # of the greatest at the crossing; times the noise; most of the greatest
EARLIER = (0.15, 4.0, 0.6)  # the same for a crossing before that
LEARN = 256  # impacts that modes are learned from
CHOOSE = 64  # of them that filters are chosen by, and that show whether modes may be shared
UNLIKE = 0.03  # fraction of the energy that shared modes leave in the median, apart from noise
STRANGE = 0.1  # and that they may leave of one impact
HALF_WAVES = 1.05  # standard error of a crossing, over the time that the modulus stays above
BEGINNING = 1.5e-3  # [s]
RISE = 1.0  # [samples], that instants scatter by where a filter's response rises, at most
ABOUT = 1.1e-3, 3.5e-3  # [s], before and after an instant, in which a sound's growth is looked for
ABRUPT = 0.1  # power of the first two samples over the greatest of two, if a sound begins at once


class Timing(NamedTuple):
    """Shifts of attacks and their standard errors [samples]; NaN if unknown."""

    shift: np.ndarray
    error: np.ndarray


@dataclass
class SharedModes:
    """Shifts of the impacts of a record, in sequence.

    `lag` and `slope` are those of the innovations that attacks are timed in.
    """

    rate: float
    lag: int
    slope: int
    taps: np.ndarray = field(init=False)
    white: np.ndarray = field(init=False)  # taps that whiten the noise as well
    before: int = field(init=False)  # samples kept before an attack
    length: int = field(init=False)
    held: list[np.ndarray] = field(default_factory=list)
    count: int = 0
    learned: bool = False
    model: Model | None = None
    latency: float = 0.0  # of the crossing, in the median [samples]
    spread: float = np.nan  # of the crossing about that, or about the start where no model is
    gradual: float = 0.0  # of instants by the model, as sounds begin gradually [samples]
    crossing: bool = False  # whether crossings are used where no model is
    found: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.taps = self.white = high_pass(self.rate)
        self.before = round(BEFORE * self.rate)
        self.length = self.before + round(AFTER * self.rate)

    def add(self, x: np.ndarray, attacks: np.ndarray) -> None:
        """Add the next attacks, halfway between two of the samples x, all that are near them."""
        if self.rate > FASTEST or (self.learned and not self._applies):
            self.found.append(np.full((len(attacks), 2), np.nan))
        elif len(attacks):
            first = np.rint(attacks + 0.5).astype(int) - self.before
            there = (first >= 0) & (first + self.length <= len(x))
            if self.learned:
                self.found.append(self._timed(x, np.where(there, first, -1)))
                return
            self.held.append(self._waves(x, first, there))
            self.count += len(first)
            if self.count >= LEARN:
                self._learn()

    @property
    def _applies(self) -> bool:
        return self.model is not None or self.crossing

    def timing(self) -> Timing:
        """The shift of every impact and its standard error [samples]."""
        if not self.learned:
            self._learn()
        shift, error = np.concatenate([np.empty((0, 2)), *self.found]).T
        known = np.isfinite(shift)
        if known.any() and not known.all():
            # Too near to an end of the record: as late as the others are in the median.
            usual = middle(shift[known])
            spread = DEVIATION_BY_MEDIAN * middle(np.abs(shift[known] - usual))
            shift = np.where(known, shift, usual)
            error = np.where(known, error, max(spread, 12.0**-0.5))
        return Timing(shift, error)

    def last(self, count: int) -> Timing:
        """Timing of the last so many impacts."""
        timing = self.timing()
        first = len(timing.shift) - count
        return Timing(timing.shift[first:], timing.error[first:])

    def _waves(self, x: np.ndarray, first: np.ndarray, there: np.ndarray) -> np.ndarray:
        """Waveform around each attack; zeros if it is incomplete."""
        if not there.any():
            return np.zeros((len(first), self.length))
        every = np.lib.stride_tricks.sliding_window_view(x, self.length)
        if there.all():  # one copy, not two
            return np.asarray(every[first])
        waves = np.zeros((len(first), self.length))
        waves[there] = every[first[there]]
        return waves

    def _learn(self) -> None:
        waves = np.concatenate([np.empty((0, self.length)), *self.held])
        self.learned, self.held = True, []
        which = np.flatnonzero(waves[:LEARN].any(axis=1))
        timed = np.full((len(waves), 2), np.nan)
        if len(which) >= LEAST:
            spread = np.linspace(0, len(which) - 1, min(CHOOSE, len(which))).astype(int)
            which = np.concatenate((which[spread], np.delete(which, spread)))
            few, others = slice(len(spread)), slice(len(spread), None)
            sounds = np.empty((len(which), self.length - len(self.taps) + 1))
            plain, crossed = np.empty_like(sounds[few]), np.empty((len(which), 3))
            first = self._places(len(waves))[which]
            high_passed(waves.ravel(), first[few], self.taps, plain)
            self._cross(plain, crossed[few])
            self._whiten(waves[which[few]], plain)
            high_passed(waves.ravel(), first[few], self.white, sounds[few])
            # Sounds that share nothing usually show it by a few.
            noise = self._noise(sounds[few])
            alike = len(spread) == len(which) or may_share(
                sounds[few], crossed[few, 0], noise, self.rate
            )
            if not alike and not self._by_crossings(waves[which]):
                self.found.append(timed)
                return
            self._cross_of(waves.ravel(), first[others], crossed[others])
            fits = None
            if alike:
                high_passed(waves.ravel(), first[others], self.white, sounds[others])
                fits = self._model(sounds, plain, crossed[:, 0].copy())
            if self.model is None and self._by_crossings(waves[which]):
                self.crossing = True
                above = crossed[np.isfinite(crossed[:, 1]), 1]
                self.spread = HALF_WAVES * middle(above) if len(above) else np.nan
                earlier = np.empty((len(spread), 3))
                self._cross(plain, earlier, EARLIER)
                since = (crossed[few, 0] - earlier[:, 0])[np.isfinite(earlier[:, 0])]
                if len(since):  # between two fractions of a sound it scatters as from its start on
                    self.spread = max(self.spread, float(np.std(since)))
            if self._applies:
                timed[which] = self._shifts(crossed, fits)
                timed[LEARN:] = self._timed(waves.ravel(), self._places(len(waves))[LEARN:])
        self.found.append(timed)

    def _by_crossings(self, waves: np.ndarray) -> bool:
        """Whether crossings are better than attacks where there is no model."""
        return self.rate <= SLOW and middle(self._abruptness(waves)) < ABRUPT

    def _model(self, sounds: np.ndarray, plain: np.ndarray, guess: np.ndarray) -> np.ndarray | None:
        """Learn the model of sounds that start near a guess, and fit it to them.

        The filter is chosen by the first few, of which the high-pass filter leaves `plain`. None if
        they have no model.
        """
        few, noise, heard = len(plain), self._noise(sounds), float(np.sum(self.taps**2))
        chosen = chosen_model(sounds, guess, few, noise, self.rate, self.white, heard, UNLIKE)
        if chosen is None:
            return None
        model, held = chosen
        model.compare(held, STRANGE)
        fits = model.fit(sounds, guess)
        instant, _, left = fits.T
        fitted = np.isfinite(instant)
        if fitted.sum() >= LEAST and middle(left[fitted]) <= UNLIKE:
            late = (guess - instant)[fitted]
            self.model = model
            self.gradual = self._gradual(plain, instant[:few])
            self.latency = middle(late)
            self.spread = DEVIATION_BY_MEDIAN * middle(np.abs(late - self.latency))
            return fits
        return None

    def _gradual(self, plain: np.ndarray, instant: np.ndarray) -> float:
        """Scatter of instants that comes of sounds which begin more slowly than their model."""
        before, after = (round(t * self.rate) for t in ABOUT)
        first = np.rint(np.where(np.isfinite(instant), instant, -1.0)).astype(int) - before
        there = (first >= 0) & (first + before + after <= plain.shape[1])
        if np.count_nonzero(there) < LEAST:
            return 0.0
        about = np.lib.stride_tricks.sliding_window_view(plain, before + after, axis=1)
        parts = about[there, first[there]]
        energy = np.einsum("ij,ij->i", parts, parts)
        parts /= np.sqrt(np.where(energy > FAINTEST, energy, 1.0))[:, None]
        total = np.einsum("ij,ij->j", parts, parts)
        return math.sqrt(max(spread_of(total, before, self.rate) ** 2 - RISE**2, 0.0))

    def _whiten(self, waves: np.ndarray, plain: np.ndarray) -> None:
        """Learn a filter that whitens noise as well; the other one leaves `plain` of waves."""
        error = FIRST_ERROR * middle(np.einsum("ij,ij->i", plain, plain))
        quiet = waves[:, : round(NOISE * self.rate)]
        self.white = whitening(quiet, self.taps, self.rate, error)

    def _noise(self, sounds: np.ndarray) -> float:
        """The white noise of a sample of sounds after that filter."""
        quiet = sounds[:, : round(QUIET * self.rate)]
        energy = middle(np.einsum("ij,ij->i", quiet, quiet))
        return energy / (quiet.shape[1] * float(np.sum(self.taps**2)))

    def _timed(self, x: np.ndarray, first: np.ndarray) -> np.ndarray:
        """Shift and standard error of the attack of each wave of x, which begins at `first`.

        NaN if unknown, as where a wave is incomplete: its first sample is then negative.
        """
        if not self._applies:
            return np.full((len(first), 2), np.nan)
        crossed, fits = np.empty((len(first), 3)), None
        self._cross_of(x, first, crossed)
        if self.model is not None:
            guess = crossed[:, 0]
            begins, width = self.model.begins(guess), self.model.width
            fit = (begins >= 0) & (begins + width <= self.length - len(self.white) + 1)
            begins = np.where(fit, begins, 0)
            sounds = _parts(x, np.where(fit, first + begins, -1), self.white, width)
            fits = self.model.fit(sounds, np.where(fit, guess - begins, np.nan))
            fits[:, 0] += begins
        return self._shifts(crossed, fits)

    def _shifts(self, crossed: np.ndarray, fits: np.ndarray | None) -> np.ndarray:
        """Shifts by the fits of the model, or by crossings where it does not fit."""
        attack = self.before - len(self.taps) // 2 - 0.5
        timed = np.empty((len(crossed), 2))
        timed[:, 0] = crossed[:, 0] - self.latency - attack
        timed[:, 1] = np.hypot(self.spread, crossed[:, 2])
        if fits is not None:
            instant, error, left = fits.T
            alike = left <= STRANGE
            timed[alike, 0] = instant[alike] - attack
            timed[alike, 1] = np.hypot(error[alike], self.gradual)
        return timed

    def _places(self, count: int) -> np.ndarray:
        """Where so many waves in a row begin."""
        return self.length * np.arange(count)

    def _cross(self, plain: np.ndarray, out: np.ndarray, shares: tuple = SHARES) -> None:
        """Result of `crossings` for each wave after the high-pass filter."""
        quiet, begin, end = (round(t * self.rate) for t in (QUIET, *SEARCH))
        crossings(plain, quiet, begin, end, shares, out)

    def _cross_of(self, x: np.ndarray, first: np.ndarray, out: np.ndarray) -> None:
        """The same for the waves of x that begin at `first`."""
        end = round(SEARCH[1] * self.rate) + NEAR_TAPS
        self._cross(_parts(x, first, self.taps, end), out)

    def _abruptness(self, waves: np.ndarray) -> np.ndarray:
        count, found = round(BEGINNING * self.rate), np.empty(len(waves))
        abruptness(waves, self.before, self.lag, self.slope, count, found)
        return found


def _parts(x: np.ndarray, first: np.ndarray, taps: np.ndarray, count: int) -> np.ndarray:
    """So many filtered samples of x from each of the first on."""
    sounds = np.empty((len(first), count))
    high_passed(x, first, taps, sounds)
    return sounds
