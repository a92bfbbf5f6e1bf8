"""Kernels for `_attacks.py`: instants by attacks and shifts of them, and their errors."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import kernel

SMEARED = 1.5  # power of the doubt of an impact by which its instant lies within reach


@kernel
def put_at_most(probability, odds, out):
    """The probabilities, but no more than those of some log-odds, which are at least e^-50."""
    for k in range(len(out)):
        out[k] = min(probability[k], 1.0 / (1.0 + math.exp(-max(odds[k], -50.0))))


@kernel
def put_instants(attack, by_modes, by_wave, agree, far, shift, instant, alike):
    """Instants, and which are by the common waveform.

    If an attack is off by more than `far`, the waveform may be a period beside: it counts if it
    differs from the shift by modes by no more than `agree`, or five standard errors. Where shifts
    would put two instants out of order, both are those of their attacks.

    Parameters
    ----------
    attack : (n, 5), results of `measure`
    by_modes, by_wave : (n, 2), shifts and their standard errors; NaN where unknown
    shift : (n,), scratch
    """
    count = len(attack)
    for k in range(count):
        mode, wave = by_modes[k, 0], by_wave[k, 0]
        by_mode = mode if math.isfinite(mode) else 0.0
        beside = 5.0 * by_modes[k, 1]
        beside = beside if beside > agree else agree
        near = abs(by_mode) <= far or abs(wave - by_mode) <= beside
        alike[k] = math.isfinite(wave) and near
        shift[k] = wave if alike[k] else mode
    crossed = True
    while crossed:
        for k in range(count):
            moved = attack[k, 0] + shift[k]
            instant[k] = moved if math.isfinite(moved) else attack[k, 0]
        crossed = False
        for k in range(count - 1):
            known = math.isfinite(shift[k]) or math.isfinite(shift[k + 1])
            if known and instant[k + 1] <= instant[k]:
                shift[k] = shift[k + 1] = np.nan
                crossed = True


@kernel
def put_errors(
    attack, instant, by_modes, by_wave, alike, spread, early, likely, growth, usual, reach, out
):
    """Standard errors of the instants that `put_instants` has stored.

    Parameters
    ----------
    spread : (n,), errors of the first pass, where that is all there is
    early : (n,), errors as sounds may begin before their attacks
    likely : (n,), probabilities of impacts
    growth : error of attacks as sounds begin gradually
    usual : samples from an attack until the sound is clear that are usual: if a filter rings before
        impacts, the ringing is detected earlier for some, whose sound is clear the later
    out : (n,), room for the errors
    """
    for k in range(len(attack)):
        if instant[k] == attack[k, 0]:
            clear = math.sqrt(attack[k, 3] + (attack[k, 4] - usual) ** 2)
            error = math.hypot(math.hypot(clear, spread[k]), growth)
        elif alike[k]:
            error = by_wave[k, 1]
        else:
            # Where noise hides an attack, modes are now and then those of the noise beside it.
            hidden = math.hypot(math.sqrt(attack[k, 3]), spread[k])
            astray = min(hidden, hidden**3 / (0.5 * reach) ** 2)
            error = math.hypot(by_modes[k, 1], astray)
        if not alike[k]:
            error = math.hypot(error, early[k])
        # What may be no impact may as well begin anywhere within reach of where it was found.
        doubt = (1.0 - likely[k]) ** SMEARED * reach / math.sqrt(3.0)
        out[k] = math.hypot(error, doubt)
