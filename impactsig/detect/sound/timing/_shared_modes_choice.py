"""Choice of the anti-aliasing filter behind which sounds that share modes are most probable.

Sounds are high-passed and start near a guess. See `shared_modes.py` for the method.
"""

from __future__ import annotations

import copy
import functools

import numpy as np

from ._candidate_kernels import Starts
from ._edge import HIGH_PASS, NO_FILTER, causal, responses
from ._shared_modes_fit import PRIORS, Behind, Fine, Model

DOUBT, CERTAIN = 4.0, 20.0  # by which sounds without a filter must be, and are, more probable
HOPELESS = 2.0  # times what modes may leave, which no other filter mends
STRANGERS = 6.0, 4.0  # times, before priors are learned, at whole samples and between them
LIKELY = 3  # filters that are tried with more than one choice of modes
LOUD = 16  # sounds, the loudest, that filters are compared by
LOW = 0.5 * HIGH_PASS, 0.01  # [Hz], [s]: a mode below what is fitted, and its decay
BEHIND = 0.3  # by which a filter is so much less probable that a narrower one is not tried
AFTER = 3.0  # and times what filters differ by, by which modes are so behind one as behind others
EXACT, ROUGH = 1e-7, 2e-5  # least error by which a filter is chosen, and an instant


def chosen_model(
    shared: tuple[list[np.ndarray], list[np.ndarray]],
    sounds: np.ndarray,
    guess: np.ndarray,
    behind: Behind,
    unlike: float,
) -> tuple[Model, Fine] | None:
    """The model with the filter under which the loudest of the sounds are most probable.

    `shared` are exponents that they may share. Beside the model the sounds, projected on it. None
    if they share no modes, or are more probable without any filter. `unlike` is the share of the
    energy that the modes of sounds that share them leave at most.
    """
    choices, folded = shared
    if not choices:
        return None
    model, bare = behind(choices[0], responses()[0]), behind(choices[0], NO_FILTER)
    held = model.at_whole(sounds, guess)
    most = STRANGERS[0] * unlike
    if model.left_at_samples(held) > most < bare.left_at_samples(bare.at_whole(sounds, guess)):
        return None
    starts = model.starts(held)
    near = model.about(starts)

    @functools.cache
    def by_bare() -> Fine:
        return bare.about(starts)

    def leave_more(times: float) -> bool:
        """Whether modes leave too much, without a filter as well."""
        return model.left(near) > times * unlike and bare.left(by_bare()) > times * unlike

    if leave_more(STRANGERS[1]):
        return None
    loud = near.loudest(LOUD)
    model.learn(loud, EXACT)
    # Modes that start at once leave as much whatever their prior and error are.
    if leave_more(HOPELESS):
        return None

    def less_by_loud(exponents: np.ndarray) -> bool:
        """Whether the loud sounds are less probable without a filter."""
        other = behind(exponents, NO_FILTER)
        other.learn_from(loud.starts, EXACT)
        return other.evidence < model.evidence

    # Then all of them are less probable as well, or by less than DOUBT more.
    sure = all(map(less_by_loud, choices))
    if not sure:
        by_all = copy.copy(model)
        by_all.learn(near, EXACT)
        bare.learn(by_bare(), EXACT)
        unfiltered = bare.evidence
        if by_all.evidence < unfiltered - CERTAIN:
            return None
        for exponents in choices[1:]:
            other = behind(exponents, NO_FILTER)
            other.learn_from(starts, EXACT)
            unfiltered = max(unfiltered, other.evidence)
    best = _most_probable(behind, choices, folded, model, loud.starts)
    if best is not model:
        near = best.about(starts)
    # What is as probable as a model that is probable enough needs no further proof.
    if not sure and by_all.evidence <= unfiltered - DOUBT:
        if best is model:
            return None
        best.learn(near, EXACT)
        if best.evidence <= unfiltered - DOUBT:
            return None
    best.learn(near, ROUGH)
    return best, near


def _most_probable(
    behind: Behind,
    choices: list[np.ndarray],
    folded: list[np.ndarray],
    model: Model,
    loud: Starts,
) -> Model:
    """The model with the filter and the modes under which the loud sounds are most probable.

    All are compared about the origins by that of the widest filter and the first choice, which has
    learned from the loudest. The filters after the slope are narrower and narrower: there is one
    maximum.

    An impulse as strong as it may be stands for something else: for the start of a strong mode
    below what is fitted, whose ringing is not heard, or for a filter that does not ring before an
    impact. Then a mode of a low frequency, which may be any, and causal filters are tried.
    """
    _, slope, *narrower = responses()
    tried = [model]
    rank = LIKELY if len(choices) > 1 or folded else 1  # how many are of use

    def learned(exponents: np.ndarray, response: np.ndarray, beaten: float = -np.inf) -> Model:
        other = behind(exponents, response)
        other.prior = model.prior
        other.learn_from(loud, EXACT, beaten)
        return other

    def less(item: Model) -> float:
        return -item.evidence

    beaten = -np.inf
    for response in (slope, *narrower):
        other = learned(choices[0], response, beaten)
        tried.append(other)
        tried.sort(key=less)
        if len(tried) >= rank:
            beaten = tried[rank - 1].evidence
        if response is not slope and other.evidence < beaten - BEHIND:
            break
    likely = tried[:LIKELY]
    for exponents in (*choices[1:], *folded):
        most = likely[0].evidence
        apart = min(CERTAIN, AFTER * (1.0 + most - likely[-1].evidence))
        for i, before in enumerate(likely):
            other = learned(exponents, before.response, before.evidence)
            if other.evidence > before.evidence:
                likely[i] = other
            most = max(most, other.evidence)
            if other.evidence < most - apart:
                break
        likely.sort(key=less)  # what other modes tell of a filter counts for the next
    best = likely[0]
    if best.prior[0] < PRIORS[0]:
        return best
    frequency, decay = LOW
    low = (2j * np.pi * frequency - 1.0 / decay) / behind.rate
    with_low = learned(np.append(low, best.exponents), best.response, best.evidence)
    best = max(best, with_low, key=_evidence)
    for response in causal():
        for exponents in (*choices, *folded):
            other = learned(exponents, response, best.evidence)
            best = max(best, other, key=_evidence)
            if other.evidence < best.evidence - CERTAIN:
                break
    return best


def _evidence(model: Model) -> float:
    return model.evidence
