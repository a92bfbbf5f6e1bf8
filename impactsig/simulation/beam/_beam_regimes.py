"""Diagonalised equations of a beam off its stop and on it, as the kernel takes them.

In the unit of time in which the reference has frequency 1, with the modal coordinates q_n each a
part of the tip's deflection, y = sum q_n + b (b what the base adds where the stop does not ride on
it), a regime is linear:

- free:    q_n'' + 2 zeta_n w_n q_n' + w_n^2 q_n = f_n;
- pressed: the same with the force of the soft stop, -(k d + c d') / m on each mode, d the depth;
- pinned:  the same with the force of the rigid stop that keeps y where it is, so that only what is
  orthogonal to (1, ..., 1) moves.

Each is diagonalised by the eigenvectors of its first-order form, damping and all, so that

    state = rest + Re(sum_k V_k C_k exp(lambda_k t)) + Re(Z exp(i theta)),

of a conjugate pair one, doubled. What ends a regime is the first zero of a signal that is linear in
the state: the gap, the depth, the force that pins.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InvalidInput
from ...oscillators import Rigid, Stop

if TYPE_CHECKING:
    from .beam_flow import Beam


def regimes(
    frequencies: np.ndarray,
    damping_ratios: np.ndarray,
    modal_mass: float,
    force: np.ndarray,
    base: complex,
    omega: float,
    stop: Stop | None,
    chatter: float,
) -> Beam:
    """The regimes of a beam: off the stop, and on it.

    Parameters
    ----------
    frequencies : ndarray, shape (m,)
        Angular [rad/s].
    damping_ratios : ndarray, shape (m,)
        As shares of the critical.
    modal_mass : float
        Of every mode [kg].
    force : ndarray of complex, shape (m,)
        Amplitude of the modal forces [N] at phase 0.
    base : complex
        Amplitude of the base's part of y [m].
    omega : float
        Angular frequency of the reference [rad/s].
    stop : Stop, optional
        The stop at the tip.
    chatter : float
        As for `simulate`.
    """
    from .beam_flow import Beam

    m = len(frequencies)
    stiff = (frequencies / omega) ** 2
    drag = 2 * damping_ratios * frequencies / omega
    push = force / (modal_mass * omega**2)
    law = stop.law if stop else Rigid(0.0)
    side = float(stop.sign) if stop else 1.0
    position = stop.position if stop else np.inf
    ones = np.ones(m)

    gap = np.concatenate([-side * ones, 0 * ones])
    found = [_free(stiff, damping_ratios, push)]
    signals = [(gap, side * position if stop else np.inf, -side * base)]
    _, k, c, _, restitution = law.row(modal_mass * omega**2, modal_mass * omega)
    if not law.rigid:
        pressed = _first_order(np.diag(stiff) + k, np.diag(drag) + c)
        found.append(
            _regime(pressed, push - (k + 1j * c) * base, k * position * ones, np.eye(2 * m))
        )
        signals.append((-gap, -side * position, side * base))
    else:
        # q = (position - b) / m + N u, the columns of N orthonormal and orthogonal to (1, ..., 1).
        n = np.linalg.qr(np.column_stack([ones, np.eye(m)[:, 1:]]))[0][:, 1:]
        lift = np.kron(np.eye(2), n)
        part = np.where(np.isfinite(position), position, 0.0) / m
        within = _first_order(n.T @ (stiff[:, None] * n), n.T @ (drag[:, None] * n))
        own = n.T @ (push + (stiff + 1j * drag) * base / m)
        pinned = _regime(within, own, -n.T @ stiff * part, lift)
        pinned["rest"][:m] += part
        pinned["forced"] -= np.concatenate([ones, 1j * ones]) * base / m
        found.append(pinned)
        press = side * np.concatenate([-stiff, -drag])
        signals.append((press, 0.0, side * (push.sum() - base)))

    most = max(len(regime["rates"]) for regime in found)
    count = np.array([len(regime["rates"]) for regime in found])

    for regime, (row, _constant, wave) in zip(found, signals, strict=True):
        regime["seen"] = row @ regime["vectors"]
        regime["beat"] = np.asarray(wave + row @ regime["forced"])

    def stacked(name: str, axis: int) -> np.ndarray:
        """Of both regimes, padded where they have eigenvalues of different number."""
        parts = []
        for regime in found:
            wide = [(0, 0)] * regime[name].ndim
            wide[axis] = (0, most - len(regime["rates"]))
            parts.append(np.pad(regime[name], wide))
        return np.ascontiguousarray(parts)

    def both(name: str) -> np.ndarray:
        return np.array([regime[name] for regime in found])

    return Beam(
        m,
        count,
        stacked("rates", 0),
        stacked("vectors", 1),
        stacked("inverse", 0),
        both("rest"),
        both("forced"),
        np.array([row for row, _constant, _wave in signals]),
        np.array([constant for _row, constant, _wave in signals]),
        np.array([wave for _row, _constant, wave in signals], complex),
        stacked("seen", 0),
        both("beat"),
        side,
        restitution,
        chatter,
        np.empty((most + 1, 2), complex),
    )


def _free(stiff: np.ndarray, ratios: np.ndarray, push: np.ndarray) -> dict[str, Any]:
    """The regime of free modes, in closed form: `eig` would be less accurate for slow ones."""
    size = len(stiff)
    rates = np.sqrt(stiff) * (-ratios + 1j * np.sqrt((1 - ratios) * (1 + ratios)))
    forced = np.zeros(size, complex)
    driven = push != 0  # without forcing the reference may be a mode's own frequency
    np.divide(push, stiff - 1 + 2j * ratios * np.sqrt(stiff), out=forced, where=driven)
    half = 0.5 + 0.5j * rates.real / rates.imag
    return {
        "rates": rates,
        "vectors": np.concatenate([np.diag(2 + 0j * rates), np.diag(2 * rates)]),
        "inverse": np.concatenate([np.diag(half), np.diag(-0.5j / rates.imag)], axis=1),
        "rest": np.zeros(2 * size),
        "forced": np.concatenate([forced, 1j * forced]),
    }


def _first_order(stiffness: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """First-order system (q, q')' of q'' + damping q' + stiffness q = 0."""
    size = len(stiffness)
    return np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -damping]])


def _regime(
    matrix: np.ndarray, push: np.ndarray, constant: np.ndarray, lift: np.ndarray
) -> dict[str, Any]:
    """Eigenvalues, eigenvectors and their inverse, rest and forced response, in all coordinates."""
    size = len(push)
    if size == 0:
        full = len(lift)
        empty = {"rates": np.empty(0, complex), "vectors": np.empty((full, 0), complex)}
        return empty | {
            "inverse": np.empty((0, full), complex),
            "rest": np.zeros(full),
            "forced": np.zeros(full, complex),
        }
    zeros = np.zeros(size)
    stiffness = -matrix[size:, :size]
    # Velocities by a frequency, so that the eigenvectors' parts are alike in size.
    scale = np.sqrt(np.diag(stiffness))
    balance = np.concatenate([np.ones(size), scale])
    values, vectors = np.linalg.eig(matrix * balance / balance[:, None])
    if np.linalg.cond(vectors) > 1e8:
        raise InvalidInput(
            "law.damping", "one that makes a mode critical", "another, however near",
            "A critically damped contact has no eigenvectors to go by",
        )  # fmt: skip
    inverse = np.linalg.inv(vectors) / balance
    vectors = vectors * balance[:, None]
    kept = values.imag >= 0
    twice = np.where(values.imag > 0, 2.0, 1.0)[kept]
    rest = np.linalg.solve(stiffness, constant)
    dynamic = stiffness - np.eye(size) - 1j * matrix[size:, size:]
    forced = np.linalg.solve(dynamic, push)
    return {
        "rates": np.minimum(values.real, 0.0)[kept] + 1j * values.imag[kept],
        "vectors": lift @ (vectors[:, kept] * twice),
        "inverse": inverse[kept] @ lift.T,
        "rest": lift @ np.concatenate([rest, zeros]),
        "forced": lift @ np.concatenate([forced, 1j * forced]),
    }
