"""Mutual alignment of similar sounds, to a fraction of a sample.

A structure that is hit at one place has the same waveform each time, except for the strength. The
attack alone determines the instant to a sample; the whole waveform, aligned with that of the other
impacts, to a hundredth of one. The waveform is the least-squares mean of up to LEARN impacts, which
are aligned with the one that is similar to most others, and then with their mean. The shift of an
impact minimises the residual of p times the waveform. A constant, the median shift of the impacts
learned from, is subtracted, so that on average instants are those of the attacks, or of shared
modes (`shared_modes.py`).

A sound is alike if the waveform leaves at most 1 - ALIKE^2 of its power, apart from noise. The
instants of attacks are kept unless half of the impacts are alike and their shifts agree with their
attacks: sounds of the same tones in other phases can be alike after a large shift. For sounds that
differ in phase, hardly anything between samples can be determined, since a slightly later instant
with other phases gives the same samples.

The error of a shift includes how sounds differ from each other (`_misfit`), and how much of a shift
may be the phase of a single mode.

Sounds are compared by the innovations with which attacks are timed, in which hum and low tones of a
room are weak.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...._numerics.spread import DEVIATION_BY_MEDIAN
from .._nearby import middle
from ._alike_kernels import ROWS, SHIFTS, TAPS, lay_over, mean_wave, shift_wave, unexplained

REACH = 0.25e-3  # [s], by which the attack of a clear sound may be off
FAR = 2.4e-3  # [s], of one in noise or behind a filter that rings before it
QUIET = 1e-3  # [s], before all that, by which noise is known
BESIDE = 3  # samples left out on either side of the attack: a jump is not the same in all sounds
LEARN = 256  # impacts that the waveform is learned from
LEADERS = 8  # of them that are tried as the first waveform
LEAST = 8  # impacts that make a waveform
FINEST = 32_000.0  # [Hz], the rate of the shifts tried first
ALIKE = 0.9  # correlation with the waveform
UNLIKE = 0.05  # of the power of all together that they may leave beyond noise
CLEAR = 0.02  # fraction of its power left of a sound with so little noise that its attack is right
AGREE = 60e-6  # [s], by which the attack and the waveform may differ in the median
AGREE_IN_NOISE = 150e-6  # [s], at most, if what is left is noise: two standard errors of attacks
QUARTERS = 4  # of the sounds, laid one after the other
SOME, BEYOND = 0.1, 5.0  # fraction, at most, that may differ by more standard errors: by a period
ONE_LAGS, ONE_LEFT = (1, 2, 3), 0.04  # lags, and power unexplained at most, of a single mode
ATTACKS = 0.5  # variance of attacks, at least, over the one that is stated
INTERPOLATED = 5e-4  # fraction of its power that interpolation may leave of a sound
COMPARED = 64  # sounds that show how all differ
PASSES = 3  # over the impacts learned from
FITTED = 2  # numbers fitted to a sound
FINEST_SHIFT = 1e-3  # [samples], to which shifts are computed
LEAST_CERTAIN = 0.25  # share of the power of the wave's slope that is not its noise, at least
LEAST_COLOUR = 0.1  # variance of a shift, over that in white noise, that is believed


class Lengths(NamedTuple):
    """Lengths in samples: a sound is kept from `before` its attack on, the wave from `first`.

    `parts`: shifts tried first for each sample. `edges`: where innovations jump if the sound does.
    """

    reach: int
    far: int
    agree: float
    agree_in_noise: float
    edges: tuple[int, int, int]
    stride: int
    parts: int
    pad: int
    first: int
    before: int
    size: int
    length: int


def lengths_at(rate: float, lag: int, slope: int, size: int) -> Lengths:
    """Lengths at a sampling rate, for waves that last `size` after the attack.

    `lag` and `slope` are those of the innovations.
    """
    reach, far = max(round(REACH * rate), 4), max(round(FAR * rate), 2)
    pad = TAPS + 1
    first = far + pad + TAPS + max(round(QUIET * rate), 2)
    size += reach
    parts = 1
    while parts < SHIFTS and parts * rate < FINEST:
        parts *= 2
    return Lengths(
        reach,
        far,
        AGREE * rate,
        AGREE_IN_NOISE * rate,
        (0, lag, lag + slope),
        lag,
        parts,
        pad,
        first,
        first + reach,
        size,
        2 * first + size,
    )


@dataclass
class Waveform:
    """The common waveform of the impacts used for learning."""

    shifts: np.ndarray  # (ROWS, size)
    latency: float  # shift that leaves their instants at the reference, in the median
    gain: float  # variance of the shift of a sound of factor 1, over the power of its noise
    colour: float  # that variance over the one in white noise
    misfit: float  # variance of a sound of factor 1 in a direction in which sounds differ
    lever: float  # variance of the shift of a sound of factor 1, over the misfit
    phase: float  # variance of shifts that are phases


@dataclass
class Overlay:
    """Shifts of the impacts of a record, in sequence.

    `reference` gives the shifts of so many impacts taken last that are known by other means and
    their standard errors, and NaN for the others, whose attacks count.
    """

    lengths: Lengths
    reference: Callable[[int], tuple[np.ndarray, np.ndarray]]
    taper: np.ndarray = field(init=False)
    weight: np.ndarray = field(init=False)  # without what the edges touch
    wave: Waveform | None = None
    learned: bool = False
    held: list[np.ndarray] = field(default_factory=list)
    spreads: list[np.ndarray] = field(default_factory=list)
    count: int = 0
    found: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        rising, falling = self.lengths.reach, self.lengths.size // 3
        self.taper = np.ones(self.lengths.size)
        self.taper[:rising] = 0.5 - 0.5 * np.cos(np.pi * (np.arange(rising) + 0.5) / rising)
        self.taper[-falling:] = 0.5 + 0.5 * np.cos(np.pi * (np.arange(falling) + 0.5) / falling)
        self.weight = self.taper.copy()
        for edge in self.lengths.edges:
            self.weight[rising + edge - BESIDE : rising + edge + BESIDE] = 0.0

    def add(self, sounds: np.ndarray, spread: np.ndarray) -> None:
        """Add the sounds (n, length) of the next impacts, with standard errors of attacks."""
        if self.learned:
            self.found.append(self._shifts(sounds, self._expected(spread)))
            return
        self.held.append(sounds.copy())  # they come as part of much more
        self.spreads.append(spread)
        self.count += len(sounds)
        if self.count >= LEARN:
            self._learn()

    def timing(self) -> np.ndarray:
        """Shift and standard error of every impact, shape (2, n); NaN where unchanged."""
        if not self.learned:
            self._learn()
        return np.concatenate(self.found).T

    def _learn(self) -> None:
        sounds = np.concatenate([np.empty((0, self.lengths.length)), *self.held])
        expected = self._expected(np.concatenate([np.empty(0), *self.spreads]))
        self.wave = self._waveform(sounds[:LEARN], expected[:LEARN])
        self.learned, self.held, self.spreads = True, [], []
        self.found.append(self._shifts(sounds, expected))

    def _expected(self, spread: np.ndarray) -> np.ndarray:
        """Prior shift and standard error of the last impacts."""
        shift, error = self.reference(len(spread))
        known = np.isfinite(shift)
        return np.stack((np.where(known, shift, 0.0), np.where(known, error, spread)), axis=1)

    def _shifts(self, sounds: np.ndarray, expected: np.ndarray) -> np.ndarray:
        """Shift and standard error; NaN for sounds unlike the wave."""
        found = np.full((len(sounds), 2), np.nan)
        if self.wave is not None:
            expected = np.add(expected, (self.wave.latency, 0.0))
            wave = self.wave
            laid = self._lay(sounds, expected, wave.shifts, CLEAR, wave.colour, wave.misfit)
            alike = _alike(laid)
            shift, factor, left, _, _, elsewhere = laid[alike].T
            power = left / max(self.weight.sum() - FITTED, 1.0)
            near = wave.gain * power / factor**2 + FINEST_SHIFT**2
            near += wave.lever * wave.misfit + wave.phase
            found[alike, 0] = shift - self.wave.latency
            found[alike, 1] = np.sqrt(near + elsewhere)
        return found

    def _waveform(self, sounds: np.ndarray, expected: np.ndarray) -> Waveform | None:
        if len(sounds) < LEAST:
            return None
        lengths = self.lengths
        part = slice(lengths.first - lengths.pad, lengths.first + lengths.size + lengths.pad)
        strongest = np.argsort(-np.einsum("ij,ij->i", sounds, sounds), kind="stable")
        # Every so many of the stronger half: the others are noisier.
        some = strongest[: -(-len(sounds) // 2)][:: -(-len(sounds) // (2 * LEADERS))]
        leaders = sounds[some]
        anywhere = np.tile((0.0, np.inf), (len(sounds), 1))  # where they agree is to be seen
        shifts = np.empty((ROWS, lengths.size))
        wave, most = leaders[0, part].copy(), -1
        for leader in leaders:
            shift_wave(leader[part], lengths.pad, shifts)
            count = int(_alike(self._lay(leaders, anywhere, shifts, 0.0, 1.0)).sum())
            if count > most:
                wave, most = leader[part].copy(), count
            if most == len(leaders):
                break
        if most < len(leaders) / 2:
            return None
        for turn in range(PASSES):
            shift_wave(wave, lengths.pad, shifts)
            laid = self._lay_if_alike(sounds, anywhere, shifts)
            if laid is None:
                return None
            alike = _alike(laid)
            fits, error = laid[alike], expected[alike, 1]
            shift, factor = fits[:, 0], fits[:, 1]
            latency, apart = _apart(fits, expected[alike])
            if middle(apart) > self._agree(fits, error):
                return None
            if np.mean(apart > np.maximum(lengths.agree, BEYOND * error)) > SOME:
                return None
            if turn < PASSES - 1:
                # It is to begin where attacks do, not where that of its leader was taken to be.
                move = shift - latency
                near = np.abs(move) <= lengths.far  # no more of a sound is kept
                mean_wave(sounds[alike][near], move[near], factor[near], part.start, wave)
        gain, colour = self._gain(shifts, sounds[alike])
        halves = np.empty((2, ROWS, lengths.size))
        for half, rows in enumerate(halves):
            mean_wave(sounds[alike][half::2], shift[half::2], factor[half::2], part.start, wave)
            shift_wave(wave, lengths.pad, rows)
        certain = self._sum(_slope(halves[0]), _slope(halves[1])) / self._sum(*2 * [_slope(shifts)])
        certain = max(certain, LEAST_CERTAIN)
        phase = 0.0
        if self._one_mode(shifts[ROWS // 2]):
            # Another phase is another shift: only attacks tell how much of either there is.
            known = max(middle(error), 12.0**-0.5) ** 2
            total = (DEVIATION_BY_MEDIAN * middle(apart)) ** 2
            if total > 2.0 * known:
                return None
            phase = _beyond(total, known)
        misfit = self._misfit(shifts[ROWS // 2], sounds[alike], fits)
        lever = self._lever(shifts)
        return Waveform(shifts, latency, gain / certain**2, colour, misfit, lever, phase)

    def _agree(self, laid: np.ndarray, error: np.ndarray) -> float:
        """Tolerated median difference of instants with these errors from shifts."""
        _, _, left, own, noise, _ = laid.T
        if np.sum(left - noise) > UNLIKE * max(np.sum(own - noise), 0.0):
            return self.lengths.agree
        doubtful = min(2.0 * middle(error), self.lengths.agree_in_noise)
        return max(self.lengths.agree, doubtful)

    def _gain(self, shifts: np.ndarray, sounds: np.ndarray) -> tuple[float, float]:
        """Variance of the shift of a sound equal to the wave, in unit noise.

        The noise is as coloured as what precedes the sounds. Beside it the variance of a response
        to it over that in white noise.
        """
        by_sample = self._by_sample(shifts)
        wave = shifts[ROWS // 2]
        quiet = sounds[:, : self.lengths.first - self.lengths.far]
        count = quiet.shape[1]
        alike = [np.mean(quiet[:, lag:] * quiet[:, : count - lag]) for lag in range(count // 2)]
        return _variance(by_sample, alike), _variance(self.taper * wave, alike, white=True)

    def _by_sample(self, shifts: np.ndarray) -> np.ndarray:
        """What each sample of a sound of factor 1 contributes to its shift."""
        wave, slope = shifts[ROWS // 2], _slope(shifts)
        tt, ts, ss = (self._sum(a, b) for a, b in ((wave, wave), (wave, slope), (slope, slope)))
        return np.asarray(self.weight * (tt * slope - ts * wave) / (tt * ss - ts * ts))

    def _one_mode(self, wave: np.ndarray) -> bool:
        """Whether each sample of the wave follows from two earlier ones, as in a decaying tone."""
        ringing = wave[self.lengths.reach + self.lengths.edges[-1] + BESIDE :]
        for lag in ONE_LAGS:
            if len(ringing) < 4 * lag:
                return False
            last = ringing[2 * lag :]
            earlier = np.stack((ringing[: -2 * lag], ringing[lag:-lag]))
            (a, b), gram = earlier @ last, earlier @ earlier.T
            square = gram[1, 1] * a * a - 2.0 * gram[0, 1] * a * b + gram[0, 0] * b * b
            det = gram[0, 0] * gram[1, 1] - gram[0, 1] ** 2
            if not square > (1.0 - ONE_LEFT) * det * float(last @ last):
                return False
        return True

    def _lever(self, shifts: np.ndarray) -> float:
        """Variance of the shift of a sound of factor 1, over that of what the wave leaves of it."""
        by_sample, some = self._by_sample(shifts), self.weight > 0.0
        return float(np.sum(by_sample[some] ** 2 / self.weight[some]))

    def _misfit(self, wave: np.ndarray, sounds: np.ndarray, laid: np.ndarray) -> float:
        """Variance of a sound of factor 1 in any of the directions in which sounds differ.

        With r what the wave leaves of a sound, C its covariance, less that of the noise, it is
        tr C^2 / tr C: the trace over the number of directions. As sounds of a few modes differ in
        a few, it is much more than the power of a sample, and one of them is that of a shift. What
        lies beside the attack, or is as little as INTERPOLATED, is not theirs.
        """
        some = slice(None, None, -(-len(sounds) // COMPARED))
        sounds, (shift, factor, _, _, noise, _) = sounds[some], laid[some].T
        count, quiet = len(sounds), self.lengths.first - self.lengths.far
        late = self.lengths.reach + self.lengths.edges[-1] + BESIDE
        whole, wave, weight = wave, wave[late:], self.weight[late:]
        left = np.empty((count, len(wave)))
        unexplained(sounds, shift, factor, self.lengths.first + late, wave, weight, left)
        before = sounds[:, :quiet] / factor[:, None]
        pairs = ~np.eye(count, dtype=bool)
        products, by_noise = left @ left.T, before @ before.T
        scale, energy = float(weight.sum()) / quiet, float(np.sum(weight * wave**2))
        squares = (products**2 - scale * by_noise**2).sum(axis=1, where=pairs) / (count - 1)
        heard = float(weight.sum() / self.weight.sum())
        total = float(np.mean(np.diag(products) - heard * noise / factor**2))
        certain = float(np.mean(squares) - 2.0 * np.std(squares) / np.sqrt(count))
        if not (certain > 0.0 and total > INTERPOLATED * energy):
            return 0.0
        return certain / total * self._sum(whole, whole) / energy

    def _sum(self, a: np.ndarray, b: np.ndarray) -> float:
        return float(np.sum(self.weight * a * b))

    def _lay_if_alike(
        self, sounds: np.ndarray, near: np.ndarray, shifts: np.ndarray
    ) -> np.ndarray | None:
        """The result of `_lay`; None as soon as too few can be alike."""
        spare, laid = len(sounds) - max(LEAST, len(sounds) / 2), np.empty((len(sounds), 6))
        for first in range(min(QUARTERS, len(sounds))):
            some = slice(first, None, QUARTERS)
            laid[some] = self._lay(np.ascontiguousarray(sounds[some]), near[some], shifts, 0.0, 1.0)
            spare -= np.count_nonzero(~_alike(laid[some]))
            if spare < 0.0:
                return None
        return laid

    def _lay(
        self,
        sounds: np.ndarray,
        expected: np.ndarray,
        shifts: np.ndarray,
        clear: float,
        colour: float,
        misfit: float = 0.0,
    ) -> np.ndarray:
        laid, lengths = np.empty((len(sounds), 6)), self.lengths
        near = expected.copy()
        near[:, 1] = np.maximum(near[:, 1], lengths.reach)
        lay_over(
            sounds, near, lengths, clear, colour, misfit, shifts, self.taper, self.weight, laid
        )
        return laid


def _variance(weights: np.ndarray, covariance: list, white: bool = False) -> float:
    """Variance of a weighted sum of coloured noise, scaled to unit power."""
    of_white = float(np.sum(weights**2))
    if not covariance[0] > 0.0:
        return 1.0 if white else of_white
    total = -covariance[0] * of_white
    for lag, value in enumerate(covariance[: len(weights)]):
        total += 2.0 * value * float(np.sum(weights[lag:] * weights[: len(weights) - lag]))
    colour = max(float(total / (covariance[0] * of_white)), LEAST_COLOUR)
    return colour if white else colour * of_white


def _apart(fits: np.ndarray, expected: np.ndarray) -> tuple[float, np.ndarray]:
    """How late shifts are in the median, and how far from that each is."""
    late = fits[:, 0] - expected[:, 0]
    latency = middle(late)
    return latency, np.abs(late - latency)


def _beyond(total: float, known: float) -> float:
    """Mean of what a variance has beyond that of attacks, which is at least ATTACKS of `known`."""
    least, most = max(total - known, 0.0), max(total - ATTACKS * known, 0.0)
    return (most**2 - least**2) / (2.0 * (1.0 - ATTACKS) * known)


def _slope(shifts: np.ndarray) -> np.ndarray:
    """Derivative of a wave by its shift."""
    middle = ROWS // 2
    return np.asarray(0.5 * SHIFTS * (shifts[middle + 1] - shifts[middle - 1]))


def _alike(laid: np.ndarray) -> np.ndarray:
    """Whether the residual of each sound is only noise and a fraction 1 - ALIKE**2."""
    shift, _, left, own, noise, _ = laid.T
    clear = left <= (1.0 - ALIKE**2) * own + 2.0 * ALIKE**2 * noise
    return np.isfinite(shift) & clear & (left <= 0.75 * own)
