"""Quadrature of Gauss and Kronrod that halves cells until rounding is all that is left."""

from __future__ import annotations

import numpy as np

_HALF = np.array([
    [0.991455371120812639206854697526329, 0.022935322010529224963732008058970],
    [0.949107912342758524526189684047851, 0.063092092629978553290700663189204],
    [0.864864423359769072789712788640926, 0.104790010322250183839876322541518],
    [0.741531185599394439863864773280788, 0.140653259715525918745189590510238],
    [0.586087235467691130294144691693013, 0.169004726639267902826583426598550],
    [0.405845151377397166906606412076961, 0.190350578064785409913256402421014],
    [0.207784955007898467600689403773245, 0.204432940075298892414161999234649],
])  # fmt: skip
NODES = np.concatenate([1 - _HALF[:, 0], [1], 1 + _HALF[::-1, 0]]) / 2
KRONROD = np.concatenate([_HALF[:, 1], [0.209482141084727828012999174891714], _HALF[::-1, 1]]) / 2
GAUSS = np.zeros(15)
GAUSS[1::2] = np.polynomial.legendre.leggauss(7)[1] / 2


def integrate(rates, low, high, owner, owners, digit, most):
    """Integrals over cells, added up for the owner of each; and bounds of their errors.

    Parameters
    ----------
    rates : callable
        `rates(time, owner)`: integrands and bounds of their errors, each of shape (n, cells, 15),
        at times of shape (cells, 15).
    low, high, owner : ndarray, shape (cells,)
    owners : int
    digit : float
        How well instants are known. It makes an integral uncertain by as much times what its
        integrand goes up and down.
    most : int
        Cells that may be looked at.

    Returns
    -------
    integral, error : ndarray, shape (n, owners)
        A cell is halved until its two quadratures differ by no more than the errors of its
        integrands explain, or it is no longer than an instant; the difference counts as error.
    """
    integral = error = 0.0
    while len(low):
        most -= len(low)
        assert most > 0, "the quadrature does not converge"
        width = high - low
        value, rough = rates(low[:, None] + width[:, None] * NODES, owner)
        fine = (value @ KRONROD) * width
        differs = np.abs(fine - (value @ GAUSS) * width)
        loose = (rough @ KRONROD) * width + digit * np.abs(np.diff(value, axis=2)).sum(axis=2)
        done = np.all(differs <= loose, axis=0) | (width <= 4 * digit)

        def total(parts, done=done, owner=owner):
            return np.stack([np.bincount(owner[done], part[done], owners) for part in parts])

        integral = integral + total(fine)
        error = error + total(loose + differs)
        low, high, owner = low[~done], high[~done], np.tile(owner[~done], 2)
        middle = (low + high) / 2
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return integral, error
