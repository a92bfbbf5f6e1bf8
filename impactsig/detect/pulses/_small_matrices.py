"""Square-root-free Cholesky factors of small positive definite matrices, and solvers.

A = L D L' with ones in the diagonal of L: its place is taken by the reciprocals of D.
"""

from __future__ import annotations

from ..._compiling.compiled import kernel


@kernel
def factor(a):
    """Factor in the lower triangle of `a`; False if it is not positive definite."""
    for i in range(len(a)):
        for j in range(i):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            a[i, j] = total
        total = a[i, i]
        for j in range(i):
            scaled = a[i, j] * a[j, j]
            total -= a[i, j] * scaled
            a[i, j] = scaled
        if not total > 0.0:
            return False
        a[i, i] = 1.0 / total
    return True


@kernel
def solve(factors, b):
    """Put the solution of A x = b into b."""
    n = len(factors)
    for i in range(n):
        for k in range(i):
            b[i] -= factors[i, k] * b[k]
    for i in range(n - 1, -1, -1):
        b[i] *= factors[i, i]
        for k in range(i + 1, n):
            b[i] -= factors[k, i] * b[k]


@kernel
def invert(factors, out):
    """Put the inverse of A into `out`."""
    n = len(factors)
    for column in range(n):
        # Above the diagonal the inverse of L holds zeros.
        for i in range(column, n):
            total = 1.0 if i == column else 0.0
            for k in range(column, i):
                total -= factors[i, k] * out[k, column]
            out[i, column] = total
        for i in range(n - 1, column - 1, -1):
            total = out[i, column] * factors[i, i]
            for k in range(i + 1, n):
                total -= factors[k, i] * out[k, column]
            out[i, column] = total
        for i in range(column):
            out[i, column] = out[column, i]
