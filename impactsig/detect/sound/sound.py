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
without them. Many rises in a short time are pulses of a voice (`_voice_kernels.py`), and gradual
rises are swelling noise (`swells.py`, `gradual.py`). What returns where an overloaded sound leaves
its limits is no impact either (`overload.py`).

The attack is where, within 1.5 ms of the crest of C, the variance of the signal changes most
[Maeda1985]_: halfway between two samples. If impacts sound alike, their common waveform gives the
instants to a fraction of a sample (`sound/timing/alike.py`); if a filter rings before them, their
common modes do (`sound/timing/shared_modes.py`). Attacks of sounds that begin gradually scatter, by
the growth of their power (`_growth.py`), or because low frequencies, which neither attacks nor
modes use, begin before them (`_beginnings.py`).

Where hum leaks into the octaves, they are read behind a high-pass filter (`powers/hum.py`). Where
sound still rings when the next impact comes, all statistics are those of the residual of linear
prediction (`powers/ringing.py`).

There are two passes over the record: `_survey.py` collects B and the crests of C, about a hundredth
of the record; then `_attacks.py` times the attacks of those that `_choosing.py` keeps. Results do
not depend on how the record is divided into blocks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from ...impacts import CLIPPED
from .._asked import parse_probability
from ..signal.stream import Piece, refuse_huge
from ._attacks import Attacks
from ._choosing import choose
from ._clicks import are_clicks, repaired, repairs
from ._clipping import Limits
from ._core_kernels import limits_of, mean_square
from ._cores import cores_of, window_size
from ._kernels import GROUP, Scale
from ._memory import keep_memory
from ._scale import scale_at
from ._survey import Survey
from ._windows import Window, windows
from .deciding.doubt import EVEN, Doubt
from .deciding.notes import (
    click_notes,
    closing_notes,
    codec_notes,
    converter_notes,
    crowd_notes,
    gate_notes,
    mains_notes,
    swell_notes,
    voice_notes,
)
from .powers.filtering import Filter
from .powers.hum import high_pass
from .powers.ringing import OFTEN, lasting, predictable, prediction

SHORTEST = 10e-3  # [s], of a record that may have an impact
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
    found, clicks = search(gathered, pieces, rate, least_probability)
    if not clicks:
        return found
    places, values = repairs(gathered.windows(pieces), rate)

    def mended() -> Iterable[Piece]:
        return repaired(pieces(), places, values)

    gathered = surveyed(mended, rate, scale)
    found, more = search(gathered, mended, rate, least_probability)
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
    alone: Window | None  # the window, if there is one only

    def windows(self, pieces: Callable[[], Iterable[Piece]]) -> Iterable[Window]:
        """The windows of the record once more; the pieces of a short one are not read again."""
        if self.alone is not None:
            return [self.alone]
        return windows(pieces(), window_size(self.survey.scale))


def surveyed(pieces: Callable[[], Iterable[Piece]], rate: float, scale: Scale) -> Surveyed:
    """Go through the record for the first time; twice if hum or ringing is to be filtered out."""
    gathered = surveyed_through(None, pieces, rate, scale)
    survey, backgrounds = gathered.survey, gathered.survey.backgrounds
    if any(passage.digital.any() for passage in survey.passages):
        return gathered  # silence would no longer be silent
    before = None
    if backgrounds.hum:
        before = high_pass(scale, rate, survey.bands, backgrounds.hum)
    modes = 0.0
    if predictable(np.array(backgrounds.narrow), rate, scale):
        modes = lasting(gathered.windows(pieces), rate, scale)
    if modes and rate_of(survey) < OFTEN:
        before = prediction(gathered.windows(pieces), rate, scale, before, modes)
    if before is None:
        return gathered
    gathered = surveyed_through(before, pieces, rate, scale)
    gathered.survey.hum_crest = math.log(backgrounds.hum_crest)
    return gathered


def rate_of(survey: Survey) -> float:
    """Impacts a second that the first pass shows."""
    chosen, _, _ = choose(survey, EVEN, Doubt())
    frames = sum(len(one.bands) for one in survey.passages) * GROUP
    return (
        sum(len(one.frame) for one in chosen.values()) * survey.rate / (frames * survey.scale.hop)
    )


def surveyed_through(
    before: Filter | None, pieces: Callable[[], Iterable[Piece]], rate: float, scale: Scale
) -> Surveyed:
    """Go through the record, with a filter before the octaves if there is one."""
    survey = Survey(scale, rate, before)
    samples, limits, alone = 0, Limits(), None
    for window in windows(pieces(), window_size(scale)):
        alone = None if samples else window
        samples += len(window.core)
        cores = cores_of(window.core, scale.hop)
        least, greatest, _ = limits_of(cores)
        limits.add(window.core, least, greatest)
        refuse_huge(limits.least, limits.greatest)
        survey.add(window, cores)
    survey.finish()
    return Surveyed(survey, limits, samples, alone)


def search(
    gathered: Surveyed,
    pieces: Callable[[], Iterable[Piece]],
    rate: float,
    least_probability: float,
) -> tuple[SoundImpacts, int]:
    """The impacts but for clicks of single samples, and the number of these."""
    survey, limits, samples, _ = gathered
    if not samples or limits.least == limits.greatest:
        reason = "the record is constant" if samples else "the record has no valid sample"
        none = np.empty(0)
        flags = np.empty(0, np.uint8)
        return SoundImpacts(none, none, none, flags, 0.0, 0.0, 0.0, reason, (), none), 0
    backgrounds = survey.backgrounds
    noise = math.sqrt(mean_square(np.array(backgrounds.noise), backgrounds.gains))
    doubt = Doubt()
    chosen, likeliest, left_out = choose(survey, least_probability, doubt)
    attacks = Attacks(survey, chosen, (limits.least, limits.greatest))
    for window in gathered.windows(pieces) if chosen else ():
        attacks.add(window)
    measured = attacks.measured()
    by_rise = measured.unless_swelling(rate)
    likely = measured.unless_overloaded(by_rise)
    doubt.turn(measured.probability, likely)
    enough = likely >= least_probability
    swells = (measured.probability >= least_probability) & (by_rise < least_probability)
    instant, error, alike = attacks.instants(measured, likely)
    clicks = are_clicks(measured.lone)
    _, peak, clipped, _, _ = measured.attack.T
    reason = ""
    heard = peak > 0.0  # in samples that are mostly 0, an attack may have none to show
    if not (heard & enough).any():
        reason = (
            "the power rises nowhere as it does at an impact: the likeliest one has a "
            f"probability of {likely.max() if len(likely) else likeliest:.2g}"
        )
        if samples <= SHORTEST * rate:
            reason = (
                f"the record lasts {1e3 * samples / rate:.3g} ms, and an impact needs 4 ms before "
                "it and 6 ms after it"
            )
    kept = distinct(instant, likely)
    kept = kept[heard[kept] & ~clicks[kept] & enough[kept]]
    found = SoundImpacts(
        instant[kept] / rate,
        peak[kept],
        likely[kept],
        (CLIPPED * clipped[kept]).astype(np.uint8),
        math.sqrt(2.0) * noise,
        noise,
        int(np.count_nonzero(alike[kept])) / max(len(kept), 1),
        reason,
        (
            *((not limits.two_valued and converter_notes(survey)) or limits.notes()),
            *codec_notes(survey),
            *gate_notes(survey, samples),
            *closing_notes(survey, samples),
            *voice_notes(left_out.pulses),
            *swell_notes(int(np.count_nonzero(swells))),
            *crowd_notes(left_out.crowded, int(np.count_nonzero(enough))),
            *mains_notes(instant[kept] / rate),
            *doubt.notes(),
        ),
        error[kept] / rate,
    )
    return found, int(np.count_nonzero(clicks))


def distinct(instant: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """Indices of impacts in order of time; of those at one instant, the likeliest.

    Two rises detected by narrow bands alone may have one attack, or attacks in reverse order.
    """
    if np.count_nonzero(instant[1:] > instant[:-1]) >= len(instant) - 1:  # as nearly always
        return np.arange(len(instant))
    order = np.lexsort((-likely, instant))
    return np.asarray(order[np.diff(instant[order], prepend=-np.inf) > 0])
