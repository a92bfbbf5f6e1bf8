"""The impacts that the first pass over a sound record shows, before their attacks are timed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._kernels import GROUP
from ._nearby import middle
from ._survey import Survey
from .deciding.calibrated import SHORTEST, calibrated
from .deciding.decision import candidates
from .deciding.doubt import EVEN, Doubt
from .deciding.gradual import steady_odds
from .deciding.overlapping import with_overlap
from .deciding.overload import may_be_edges


class Chosen(NamedTuple):
    """The impacts of a passage."""

    frame: np.ndarray
    coarse: np.ndarray
    spread: np.ndarray
    probability: np.ndarray
    may_be_edge: np.ndarray  # bool: of an overload
    steady: np.ndarray  # log-odds but for the attack, where a rise may be gradual; else infinite


class LeftOut(NamedTuple):
    """Numbers of crests that are no impacts because many come together."""

    pulses: int  # as those of a voice
    crowded: int  # as of a rattle, or of a machine that hits as often


def choose(survey: Survey, least: float, doubt: Doubt) -> tuple[dict[int, Chosen], float, LeftOut]:
    """The impacts of each passage that has any, by its first sample.

    The greatest probability as well, and what is left out because many come together. All
    probabilities are added to the `doubt`, as they are before the record says how they turn out.
    """
    rate = survey.rate
    chosen, greatest, pulses, crowded = {}, 0.0, 0, 0
    every = [candidates(one, survey.spread, survey.scale, rate) for one in survey.passages]
    for found in every:
        doubt.add(found.probability, found.odds)
    groups = sum(len(passage.bands) for passage in survey.passages)
    seconds = groups * GROUP * survey.scale.hop / rate
    every = [
        found._replace(odds=calibrated(found.odds, doubt, seconds, survey.spread))
        for found in every
    ]
    every = with_overlap(every, doubt.right / max(seconds, SHORTEST))
    for passage, found in zip(survey.passages, every, strict=True):
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
            at_crests = np.isin(passage.place, chosen[passage.segment].frame)
            every.append(passage.loud[at_crests])
    values = np.concatenate(every)
    return middle(values) if len(values) else 0.0
