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
slightly later impact with other phases gives the same samples. Where they are as great as may be,
a mode below the high-pass filter and a filter that is causal are tried as well.

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

import numpy as np

from ...._numerics.spread import DEVIATION_BY_MEDIAN
from .._growth_kernels import add_powers, spread_of
from .._lane_kernels import median_energy
from .._nearby import middle
from ._edge import high_pass, passed, whitening
from ._shared_exponents import Rings, SharedExponents, rings_of_shared, with_rings
from ._shared_modes_choice import chosen_model
from ._shared_modes_fit import FIRST_ERROR, LEAST, Behind, Model
from ._shared_modes_kernels import (
    NEAR_TAPS,
    abruptness,
    crossings,
    gather,
    high_passed,
    put_begins,
    shift_each,
)

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
_NONE, _NO_FITS = np.empty((0, 2)), np.empty((0, 3))


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
    waves: np.ndarray = field(init=False)  # about the first LEARN attacks, to learn from
    heard: np.ndarray = field(init=False)  # whether there is anything in each
    count: int = 0  # of them, so far
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
        self._forget()

    def add(self, x: np.ndarray, attacks: np.ndarray) -> None:
        """Add the next attacks, halfway between two of the samples x, all that are near them."""
        if self.rate > FASTEST or (self.learned and not self._applies):
            self.found.append(np.full((len(attacks), 2), np.nan))
        elif len(attacks):
            first = np.empty(len(attacks), np.int64)
            put_begins(attacks, self.before, self.length, len(x), first)
            if not self.learned:
                first = self._hold(x, first)
            if len(first):
                self.found.append(self._timed(x, first))

    @property
    def _applies(self) -> bool:
        return self.model is not None or self.crossing

    def timing(self) -> np.ndarray:
        """Shift of every impact and its standard error [samples], (n, 2); NaN if unknown."""
        if not self.learned:
            self._learn()
        timed = np.concatenate([_NONE, *self.found])
        if self._applies:
            known = np.isfinite(timed[:, 0])
            if known.any() and not known.all():
                # Too near to an end of the record: as late as the others are in the median.
                shift = timed[known, 0]
                usual = middle(shift)
                spread = DEVIATION_BY_MEDIAN * middle(np.abs(shift - usual))
                timed[~known] = usual, max(spread, 12.0**-0.5)
        return timed

    def last(self, count: int) -> np.ndarray:
        """Timing of the last so many impacts."""
        timed = self.timing()
        return timed[len(timed) - count :]

    def _hold(self, x: np.ndarray, first: np.ndarray) -> np.ndarray:
        """Keep the waves to learn from, and learn once there are enough; what is left of them."""
        if not self.count:
            self.waves, self.heard = np.empty((LEARN, self.length)), np.empty(LEARN, np.bool_)
        begin = self.count
        self.count = min(begin + len(first), LEARN)
        here, some = slice(begin, self.count), self.count - begin
        gather(x, first[:some], self.waves[here], self.heard[here])
        if self.count == LEARN:
            self._learn()
        return first[some:]

    def _forget(self) -> None:
        self.waves, self.heard = np.empty((0, self.length)), np.empty(0, np.bool_)

    def _learn(self) -> None:
        waves, which = self.waves[: self.count], self.heard[: self.count].nonzero()[0]
        self.learned = True
        self._forget()
        timed = np.full((len(waves), 2), np.nan)
        if len(which) >= LEAST:
            if len(which) > CHOOSE:
                spread = np.linspace(0, len(which) - 1, CHOOSE).astype(int)
                which = np.concatenate((which[spread], np.delete(which, spread)))
            few, others = slice(min(len(which), CHOOSE)), slice(CHOOSE, None)
            sounds = np.empty((len(which), self.length - len(self.taps) + 1))
            plain, crossed = np.empty_like(sounds[few]), np.empty((len(which), 3))
            samples, first = waves.ravel(), self.length * which
            high_passed(samples, first[few], self.taps, plain)
            self._cross(plain, crossed[few])
            self._whiten(waves[which[few]], plain)
            high_passed(samples, first[few], self.white, sounds[few])
            # Sounds that share nothing usually show it by a few.
            noise = self._noise(sounds[few])
            rings = rings_of_shared(sounds[few], crossed[few, 0], self.rate, noise)
            if rings is None and not self._by_crossings(waves[which]):
                self.found.append(timed)
                return
            self._cross_of(samples, first[others], crossed[others])
            fits = None
            if rings is not None:
                high_passed(samples, first[others], self.white, sounds[others])
                rings = with_rings(rings, sounds[others], crossed[others, 0], self.rate)
                fits = self._model(rings, sounds, plain, crossed[:, 0].copy())
            if self.model is None and self._by_crossings(waves[which]):
                self.crossing = True
                above = crossed[np.isfinite(crossed[:, 1]), 1]
                self.spread = HALF_WAVES * middle(above) if len(above) else np.nan
                earlier = np.empty((len(plain), 3))
                self._cross(plain, earlier, EARLIER)
                since = (crossed[few, 0] - earlier[:, 0])[np.isfinite(earlier[:, 0])]
                if len(since):  # between two fractions of a sound it scatters as from its start on
                    self.spread = max(self.spread, float(np.std(since)))
            if self._applies:
                timed[which] = self._shifts(crossed, fits)
        self.found.append(timed)

    def _by_crossings(self, waves: np.ndarray) -> bool:
        """Whether crossings are better than attacks where there is no model."""
        return self.rate <= SLOW and middle(self._abruptness(waves)) < ABRUPT

    def _model(
        self, rings: Rings, sounds: np.ndarray, plain: np.ndarray, guess: np.ndarray
    ) -> np.ndarray | None:
        """Learn the model of sounds that start near a guess, and fit it to them.

        Their modes are in their `rings`. The filter is chosen by the first few, of which the
        high-pass filter leaves `plain`. None if they have no model.
        """
        few, noise = slice(len(plain)), self._noise(sounds)
        behind = Behind(self.white, passed(self.rate), self.rate, noise)
        shared = SharedExponents(rings, noise)
        chosen = chosen_model(shared, sounds[few], guess[few], behind, UNLIKE)
        if chosen is None:
            return None
        model, starts = chosen
        fits = model.fit_first(sounds, guess, starts, STRANGE)
        instant, _, left = fits.T
        fitted = np.isfinite(instant)
        if fitted.sum() >= LEAST and middle(left[fitted]) <= UNLIKE:
            late = (guess - instant)[fitted]
            self.model = model
            self.gradual = self._gradual(plain, instant[few])
            self.latency = middle(late)
            self.spread = DEVIATION_BY_MEDIAN * middle(np.abs(late - self.latency))
            return fits
        return None

    def _gradual(self, plain: np.ndarray, instant: np.ndarray) -> float:
        """Scatter of instants that comes of sounds which begin more slowly than their model."""
        before, after = (round(t * self.rate) for t in ABOUT)
        first = np.rint(np.where(np.isfinite(instant), instant, -1.0)).astype(int) - before
        total = np.zeros(before + after)
        if add_powers(plain, first, 0, total) < LEAST:
            return 0.0
        return math.sqrt(max(spread_of(total, before, self.rate) ** 2 - RISE**2, 0.0))

    def _whiten(self, waves: np.ndarray, plain: np.ndarray) -> None:
        """Learn a filter that whitens noise as well; the other one leaves `plain` of waves."""
        error = FIRST_ERROR * median_energy(plain, 0, plain.shape[1])
        quiet = waves[:, : round(NOISE * self.rate)]
        self.white = whitening(quiet, self.taps, self.rate, error)

    def _noise(self, sounds: np.ndarray) -> float:
        """The white noise of a sample of sounds after that filter."""
        quiet = round(QUIET * self.rate)
        return float(median_energy(sounds, 0, quiet) / (quiet * passed(self.rate)))

    def _timed(self, x: np.ndarray, first: np.ndarray) -> np.ndarray:
        """Shift and standard error of the attack of each wave of x, which begins at `first`.

        NaN if unknown, as where a wave is incomplete: its first sample is then negative.
        """
        if not self._applies:
            return np.full((len(first), 2), np.nan)
        crossed, fits = np.empty((len(first), 3)), None
        self._cross_of(x, first, crossed)
        if self.model is not None:
            guess, length = crossed[:, 0].copy(), self.length - len(self.white) + 1
            begins = self.model.begins(guess, length)
            first = np.where(begins >= 0, first + begins, -1)
            sounds = _parts(x, first, self.white, self.model.width)
            fits = self.model.fit(sounds, guess, begins)
        return self._shifts(crossed, fits)

    def _shifts(self, crossed: np.ndarray, fits: np.ndarray | None) -> np.ndarray:
        """Shifts by the fits of the model, or by crossings where it does not fit."""
        attack = self.before - len(self.taps) // 2 - 0.5
        timed, fits = np.empty((len(crossed), 2)), _NO_FITS if fits is None else fits
        known = crossed, self.latency, self.spread, fits, STRANGE, self.gradual
        shift_each(*known, attack, timed)
        return timed

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
