"""Probabilities of two kinds of sound, of which faint ones sound more like the noise.

The power of a band is that of the sound and of the noise, so that the colours of a kind move
towards those of the noise as its impacts get fainter: along a curve, from which loud ones tell
where faint ones are to be expected. Colours of a kind are normal about a polynomial of the
loudness, with one covariance for all. What is stated allows for the errors of polynomials and
covariance: the distribution of a further impact is Student's t, as of any regression.
"""

from __future__ import annotations

import numpy as np

TERMS = 3
"""Of a polynomial, at most."""
OF_EACH = 4
"""Impacts of the rarer kind for each term."""
ROUNDS = 100


def kinds_by_strength(places: np.ndarray, loudness: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Probability of either kind, shape (n, 2).

    Parameters
    ----------
    places : ndarray, shape (n, m)
        Colours of the impacts.
    loudness : ndarray, shape (n,)
        Logarithms of their power.
    share : ndarray, shape (n, 2)
        Probabilities where loudness is left out.
    """
    count, size = places.shape
    terms = int(np.clip(share.sum(axis=0).min() // OF_EACH, 1, TERMS))
    spread = float(np.std(loudness))
    about = (loudness - loudness.mean()) / spread if spread > 0.0 else np.zeros(count)
    powers = np.vander(about, terms, increasing=True)
    freedom = count - size - 2 * terms
    least = 1e-12 * float(np.var(places)) + 1e-200  # of sounds that are all the same
    for _ in range(ROUNDS):
        off, lever = np.empty((count, 2, size)), np.empty((count, 2))
        for k, weight in enumerate(share.T):
            inverse = np.linalg.pinv(powers.T @ (weight[:, None] * powers), hermitian=True)
            off[:, k] = places - powers @ (inverse @ (powers.T @ (weight[:, None] * places)))
            lever[:, k] = np.einsum("ni,ij,nj->n", powers, inverse, powers)
        covariance = np.einsum("nk,nki,nkj->ij", share, off, off) / count
        covariance += least * np.eye(size)
        square = np.einsum("nki,ij,nkj->nk", off, np.linalg.inv(covariance), off)
        wider = 1.0 + np.maximum(lever, 0.0)
        logs = np.log(share.sum(axis=0) / count + 1e-300) - 0.5 * size * np.log(wider)
        logs -= 0.5 * (freedom + size) * np.log1p(square / (wider * freedom))
        likely = np.exp(logs - logs.max(axis=1, keepdims=True))
        before, share = share, likely / likely.sum(axis=1, keepdims=True)
        if np.abs(share - before).max() < 1e-6:
            break
    return share
