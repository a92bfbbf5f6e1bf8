"""Linear differential equations over a short span, by Chebyshev collocation [Trefethen2000]_."""

from __future__ import annotations

import numpy as np

NODES = 28


def chebyshev(n: int = NODES) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on [0, 1] and the differentiation matrix [Trefethen2000]_, chapter 6."""
    k = np.arange(n)
    x = np.cos(np.pi * k / (n - 1))
    c = np.where((k == 0) | (k == n - 1), 2.0, 1.0) * (-1.0) ** k
    apart = x[:, None] - x[None, :]
    d = np.outer(c, 1 / c) / (apart + np.eye(n))
    d -= np.diag(d.sum(axis=1))
    return (1 - x) / 2, -2 * d


def solve(length: float, matrices: np.ndarray, source: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution of ``z' = A(t) z + b u(t)`` at the nodes, as a linear map of its inputs.

    Parameters
    ----------
    length : float
        Of the span.
    matrices : ndarray, shape (n, d, d)
        A at the nodes.
    source : ndarray, shape (d,)
        b.

    Returns
    -------
    by_start : ndarray, shape (n, d, d)
        z at the nodes by z at the first of them.
    by_drive : ndarray, shape (n, d, n)
        z at the nodes by u at the nodes.
    """
    n, d = matrices.shape[:2]
    _, slope = chebyshev(n)
    system = np.zeros((d, n, d, n))
    right = np.zeros((d, n, d + n))
    node = np.arange(n)
    for i in range(d):
        system[i, :, i, :] = slope / length
        for j in range(d):
            system[i, node, j, node] -= matrices[:, i, j]
        right[i, :, d:] = source[i] * np.eye(n)
        system[i, 0] = 0.0
        right[i, 0] = 0.0
        system[i, 0, i, 0] = right[i, 0, i] = 1.0
    solved = np.linalg.solve(system.reshape(d * n, d * n), right.reshape(d * n, d + n))
    solved = solved.reshape(d, n, d + n).transpose(1, 0, 2)
    return solved[..., :d], solved[..., d:]
