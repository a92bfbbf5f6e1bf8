"""Choice of the anti-aliasing filter behind which sounds that share modes are most probable.

Sounds are high-passed and start near a guess. See `shared_modes.py` for the method.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable

import numpy as np

from ._edge import HIGH_PASS, causal, responses
from ._shared_modes_fit import PRIORS, Model, Projected, modes_behind

DOUBT, CERTAIN = 4.0, 20.0  # by which sounds without a filter must be, and are, more probable
HOPELESS = 2.0  # times what modes may leave, which no other filter mends
STRANGERS = 6.0, 4.0  # times, before priors are learned, at whole samples and between them
LIKELY = 3  # filters that are tried with more than one choice of modes
LOUD = 16  # sounds, the loudest, that filters are compared by
LOW = 0.5 * HIGH_PASS, 0.01  # [Hz], [s]: a mode below what is fitted, and its decay
BEHIND = 1.0  # by which a filter is so much less probable that a narrower one is not tried
EXACT, ROUGH = 1e-7, 2e-5  # least error by which a filter is chosen, and an instant


def chosen_model(
    shared: tuple[list[np.ndarray], list[np.ndarray]],
    sounds: np.ndarray,
    guess: np.ndarray,
    noise: float,
    rate: float,
    taps: np.ndarray,
    heard: float,
    unlike: float,
) -> tuple[Model, Projected] | None:
    """The model with the filter under which the loudest of the sounds are most probable.

    `shared` are exponents that they may share. Beside the model the sounds, projected on it. None
    if they share no modes, or are more probable without any filter. `unlike` is the share of the
    energy that the modes of sounds that share them leave at most.
    """
    choices, folded = shared
    if not choices:
        return None

    def behind(exponents: np.ndarray, response: np.ndarray | None) -> Model:
        model = modes_behind(exponents, response, taps, rate, heard)
        model.noise = noise
        return model

    def projected(exponents: np.ndarray, response: np.ndarray | None) -> tuple[Model, Projected]:
        model = behind(exponents, response)
        return model, model.projected(sounds, guess)

    model, held = projected(choices[0], responses()[0])

    @functools.cache
    def bare() -> tuple[Model, Projected]:
        return projected(choices[0], None)

    def leave_more(times: float, left: Callable[[Model, Projected], float]) -> bool:
        """Whether modes leave too much, without a filter as well."""
        return left(model, held) > times * unlike and left(*bare()) > times * unlike

    if leave_more(STRANGERS[0], Model.median_left_at_samples):
        return None
    if leave_more(STRANGERS[1], Model.median_left):
        return None
    loud = held.loudest(LOUD)
    model.learn(loud, EXACT)
    # Modes that start at once leave as much whatever their prior and error are.
    if leave_more(HOPELESS, Model.median_left):
        return None

    def less_by_loud(exponents: np.ndarray) -> bool:
        """Whether the loud sounds are less probable without a filter."""
        other = behind(exponents, None)
        other.learn(other.projected_there(loud), EXACT)
        return other.evidence < model.evidence

    # Then all of them are less probable as well, or by less than DOUBT more.
    sure = all(map(less_by_loud, choices))
    if not sure:
        by_all, (other, by_other) = copy.copy(model), bare()
        by_all.learn(held, EXACT)
        other.learn(by_other, EXACT)
        unfiltered = other.evidence
        if by_all.evidence < unfiltered - CERTAIN:
            return None
        for exponents in choices[1:]:
            other, by_other = projected(exponents, None)
            other.learn(by_other, EXACT)
            unfiltered = max(unfiltered, other.evidence)
    best = _most_probable(behind, choices, folded, rate, model, loud)
    if best is not model:
        held = best.projected(sounds, guess)
    # What is as probable as a model that is probable enough needs no further proof.
    if not sure and by_all.evidence <= unfiltered - DOUBT:
        if best is model:
            return None
        best.learn(held, EXACT)
        if best.evidence <= unfiltered - DOUBT:
            return None
    best.learn(held, ROUGH)
    return best, held


def _most_probable(
    behind: Callable[[np.ndarray, np.ndarray], Model],
    choices: list[np.ndarray],
    folded: list[np.ndarray],
    rate: float,
    model: Model,
    loud: Projected,
) -> Model:
    """The model with the filter and the modes under which the loud sounds are most probable.

    All are compared about the origins by that of the widest filter and the first choice, which has
    learned from the loudest. The filters after the slope are narrower and narrower: there is one
    maximum.

    An impulse as strong as it may be stands for something else: for the start of a strong mode
    below what is fitted, whose ringing is not heard, or for a filter that does not ring before an
    impact. Then a mode of a low frequency, which may be any, and causal filters are tried.
    """
    widest, slope, *narrower = responses()
    tried = [(model, widest, choices[0])]
    rank = LIKELY if len(choices) > 1 or folded else 1  # how many are of use

    def learned(exponents: np.ndarray, response: np.ndarray, beaten: float = -np.inf) -> Model:
        other = behind(exponents, response)
        other.prior = model.prior
        other.learn(other.projected_there(loud), EXACT, beaten)
        return other

    def less(item: tuple[Model, np.ndarray, np.ndarray]) -> float:
        return -item[0].evidence

    beaten = -np.inf
    for response in (slope, *narrower):
        other = learned(choices[0], response, beaten)
        tried.append((other, response, choices[0]))
        tried.sort(key=less)
        if len(tried) >= rank:
            beaten = tried[rank - 1][0].evidence
        if response is not slope and other.evidence < beaten - BEHIND:
            break
    likely = tried[:LIKELY]
    for exponents in (*choices[1:], *folded):
        most = likely[0][0].evidence
        for i, (before, response, _) in enumerate(likely):
            other = learned(exponents, response, before.evidence)
            if other.evidence > before.evidence:
                likely[i] = other, response, exponents
            most = max(most, other.evidence)
            if other.evidence < most - CERTAIN:
                break
        likely.sort(key=less)  # what other modes tell of a filter counts for the next
    best, response, exponents = likely[0]
    if best.prior[0] < PRIORS[0]:
        return best
    frequency, decay = LOW
    low = (2j * np.pi * frequency - 1.0 / decay) / rate
    best = max(best, learned(np.append(low, exponents), response, best.evidence), key=_evidence)
    for response in causal():
        for exponents in (*choices, *folded):
            other = learned(exponents, response, best.evidence)
            best = max(best, other, key=_evidence)
            if other.evidence < best.evidence - CERTAIN:
                break
    return best


def _evidence(model: Model) -> float:
    return model.evidence
