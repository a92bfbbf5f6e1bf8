"""Bases of shared modes at each shift, and projections on them, beside those of LAPACK."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect.sound.timing._mode_basis_kernels import (
    ROWS_AT_ONCE,
    orthonormal,
    project,
)

PARTS, SIZE, REACH = 4, 40, 5


def bases(columns, count, shifts):
    rows = -(-len(columns) // ROWS_AT_ONCE) * ROWS_AT_ONCE
    basis, grams = np.empty((len(shifts), rows, SIZE)), np.empty((3, len(shifts)))
    orthonormal(columns, count, PARTS, PARTS * REACH, shifts, basis, grams)
    return basis, grams


def rows_of(columns, shift):
    """The columns at samples of which the first lies a shift before sample REACH."""
    return columns[:, PARTS * (np.arange(SIZE) + REACH) - shift]


@pytest.mark.parametrize(("count", "near"), [(1, 1.0), (6, 1.0), (7, 1e-4)])
def test_they_span_what_lapack_does(count, near):
    """Some of the columns are all but dependent: once more is needed there."""
    rng = np.random.default_rng(count)
    columns = rng.standard_normal((count + 2, PARTS * (SIZE + 2 * REACH) + 1))
    columns[count // 2] = columns[0] + near * columns[count // 2]
    shifts = np.arange(-PARTS * REACH, PARTS * REACH + 1, 3)
    basis, grams = bases(columns, count, shifts)
    spare = basis.shape[1] - len(columns)
    assert not basis[:, :spare].any()
    for j, shift in enumerate(shifts):
        rows = rows_of(columns, shift)
        q = np.linalg.qr(rows[:count].T)[0]
        found, rest = basis[j, spare : spare + count], basis[j, spare + count :]
        assert found @ found.T == pytest.approx(np.eye(count), abs=1e-14)
        assert found.T @ found == pytest.approx(q @ q.T, abs=1e-14 / near)
        assert rest == pytest.approx(rows[count:] - rows[count:] @ q @ q.T, abs=1e-13 / near)
        assert grams[:, j] == pytest.approx(
            [rest[0] @ rest[0], rest[1] @ rest[1], rest[0] @ rest[1]]
        )


def test_what_depends_on_others_counts_for_nothing():
    rng = np.random.default_rng(5)
    columns = rng.standard_normal((5, PARTS * (SIZE + 2 * REACH) + 1))
    columns[1], columns[2] = 3.0 * columns[0], 0.0
    basis, _ = bases(columns, 3, np.array([-2, 0]))
    rows = basis[:, -5:]
    assert np.sum(rows[:, :3] ** 2, axis=2) == pytest.approx(np.array([[1.0, 0.0, 0.0]] * 2))
    assert rows[:, 3:] @ rows[:, :1].transpose(0, 2, 1) == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("sounds", [1, 70])
def test_projections(sounds):
    """Of more sounds than are projected side by side, too."""
    rng = np.random.default_rng(sounds)
    basis = rng.standard_normal((3, 2 * ROWS_AT_ONCE, SIZE + 1))
    heard, first = rng.standard_normal((sounds, 90)), rng.integers(0, 90 - SIZE, sounds)
    energy, found = np.empty(sounds), np.empty((sounds, 3, 3))
    project(heard, np.arange(sounds), first, basis, energy, found)
    for i in range(sounds):
        own = heard[i, first[i] : first[i] + SIZE + 1]
        products = basis @ own / np.sqrt(own @ own)
        assert energy[i] == pytest.approx(own @ own)
        assert found[i, 0] == pytest.approx(np.sum(products[:, :-2] ** 2, axis=1))
        assert found[i, 1:] == pytest.approx(products[:, -2:].T)
