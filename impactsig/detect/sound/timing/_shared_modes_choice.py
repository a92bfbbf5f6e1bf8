"""Choice of the anti-aliasing filter behind which sounds that share modes are most probable.

Sounds are high-passed and start near a guess. See `shared_modes.py` for the method.
"""

from __future__ import annotations

import functools
import math
import sys
from dataclasses import dataclass

import numpy as np

from .._nearby import middle
from ._candidate_kernels import Fine, Starts
from ._edge import HIGH_PASS, NO_FILTER, causal, responses
from ._shared_exponents import SharedExponents
from ._shared_modes_fit import PRIORS, Behind, Model

DOUBT, CERTAIN = 4.0, 20.0  # by which sounds without a filter must be, and are, more probable
HOPELESS = 2.0  # times what modes may leave, which no other filter mends
STRANGERS = 6.0, 4.0  # times, before priors are learned, at whole samples and between them
LIKELY = 3  # filters that are tried with more than one choice of modes
LOUD = 16  # sounds, the loudest, that filters are compared by
LOW = 0.5 * HIGH_PASS, 0.01  # [Hz], [s]: a mode below what is fitted, and its decay
BEHIND = 0.1  # by which a filter is so much less probable that a narrower one is not tried
AFTER = 3.0  # times 1 and what filters differ by: modes so much less probable are so behind all
ROOM = 4.0  # what a sound may gain at most by other modes that are not tried
EXACT, ROUGH = 1e-7, 2e-5  # least error by which a filter is chosen, and an instant
QUIET = 10.0  # times the latter, up to which it changes what is learned


@dataclass
class _Comparison:
    """Models of the loudest sounds, about their origins by one that has learned from them."""

    behind: Behind
    first: Model
    loud: Fine

    def __post_init__(self) -> None:
        own = self.first.noise / middle(self.loud.energy)  # of a sample, over the energy
        self.own = max(own, sys.float_info.min)

    def learned(
        self, exponents: np.ndarray, response: np.ndarray, beaten: float = -np.inf
    ) -> Model:
        """A model of these modes behind this filter. See `Model.learn_from`."""
        model = self.behind(exponents, response)
        model.prior = self.first.prior
        model.learn_from(self.loud.starts, EXACT, beaten)
        return model

    def complete(self, model: Model) -> bool:
        """Whether other modes can hardly gain, even if they explained all that this one leaves.

        The evidence of a sound is -f ln(s) / 2 and what changes less, with f degrees of freedom.
        """
        return 0.5 * model.freedom * math.log1p(model.error / self.own) < ROOM


def chosen_model(
    shared: SharedExponents,
    sounds: np.ndarray,
    guess: np.ndarray,
    behind: Behind,
    unlike: float,
) -> tuple[Model, Starts | None] | None:
    """The model with the filter under which the loudest of the sounds are most probable.

    And where all of them start, if that is known. None if they share no modes, or are more probable
    without any filter. `unlike` is the share of the energy that the modes of sounds that share them
    leave at most.
    """
    first = shared.first
    if first is None:
        return None
    model, bare = behind(first, responses()[0]), behind(first, NO_FILTER)
    (left, loud), most = model.starts(sounds, guess, LOUD), STRANGERS[0] * unlike
    if left > most and bare.starts(sounds, guess, LOUD)[0] > most:
        return None

    @functools.cache
    def left_by_bare() -> float:
        return bare.left(bare.about(loud.starts))

    def leave_more(times: float) -> bool:
        """Whether modes leave too much, without a filter as well."""
        most = times * unlike
        return model.left(loud) > most and left_by_bare() > most

    if leave_more(STRANGERS[1]):
        return None
    model.learn(loud, EXACT)
    # Modes that start at once leave as much whatever their prior and error are.
    if leave_more(HOPELESS):
        return None
    compared = _Comparison(behind, model, loud)
    others = [compared.learned(first, NO_FILTER)]
    if not (compared.complete(model) or compared.complete(others[0])):
        for exponents in shared.weaker:
            others.append(compared.learned(exponents, NO_FILTER))
            if compared.complete(others[-1]):
                break
    if model.evidence < others[0].evidence - CERTAIN:
        return None
    best, every = _most_probable(compared, shared), loud
    # If the loud sounds are, then all are more probable as well, or by less than DOUBT less.
    if best.evidence <= max(map(_evidence, others)):
        if len(sounds) > LOUD:
            _, every = model.starts(sounds, guess, len(sounds))
            for one in (best, *others):
                one.learn_from(every.starts, EXACT)
        if best.evidence <= max(map(_evidence, others)) - DOUBT:
            return None
    # In noise by far greater than the least error, neither it nor the prior changes; and starts by
    # the widest filter do, unless the impulse stands for what may change them.
    noisy = compared.own >= QUIET * ROUGH
    if not noisy and best.error < QUIET * ROUGH:
        best.learn(best.about(every.starts), ROUGH)
    best.error = max(best.error, ROUGH)
    all_known = every is not loud or len(sounds) <= LOUD
    return best, every.starts if noisy and all_known and best.prior[0] < PRIORS[0] else None


def _most_probable(compared: _Comparison, shared: SharedExponents) -> Model:
    """The model with the filter and the modes under which the loud sounds are most probable.

    The filters after the slope are narrower and narrower: there is one maximum.

    An impulse as strong as it may be stands for something else: for the start of a strong mode
    below what is fitted, whose ringing is not heard, or for a filter that does not ring before an
    impact. Then a mode of a low frequency, which may be any, and causal filters are tried.
    """
    _, slope, *narrower = responses()
    first, tried, beaten = compared.first.exponents, [compared.first], -np.inf
    for response in (slope, *narrower):
        other = compared.learned(first, response, beaten)
        tried = sorted((*tried, other), key=_evidence, reverse=True)
        # Other modes may favour another filter.
        rank = LIKELY if _others(compared, tried[0], shared) else 1
        beaten = tried[rank - 1].evidence if len(tried) >= rank else -np.inf
        if response is not slope and other.evidence < beaten - BEHIND:
            break
    best = _with_others(compared, tried, shared)
    if best.prior[0] < PRIORS[0]:
        return best
    # Other modes that gain behind none of these filters gain behind no causal one far below them.
    below = CERTAIN if best.exponents is not first else DOUBT
    frequency, decay = LOW
    low = (2j * np.pi * frequency - 1.0 / decay) / compared.behind.rate
    with_low = compared.learned(np.append(low, best.exponents), best.response, best.evidence)
    best = max(best, with_low, key=_evidence)
    tried = [compared.learned(first, response, best.evidence) for response in causal()]
    tried.sort(key=_evidence, reverse=True)
    if tried[0].evidence > best.evidence - below:
        best = max(best, _with_others(compared, tried, shared), key=_evidence)
    return best


def _others(compared: _Comparison, model: Model, shared: SharedExponents) -> list[np.ndarray]:
    """Modes by which sounds may gain on a model."""
    return [] if compared.complete(model) else [*shared.weaker, *shared.folded]


def _with_others(compared: _Comparison, tried: list[Model], shared: SharedExponents) -> Model:
    """The most probable of models, the first of which is, and of other modes behind them."""
    likely = [one for one in tried[:LIKELY] if one.evidence > tried[0].evidence - CERTAIN]
    for exponents in _others(compared, tried[0], shared):
        most = likely[0].evidence
        apart = min(CERTAIN, AFTER * (1.0 + most - likely[-1].evidence))
        for i, before in enumerate(likely):
            other = compared.learned(exponents, before.response, before.evidence)
            if other.evidence > before.evidence:
                likely[i] = other
            most = max(most, other.evidence)
            if other.evidence < most - apart:
                break
        # What other modes tell of a filter counts for the next.
        likely.sort(key=_evidence, reverse=True)
    return likely[0]


def _evidence(model: Model) -> float:
    return model.evidence
