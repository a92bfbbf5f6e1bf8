"""Assignment of impacts to two stops by their sound.

The sound of each impact is seen by its power in sixths of an octave, as the logarithm, noise
apart, and less its mean over the bands: what is left does not depend on how hard the stop was hit.
Impacts of stops that sound different form clusters there: a mixture of Gaussian distributions with
one covariance, fitted by expectation and maximisation in the three principal components. Chance
makes clusters too, at up to 4.4 standard deviations from each other in trains of 60 to 300 impacts
of one sound; sounds whose modes lie a tenth apart in frequency are 7 and more apart. Where there
are two, what faint ones of either sound like is then allowed for (`_kinds_by_strength.py`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from .._arguments import instance
from .._showing import Shown
from ..errors import InvalidInput
from ..impacts import Impacts
from ..recording import Recording, chosen_channel
from ._kinds_by_strength import kinds_by_strength

LONGEST = 8e-3
"""Of a sound that is looked at [s]."""
LOWEST = 300.0
"""Of the bands [Hz]."""
SLOWEST = 2000.0
"""Rate that leaves bands to compare [Hz]."""
PER_OCTAVE = 6
COMPONENTS = 3
FLOOR = 2.0
"""Times the noise, added to the power of a band."""
APART = 5.0
"""Standard deviations between two kinds of sound."""
FEWEST = 20
BEGINNINGS, ROUNDS = 8, 200


@dataclass(frozen=True, eq=False)
class StopSeparation(Shown):
    """Impacts assigned to two stops by their sound.

    Attributes
    ----------
    impacts : Impacts
        The impacts, with `stop_index` if there are two kinds of sound (0 for the kind of the first
        impact), and `stop_probability`, the probability of the stop assigned.
    probability : ndarray, shape (n, 2), or None
        Probability of each stop, for each impact.
    distance : float
        Distance between the two kinds, in standard deviations of a kind along the line between
        them.
    reason : str
        Why the impacts cannot be separated; otherwise empty.

    See Also
    --------
    separate_stops, combine_impacts

    Examples
    --------
    >>> from impactsig import Impacts, separate_stops, synthesize
    >>> train = Impacts.from_times([0.1, 0.2, 0.3], start=0.0, duration=0.5)
    >>> found = separate_stops(synthesize(train, "sound", seed=1), train)
    >>> found.reason
    '3 impacts are too few: 20 are needed'
    """

    impacts: Impacts
    probability: np.ndarray | None = field(repr=False)
    distance: float
    reason: str = ""


def separate_stops(
    recording: Recording, impacts: Impacts, channel: str | int | None = None
) -> StopSeparation:
    """Assign impacts to two stops by their sound in one microphone.

    Parameters
    ----------
    recording : Recording
        The recording in which the impacts were detected.
    impacts : Impacts
        Impacts in the clock of the recording, as returned by `detect_impacts`.
    channel : str or int, optional
        The channel of the microphone, if there are several.

    Returns
    -------
    StopSeparation

    Raises
    ------
    InvalidInput
        If an argument has the wrong type, no channel is chosen among several, or the rate is below
        2 kHz.

    See Also
    --------
    detect_impacts, combine_impacts

    Notes
    -----
    A kind with fewer than one in twenty of the impacts is not found. Missing samples are treated as
    silence.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import numpy as np
    >>> from impactsig import Impacts, Microphone, separate_stops, synthesize
    >>> train = Impacts.from_times(0.1 * np.arange(1, 31), start=0.0, duration=3.2)
    >>> low = synthesize(train, Microphone(modes=[(3000.0, 0.005, 1.0)], phases=[0.0]), seed=1)
    >>> high = synthesize(train, Microphone(modes=[(6000.0, 0.003, 1.0)], phases=[0.0]), seed=2)
    >>> turn = np.floor(np.arange(len(low.samples)) / low.rate / 0.1) % 2
    >>> both = replace(low, samples=np.where(turn == 0, low.samples, high.samples))
    >>> found = separate_stops(both, train)
    >>> found.impacts.stop_index[:6]
    array([0, 1, 0, 1, 0, 1])
    """
    instance("recording", recording, Recording, "a Recording", "impactsig.read makes one")
    instance("impacts", impacts, Impacts, "Impacts")
    one = chosen_channel(recording, channel)
    if one.rate < SLOWEST:
        raise InvalidInput("recording", one.rate, f"a rate of {SLOWEST:g} Hz or more")
    if len(impacts) < FEWEST:
        reason = f"{len(impacts)} impacts are too few: {FEWEST} are needed"
        return StopSeparation(_unknown(impacts), None, 0.0, reason)
    colours, loudness = _colours(one, impacts.time)
    if not colours.any():
        reason = "the recording is silent at the impacts"
        return StopSeparation(_unknown(impacts), None, 0.0, reason)
    centred = colours - colours.mean(axis=0)
    u, s, _ = np.linalg.svd(centred, full_matrices=False)
    places = (u * s)[:, :COMPONENTS]
    probability, distance = _two_clusters(places)
    least = probability.sum(axis=0).min()
    if distance < APART or least < max(0.05 * len(impacts), 2.0):
        reason = (
            f"the sounds form no two clusters: the best two are {distance:.1f} standard "
            f"deviations apart, {APART:g} are needed"
        )
        return StopSeparation(_unknown(impacts), None, distance, reason)
    probability = kinds_by_strength(places, loudness, probability)
    if probability[0, 0] < probability[0, 1]:
        probability = probability[:, ::-1]
    assigned = replace(
        impacts,
        stop_index=np.argmax(probability, axis=1),
        # Sums of exponentials may round to a little more than 1.
        stop_probability=np.minimum(probability.max(axis=1), 1.0),
    )
    return StopSeparation(assigned, probability, distance)


def _unknown(impacts: Impacts) -> Impacts:
    return replace(impacts, stop_index=None, stop_probability=None)


def _colours(recording: Recording, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Log power in each band minus its mean, shape (impacts, bands), and that of all."""
    x, rate = _finite_samples(recording.samples), recording.rate
    count = max(int(LONGEST * rate), 8)
    size = 1 << math.ceil(math.log2(2 * count))
    highest = 0.95 * rate / 2
    number = max(int(PER_OCTAVE * math.log2(highest / LOWEST)), 2)
    edges = np.geomspace(LOWEST, highest, number + 1)
    band = np.searchsorted(edges, np.fft.rfftfreq(size, 1 / rate), side="right") - 1
    inside = (band >= 0) & (band < number)
    fade = np.hanning(2 * count)[count:]

    def powers(first: np.ndarray, taper: np.ndarray) -> np.ndarray:
        padded = np.pad(x, (count, count))
        rows = padded[(np.clip(first, -count, len(x)) + count)[:, None] + np.arange(count)]
        spectrum = np.abs(np.fft.rfft(rows * taper, size)) ** 2
        total = np.zeros((len(rows), number))
        np.add.at(total.T, band[inside], spectrum.T[inside])
        return total

    place = np.clip((time - recording.start) * rate, -count, len(x) + 2 * count)
    first = np.ceil(place).astype(int)
    heard = powers(first, fade)
    noise = np.median(powers(first - count - count // 4, fade[::-1]), axis=0)
    known = heard.mean(axis=0) > 0
    if not known.any():
        return np.zeros((len(heard), 2)), np.zeros(len(heard))
    logs = np.log(heard[:, known] + FLOOR * noise[known] + 1e-12 * heard[:, known].mean())
    total = heard[:, known].sum(axis=1)
    return logs - logs.mean(axis=1, keepdims=True), np.log(total + 1e-12 * total.mean())


def _finite_samples(samples: np.ndarray) -> np.ndarray:
    """Samples scaled by a power of 2 to about 1; missing ones take the mean of the others."""
    x = np.array(samples, float)
    known = np.isfinite(x)
    greatest = np.abs(x[known]).max(initial=0.0)
    if greatest == 0.0:
        return np.zeros(len(x))
    x = np.ldexp(x, -math.frexp(greatest)[1])
    x[~known] = x[known].mean()
    return x


def _two_clusters(places: np.ndarray) -> tuple[np.ndarray, float]:
    """Probability of either cluster, shape (n, 2), and their separation."""
    rng = np.random.default_rng(0)
    best, found = -math.inf, (np.full((len(places), 2), 0.5), 0.0)
    for _ in range(BEGINNINGS):
        centre = places[rng.choice(len(places), 2, replace=False)]
        near = ((places[:, None] - centre) ** 2).sum(axis=2).argmin(axis=1)
        share = np.eye(2)[near]
        likelihood, distance = -math.inf, 0.0
        for _ in range(ROUNDS):
            before = share
            likelihood, share, distance = _round(places, share)
            if np.abs(share - before).max() < 1e-6:
                break
        if likelihood > best:
            best, found = likelihood, (share, distance)
    return found


def _round(places: np.ndarray, share: np.ndarray) -> tuple[float, np.ndarray, float]:
    """One round of expectation maximisation: log likelihood, shares, separation."""
    count, size = places.shape
    weight = share.sum(axis=0) + 1e-9
    centre = (share.T @ places) / weight[:, None]
    off = places[:, None] - centre
    covariance = np.einsum("nk,nki,nkj->ij", share, off, off) / count
    covariance += 1e-9 * (np.trace(covariance) + 1e-300) * np.eye(size)
    inverse = np.linalg.inv(covariance)
    logs = np.log(weight / count) - 0.5 * np.einsum("nki,ij,nkj->nk", off, inverse, off)
    top = logs.max(axis=1, keepdims=True)
    likely = np.exp(logs - top)
    total = likely.sum(axis=1, keepdims=True)
    log_likelihood = float((top + np.log(total)).sum())
    log_likelihood -= 0.5 * count * float(np.linalg.slogdet(covariance)[1])
    between = centre[1] - centre[0]
    return log_likelihood, likely / total, math.sqrt(float(between @ inverse @ between))
