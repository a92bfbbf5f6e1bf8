"""Impacts in a sound record: instants at which its power rises abruptly.

Four statistics are computed. The first is from octaves above about 1 kHz (5/3 wavelet), in frames
of at most 0.5 ms: with F_b the mean power over the 4 ms from a frame on, weighted by a line that
falls to zero, A_b that over the 4 ms before it, and L_b the background (`floor.py`), the rise is

    C = sum_b w_b max(0, ln(F_b / max(A_b, 2 L_b))),    w_b ~ 2^(-b/2) from the highest down:

the more coefficients an octave has, the less its rise scatters in noise. The second is from m
narrow bands, 24 per octave from 30 Hz (`bands.py`): with P_b the power now and Q_b the greatest of
a band and its two neighbours 10 ms before,

    B = 1/m sum_b max(0, ln(max(P_b, 2 L_b) / max(Q_b, 2 L_b))).

If the other bands are quiet, one band is sufficient. With x_b = P_b over the greater of L_b and
half of the power of the band 10 ms before, and n_b the degrees of freedom of P_b in noise, the
logarithm of the likelihood ratio of a rise is

    G = max_b n_b/2 (x_b - 1 - ln x_b),    x_b > 1.

H is the same for the mean power of an octave over some milliseconds, down to 170 Hz and relative to
the median nearby (`_rises.py`).

C separates impacts that follow within milliseconds. B detects them where other sound goes on, since
ringing does not raise it and a rattle does only slightly. G detects low tones, which do not raise C
(`_tones.py`). H detects those that decay at once, and distinguishes swelling power from impacts
(`_rise_odds.py`). `decision.py` combines them to the probability of an impact. Rounding by a
converter is not a rise: L_b is at least that of white noise with a variance of a quarter of its
squared step. Rises of single samples are clicks (`_clicks.py`): the record is searched again
without them. Many rises in a short time are pulses of a voice (`_voices.py`), and gradual rises
are swelling noise (`swells.py`, `gradual.py`). What returns where an overloaded sound leaves its
limits is no impact either (`overload.py`).

The attack is where, within 1.5 ms of the crest of C, the variance of the signal changes most
[Maeda1985]_: halfway between two samples. If impacts sound alike, their common waveform gives the
instants to a fraction of a sample (`sound/timing/alike.py`); if a filter rings before them, their
common modes do (`sound/timing/shared_modes.py`). Attacks of sounds that begin gradually scatter, by
the growth of their power (`_growth.py`).

Where hum leaks into the octaves, they are read behind a high-pass filter (`powers/hum.py`).

There are two passes over the record: `_survey.py` collects B and the crests of C, about a hundredth
of the record; then attacks are timed. Results do not depend on how the record is divided into
blocks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from ...errors import InvalidInput
from ...impacts import CLIPPED
from .._asked import parse_probability
from ..signal.stream import Piece, refuse_huge
from ._attack_kernels import clipped_after, measure
from ._clicks import BESIDE as CLICK
from ._clicks import are_clicks, lone_samples, repaired, repairs
from ._clipping import Limits
from ._cores import cores_of, window_size
from ._growth import Growth
from ._kernels import GROUP, Scale
from ._memory import keep_memory
from ._nearby import middle, middles
from ._survey import Survey
from ._windows import windows
from .deciding.calibrated import calibrated
from .deciding.decision import LATER, SOONER, candidates
from .deciding.doubt import EVEN, Doubt
from .deciding.gradual import gradual_odds, most_odds_beside, steady_odds
from .deciding.notes import (
    click_notes,
    codec_notes,
    converter_notes,
    crowd_notes,
    gate_notes,
    mains_notes,
    swell_notes,
    voice_notes,
)
from .deciding.overload import may_be_edges, overload_odds
from .deciding.swells import crowds, most_odds, sharpness
from .powers.hum import filtered, high_pass
from .timing.alike import Lengths, Overlay, lengths_at
from .timing.shared_modes import SharedModes

LONGEST_HOP = 0.5e-3  # [s]
FORWARD = 4e-3  # [s]
PAST = 4e-3  # [s]
SPACING = 3e-3  # [s], between impacts
LAG_RATES = (22_050.0, 8_000.0)  # [Hz], of the innovations an attack is timed in
SLOPE = 0.25e-3  # [s], of the straight line they are taken from
BESIDE = 60e-3  # [s], beside a window in which attacks are timed
COARSE = 10e-3  # [s], before and after an instant that is only known to some 10 ms
RINGING = 0.84, 0.75  # quantile of the time from attack to clear sound, and fraction in the errors
CLEAR_OF_HUM = 6.6  # [neper of power], of impacts that need no filter to be timed
FAR_FROM_1 = 200  # powers of 2, beyond which fourth powers of samples are no numbers


class SoundImpacts(NamedTuple):
    """Impacts detected in a sound record, with the evidence."""

    time: np.ndarray  # instants of attack since the first sample [s]
    peak: np.ndarray  # greatest deviation within 4 ms from the mean of the 4 ms before [unit]
    probability: np.ndarray  # that they are impacts
    flags: np.ndarray  # uint8
    threshold: float  # RMS that a sound must exceed to count at all [unit]
    noise: float  # RMS of the background in the octaves above 1 kHz [unit]
    alike: float  # fraction of the impacts that are timed by their waveform
    reason: str  # why there are none
    notes: tuple[str, ...]  # what makes them doubtful
    time_error: np.ndarray  # standard error of the instants [s]


class Chosen(NamedTuple):
    """The impacts of a passage, before their attacks are timed."""

    frame: np.ndarray
    coarse: np.ndarray
    spread: np.ndarray
    probability: np.ndarray
    may_be_edge: np.ndarray  # bool: of an overload
    steady: np.ndarray  # log-odds but for the attack, where a rise may be gradual; else infinite


def detect_sound(
    pieces: Callable[[], Iterable[Piece]], rate: float, *, least_probability: float = 0.5
) -> SoundImpacts:
    """Detect the impacts of a sound record.

    Parameters
    ----------
    pieces : callable
        Gives the record's stretches of finite samples, anew at each call.
    rate : float
        Sampling rate [Hz].
    least_probability : float
        Between 0 and 1: impacts that are less likely are left out. A lower one finds more.

    Raises
    ------
    InvalidInput
        If `least_probability` is not between 0 and 1, or the rate is not one of sound.

    Notes
    -----
    An impact in the first 4 ms or the last 6 ms of a stretch cannot be detected: there is too
    little beside it to compare.
    """
    parse_probability(least_probability)
    keep_memory()
    scale = scale_at(rate)
    gathered = surveyed(pieces, rate, scale)
    power = math.frexp(gathered.limits.size)[1]
    if abs(power) > FAR_FROM_1:
        found = detect_sound(
            lambda: scaled(pieces(), -power), rate, least_probability=least_probability
        )
        sizes = (np.ldexp(v, power) for v in (found.peak, found.threshold, found.noise))
        peak, threshold, noise = sizes
        return found._replace(peak=peak, threshold=float(threshold), noise=float(noise))
    found, clicks = search(gathered, pieces, rate, scale, least_probability)
    if not clicks:
        return found
    places, values = repairs(windows(pieces(), window_size(scale)), rate)

    def mended() -> Iterable[Piece]:
        return repaired(pieces(), places, values)

    gathered = surveyed(mended, rate, scale)
    found, more = search(gathered, mended, rate, scale, least_probability)
    return found._replace(notes=(*found.notes, *click_notes(len(places) + more)))


def scaled(pieces: Iterable[Piece], power: int) -> Iterable[Piece]:
    """The pieces of a record times a power of 2."""
    for first, samples in pieces:
        yield Piece(first, np.ldexp(samples, power))


class Surveyed(NamedTuple):
    """The evidence for impacts, the limits of the samples, and their number."""

    survey: Survey
    limits: Limits
    samples: int


def surveyed(pieces: Callable[[], Iterable[Piece]], rate: float, scale: Scale) -> Surveyed:
    """Go through the record for the first time; twice if there is hum to be filtered out."""
    gathered = surveyed_through(None, pieces, rate, scale)
    survey = gathered.survey
    gated = any(part.any() for passage in survey.passages for part in passage.silent)
    if not survey.backgrounds.hum or gated:  # silence would no longer be silent
        return gathered
    taps = high_pass(scale, rate, survey.bands, survey.backgrounds.hum)
    gathered = surveyed_through(taps, pieces, rate, scale)
    gathered.survey.hum_crest = math.log(survey.backgrounds.hum_crest)
    return gathered


def surveyed_through(
    taps: np.ndarray | None, pieces: Callable[[], Iterable[Piece]], rate: float, scale: Scale
) -> Surveyed:
    """Go through the record, with a filter before the octaves if there are `taps`."""
    survey = Survey(scale, rate, taps)
    samples, limits = 0, Limits()
    for window in windows(pieces(), window_size(scale)):
        samples += len(window.core)
        cores = cores_of(window.core, scale.hop)
        least, greatest = min(one.least for one in cores), max(one.greatest for one in cores)
        limits.add(window.core, least, greatest)
        refuse_huge(limits.least, limits.greatest)
        survey.add(window, cores)
    survey.finish()
    return Surveyed(survey, limits, samples)


def search(
    gathered: Surveyed,
    pieces: Callable[[], Iterable[Piece]],
    rate: float,
    scale: Scale,
    least_probability: float,
) -> tuple[SoundImpacts, int]:
    """The impacts but for clicks of single samples, and the number of these."""
    survey, limits, samples = gathered
    lowest, highest = limits.least, limits.greatest
    if not samples or lowest == highest:
        reason = "the record is constant" if samples else "the record has no valid sample"
        none = np.empty(0)
        flags = np.empty(0, np.uint8)
        return SoundImpacts(none, none, none, flags, 0.0, 0.0, 0.0, reason, (), none), 0
    backgrounds = survey.backgrounds
    noise = noise_rms(middles(np.stack(backgrounds.noise)), backgrounds.gains)
    doubt = Doubt()
    chosen, likeliest, left_out = choose(survey, least_probability, rate, doubt)
    lengths = sound_lengths(rate, scale)
    modes = SharedModes(rate, scale.short_lag, scale.slope)
    overlay = Overlay(lengths, modes.last)
    growth = Growth(rate, lengths.before)
    found, chances, spreads = [np.empty((0, 5))], [np.empty(0)], [np.empty(0)]
    single, sharp = [np.empty(0, np.bool_)], [np.empty((2, 0))]
    gradual, overload = [np.empty(0)], [np.empty(0)]
    crowded = {at: crowds(one.frame * (scale.hop / rate)) for at, one in chosen.items()}
    more = math.ceil(BESIDE * rate / scale.hop) + survey.spoilt
    taps = survey.taps
    # Innovations hear hum by the square of their lag, but a filter rings before loud impacts.
    clear = survey.hum_crest + CLEAR_OF_HUM + 4.0 * math.log(scale.short_lag * LAG_RATES[0] / rate)
    if taps is not None and loudness_of(survey, chosen) > clear:
        taps = None
    size = window_size(scale)
    for window in windows(pieces() if chosen else [], size):
        if window.segment not in chosen:
            continue
        passage, first = chosen[window.segment], window.first // scale.hop
        here = slice(*np.searchsorted(passage.frame, (first, first + size // scale.hop)))
        places = (more + passage.frame[here] - first) * scale.hop
        if not len(places):
            continue
        raw, valid = window.samples(more * scale.hop, more * scale.hop, scale.hop)
        x = raw if taps is None else filtered(raw, taps)
        for k in np.flatnonzero(passage.coarse[here]):
            places[k] = greatest_rise(x, int(places[k]), valid, scale, rate)
        out, sounds = np.empty((len(places), 5)), np.empty((len(places), lengths.length))
        measure(x, places, valid, (lowest, highest), scale, out, sounds)
        if taps is not None:
            clipped_after(raw, out[:, 0], valid, (lowest, highest), scale, out[:, 2])
        single.append(np.empty(len(places), np.bool_))
        lone_samples(raw, out[:, 0], valid, round(CLICK * rate), scale.reach, single[-1])
        sharp.append(np.full((2, len(places)), np.nan))
        dense = crowded[window.segment][here]
        if dense.any():
            lags = scale.long_lag, scale.slope
            sharp[-1][:, dense] = sharpness(x, out[dense, 0], valid, rate, *lags)
        lags = scale.short_lag, scale.slope
        gradual.append(gradual_odds(x, out[:, 0], passage.steady[here], valid, rate, lags))
        edges = out[:, 0], passage.may_be_edge[here]
        bounds = valid, (lowest, highest)
        overload.append(overload_odds(raw, *edges, *bounds, survey.spectrum, scale, rate))
        modes.add(x, valid, out[:, 0])
        overlay.add(sounds, np.sqrt(out[:, 3]))
        growth.add(sounds[passage.probability[here] >= EVEN])
        out[:, 0] += window.segment + window.first - more * scale.hop
        found.append(out)
        chances.append(passage.probability[here])
        spreads.append(passage.spread[here])
    columns = np.concatenate(found)
    likely = np.concatenate(chances)
    in_order = np.maximum.accumulate(columns[:, 0]) / rate
    most = most_odds(in_order, likely >= EVEN, *np.concatenate(sharp, axis=1))
    sudden = most_odds_beside(in_order, np.concatenate(gradual), likely >= EVEN)
    before = likely
    likely = np.minimum(likely, chance(np.minimum(most, sudden)))
    swells = (before >= least_probability) & (likely < least_probability)
    likely = np.minimum(likely, chance(np.concatenate(overload)))
    doubt.turn(before, likely)
    enough = likely >= least_probability
    (by_wave, wave_error), by_modes = overlay.timing(), modes.timing()
    # If an attack is off by more than the largest shift, the waveform is fitted a period beside.
    by_mode = np.where(np.isfinite(by_modes.shift), by_modes.shift, 0.0)
    apart = np.abs(by_wave - by_mode)
    beside = np.fmax(lengths.agree, 5.0 * by_modes.error)
    within = np.abs(by_mode) <= lengths.far
    alike = np.isfinite(by_wave) & (within | (apart <= beside))
    instant = shifted(columns[:, 0], np.where(alike, by_wave, by_modes.shift))
    spread = rate * np.concatenate(spreads)
    by_attack = np.hypot(np.hypot(attack_errors(columns), spread), growth.spread())
    # Where noise hides an attack, modes are now and then those of the noise beside the sound.
    hidden = np.hypot(np.sqrt(columns[:, 3]), spread)
    astray = np.minimum(hidden, hidden**3 / (0.5 * scale.reach) ** 2)
    error = np.where(alike, wave_error, np.hypot(by_modes.error, astray))
    error = np.where(instant == columns[:, 0], by_attack, error)
    # What may be no impact may as well begin anywhere within reach of where it was found.
    error = np.hypot(error, (1.0 - likely) ** 1.5 * scale.reach / math.sqrt(3.0))
    clicks = are_clicks(np.concatenate(single))
    reason = ""
    heard = columns[:, 1] > 0.0  # in samples that are mostly 0, an attack may have none to show
    if not (heard & enough).any():
        reason = (
            "the power rises nowhere as it does at an impact: the likeliest one has a "
            f"probability of {likely.max() if len(likely) else likeliest:.2g}"
        )
    kept = distinct(instant, likely)
    kept = kept[heard[kept] & ~clicks[kept] & enough[kept]]
    found_impacts = SoundImpacts(
        instant[kept] / rate,
        columns[kept, 1],
        likely[kept],
        (CLIPPED * columns[kept, 2]).astype(np.uint8),
        math.sqrt(2.0) * noise,
        noise,
        float(alike[kept].mean()) if len(kept) else 0.0,
        reason,
        (
            *(converter_notes(survey) or limits.notes()),
            *codec_notes(survey),
            *gate_notes(survey, samples),
            *voice_notes(left_out.pulses),
            *swell_notes(int(np.count_nonzero(swells))),
            *crowd_notes(left_out.crowded, int(np.count_nonzero(enough))),
            *mains_notes(instant[kept] / rate),
            *doubt.notes(),
        ),
        error[kept] / rate,
    )
    return found_impacts, int(np.count_nonzero(clicks))


def chance(odds: np.ndarray) -> np.ndarray:
    """Probability of these log-odds."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0))))


def shifted(attack: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Instants of attack, shifted where a shift is known.

    Where that would put two out of order, both stay as they are.
    """
    known = np.isfinite(shift)
    while True:
        instant = np.where(known, attack + shift, attack)
        crossed = np.flatnonzero((np.diff(instant) <= 0) & (known[1:] | known[:-1]))
        if not len(crossed):
            return instant
        known[crossed] = known[crossed + 1] = False


def distinct(instant: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """Indices of impacts in order of time; of those at one instant, the likeliest.

    Two rises detected by narrow bands alone may have one attack, or attacks in reverse order.
    """
    if (instant[1:] > instant[:-1]).all():  # as nearly always
        return np.arange(len(instant))
    order = np.lexsort((-likely, instant))
    return np.asarray(order[np.diff(instant[order], prepend=-np.inf) > 0])


def attack_errors(columns: np.ndarray) -> np.ndarray:
    """Standard errors of attacks [samples], from the results of `measure`.

    If a filter rings before impacts, the ringing is detected earlier for some than for others, by
    about the time from attack to clear sound of most.
    """
    late = RINGING[1] * quantile(columns[:, 4], RINGING[0]) if len(columns) else 0.0
    return np.sqrt(columns[:, 3] + late**2)


def quantile(values: np.ndarray, share: float) -> float:
    """That of `np.quantile`, in a fraction of its time."""
    ordered, place = np.sort(values), share * (len(values) - 1)
    return float(np.interp(place, np.arange(len(values)), ordered))


def scale_at(rate: float) -> Scale:
    """Lengths of the detector at a sampling rate.

    Raises
    ------
    InvalidInput
        If the rate leaves no octave above 1 kHz, or is beyond that of any sound.
    """
    if not 4e3 <= rate <= 1e6:
        raise InvalidInput(
            "rate", rate, "4 kHz to 1 MHz for sound", 'Give sensor="force" for other records'
        )
    octaves = int(math.log2(rate * LONGEST_HOP))
    hop = 2**octaves
    past, forward, spacing = (max(round(t * rate / hop), 1) for t in (PAST, FORWARD, SPACING))
    short_lag, long_lag = (max(round(rate / f), 1) for f in LAG_RATES)
    slope = max(round(rate * SLOPE), 1)
    reach = spacing * hop // 2
    scale = Scale(hop, octaves, past, forward, spacing, short_lag, long_lag, slope, reach, 0)
    return scale._replace(before=sound_lengths(rate, scale).before)


def sound_lengths(rate: float, scale: Scale) -> Lengths:
    """Lengths of the sounds that are compared; each ends before the next may begin."""
    return lengths_at(rate, scale.short_lag, scale.slope, scale.spacing * scale.hop)


class LeftOut(NamedTuple):
    """Numbers of crests that are no impacts because many come together."""

    pulses: int  # as those of a voice
    crowded: int  # as of a rattle, or of a machine that hits as often


def choose(
    survey: Survey, least: float, rate: float, doubt: Doubt
) -> tuple[dict[int, Chosen], float, LeftOut]:
    """The impacts of each passage that has any, by its first sample.

    The greatest probability as well, and what is left out because many come together. All
    probabilities are added to the `doubt`, as they are before the record says how they turn out.
    """
    chosen, greatest, pulses, crowded = {}, 0.0, 0, 0
    every = [candidates(one, survey.spread, survey.scale, rate) for one in survey.passages]
    for found in every:
        doubt.add(found.probability, found.odds)
    groups = sum(len(part) for passage in survey.passages for part in passage.bands)
    seconds = groups * GROUP * survey.scale.hop / rate
    for passage, found in zip(survey.passages, every, strict=True):
        found = found._replace(odds=calibrated(found.odds, doubt, seconds, survey.spread))
        likely = found.probability
        kept = likely >= min(least, EVEN)  # so that what is beside an impact is always the same
        pulses += int(np.count_nonzero(found.pulse & (likely < least)))
        crowded += int(np.count_nonzero(found.crowded & (likely < least)))
        greatest = max(greatest, float(likely.max(initial=0.0)))
        if kept.any():
            frame, by_octaves = found.frame[kept], found.by_octaves[kept]
            steady = steady_odds(passage, frame, by_octaves, survey.scale.hop / rate)
            coarse, spread = found.coarse[kept], found.spread[kept]
            edges = may_be_edges(frame * (survey.scale.hop / rate), by_octaves)
            evidence = likely[kept], edges, steady
            chosen[passage.segment] = Chosen(frame, coarse, spread, *evidence)
    return chosen, greatest, LeftOut(pulses, crowded)


def loudness_of(survey: Survey, chosen: dict[int, Chosen]) -> float:
    """Median loudness of the impacts that have a crest of C [neper of power]; 0 without any."""
    every = [np.zeros(0)]
    for passage in survey.passages:
        if passage.segment in chosen:
            place, loud = np.concatenate(passage.place), np.concatenate(passage.loud)
            every.append(loud[np.isin(place, chosen[passage.segment].frame)])
    values = np.concatenate(every)
    return middle(values) if len(values) else 0.0


def greatest_rise(
    x: np.ndarray, place: int, valid: tuple[int, int], scale: Scale, rate: float
) -> int:
    """Frame near `place` at which the power rises most within COARSE."""
    half = round(COARSE * rate)
    edge = scale.spacing * scale.hop
    low = max(place - round(SOONER * rate) + edge, valid[0] + half)
    high = min(place + round(LATER * rate) - edge, valid[1] - half)
    if low >= high:
        return place
    near = x[low - half : high + half].astype(float)
    total = np.concatenate(([0.0], np.cumsum((near - near.mean()) ** 2)))
    sums = total[half:] - total[:-half]
    least = np.finfo(float).eps * total[-1]
    rise = (sums[half:] + least) / (sums[:-half] + least)
    split = low + int(np.argmax(rise[: high - low]))
    return split - split % scale.hop


def noise_rms(power: np.ndarray, gains: np.ndarray) -> float:
    """RMS of the samples in the octaves, from the power of their details."""
    return math.sqrt(float(np.sum(power / (gains * 2.0 ** (1 + np.arange(len(power)))))))
