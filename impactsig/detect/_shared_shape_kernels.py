"""Kernel of the shape that impacts share: mean and spread by expectation and maximisation."""

from __future__ import annotations

import numpy as np

from .._compiled import njit


@njit(nogil=True)
def _inverse(a, low, out):
    """Inverse of a positive definite matrix, by Cholesky's factors in `low`."""
    n = len(a)
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= low[i, k] * low[j, k]
            low[i, j] = np.sqrt(max(total, 1e-300)) if i == j else total / low[j, j]
    for column in range(n):
        for i in range(n):
            total = 1.0 if i == column else 0.0
            for k in range(i):
                total -= low[i, k] * out[k, column]
            out[i, column] = total / low[i, i]
        for i in range(n - 1, -1, -1):
            total = out[i, column]
            for k in range(i + 1, n):
                total -= low[k, i] * out[k, column]
            out[i, column] = total / low[i, i]


@njit(nogil=True)
def _seen_by(shape, covariance, half, left):
    """S C S', of the matrix S and the covariance C; S C goes into `half`."""
    for i in range(len(shape)):
        for j in range(len(covariance)):
            total = 0.0
            for k in range(len(covariance)):
                total += shape[i, k] * covariance[k, j]
            half[i, j] = total
    for i in range(len(shape)):
        for j in range(len(shape)):
            total = 0.0
            for k in range(len(covariance)):
                total += half[i, k] * shape[j, k]
            left[i, j] = total


@njit(nogil=True)
def estimate_shape(square, score, first, shape, about, apart, spread, weight, rounds):
    """Mean and spread of shapes, and each pulse's step from its fit.

    Parameters
    ----------
    square, score : arrays (n, p, p) and (n, p)
        Information and score of each pulse, at its fit.
    first : array (n, s)
        Shapes that were fitted.
    shape : array (s, p)
        Shape from the parameters.
    about, apart : arrays (s,)
        Mean and standard deviation that the mean shape is drawn from.
    spread, weight : array (s,) and float
        Standard deviation of shapes to begin with, and how many pulses it counts as.
    rounds : int

    Returns
    -------
    step (n, p), covariance (n, p, p), explained (n, s), weights (s,), uncertain (s, s) : arrays
        Explained are the variances of the shapes that are left, uncertain is the covariance of the
        mean.
    """
    count, parameters = score.shape
    shapes = len(shape)
    mean, now = about.copy(), apart.copy()
    step, covariance = np.zeros((count, parameters)), np.zeros((count, parameters, parameters))
    explained = np.zeros((count, shapes))
    w = np.empty(shapes)
    uncertain = np.zeros((shapes, shapes))
    prior, total = np.empty((parameters, parameters)), np.empty((parameters, parameters))
    low, pull = np.zeros((parameters, parameters)), np.empty(parameters)
    half, left = np.empty((shapes, parameters)), np.empty((shapes, shapes))
    for _ in range(rounds):
        for a in range(shapes):
            w[a] = now[a] ** -2.0
        for i in range(parameters):
            for j in range(parameters):
                prior[i, j] = 0.0
                for a in range(shapes):
                    prior[i, j] += shape[a, i] * w[a] * shape[a, j]
        information = np.zeros((shapes, shapes))
        towards, own, shown = np.zeros(shapes), np.zeros(shapes), np.zeros(shapes)
        for k in range(count):
            total[:] = square[k] + prior
            _inverse(total, low, covariance[k])
            for i in range(parameters):
                pull[i] = score[k, i]
                for a in range(shapes):
                    pull[i] -= (first[k, a] - mean[a]) * w[a] * shape[a, i]
            for i in range(parameters):
                step[k, i] = 0.0
                for j in range(parameters):
                    step[k, i] += covariance[k, i, j] * pull[j]
            _seen_by(shape, covariance[k], half, left)
            for a in range(shapes):
                off = first[k, a] - mean[a]
                for i in range(parameters):
                    off += shape[a, i] * step[k, i]
                towards[a] += off * w[a]
                own[a] += off * off
                shown[a] += 1.0 - left[a, a] * w[a]
                explained[k, a] = left[a, a]
                for b in range(shapes):
                    information[a, b] -= w[a] * left[a, b] * w[b]
        for a in range(shapes):
            information[a, a] += count * w[a] + apart[a] ** -2.0
            towards[a] += (about[a] - mean[a]) / apart[a] ** 2
        uncertain = np.linalg.inv(information)
        for a in range(shapes):
            for b in range(shapes):
                mean[a] += uncertain[a, b] * towards[b]
            now[a] = np.sqrt((own[a] + weight * spread[a] ** 2) / (max(shown[a], 0.0) + weight))
    return step, covariance, explained, w, uncertain
