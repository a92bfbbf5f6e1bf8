"""Modes at each shift, and projections on them, beside those of LAPACK."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect.sound.timing._edge_kernels import LANE, PARTS, SIDE
from impactsig.detect.sound.timing._misfit_kernels import fit_at
from impactsig.detect.sound.timing._mode_basis_kernels import factor, project

SIZE, REACH = 40, 5
PLACES = np.arange(2 * PARTS * REACH, -1, -3)


def columns_of(values):
    """The columns of rows with PARTS values to a sample, as `step_modes` lays them apart."""
    rows, count = -(-len(values) // SIDE) * SIDE, -(-values.shape[1] // PARTS)
    out = np.zeros((PARTS, rows, count + LANE))
    for part in range(PARTS):
        own = values[:, part::PARTS]
        out[part, : len(values), : own.shape[1]] = own
    return out


def random_rows(seed, count):
    rng = np.random.default_rng(seed)
    return rng, rng.standard_normal((count + 2, PARTS * (SIZE + 2 * REACH) + 1))


def rows_of(values, place):
    """The rows at samples from a place on."""
    return values[:, place + PARTS * np.arange(SIZE)]


def orthonormal(rows, count):
    """An orthonormal basis of the first rows, and what it leaves of the other two."""
    q = np.linalg.qr(rows[:count].T)[0]
    return q, (rows[count:] - rows[count:] @ q @ q.T).T


def projections(basis, sounds, first):
    energy, found = np.empty(len(sounds)), np.empty((len(sounds), 3, len(basis.places)))
    project(sounds, np.arange(len(sounds)), first, basis, energy, found)
    return energy, found


@pytest.mark.parametrize("places", [PLACES, PLACES[::4], np.arange(2 * PARTS * REACH + 1)])
@pytest.mark.parametrize(("count", "near"), [(1, 1.0), (6, 1.0), (7, 1e-4), (13, 1.0)])
def test_projections_are_those_on_an_orthonormal_basis(count, near, places):
    """Some of the columns are all but dependent."""
    near_enough = 1e-12 + 1e-15 / near**2
    rng, values = random_rows(count, count)
    values[count // 2] = values[0] + near * values[count // 2]
    basis = factor(columns_of(values), count, places, SIZE)
    heard, first = rng.standard_normal((7, 90)), rng.integers(0, 90 - SIZE, 7)
    energy, found = projections(basis, heard, first)
    for j, place in enumerate(places):
        q, rest = orthonormal(rows_of(values, place), count)
        impulse, slope = rest.T
        grams = impulse @ impulse, slope @ slope, impulse @ slope
        assert basis.grams[:, j] == pytest.approx(grams, rel=near_enough, abs=near_enough)
        for i in range(7):
            own = heard[i, first[i] : first[i] + SIZE]
            assert energy[i] == pytest.approx(own @ own, rel=1e-13)
            own = own / np.sqrt(own @ own)
            expected = np.sum((q.T @ own) ** 2), own @ impulse, own @ slope
            assert found[i, :, j] == pytest.approx(expected, rel=near_enough, abs=near_enough)


@pytest.mark.parametrize("sounds", [1, 3, 4, 70])
def test_a_sound_has_the_same_projections_beside_others_and_alone(sounds):
    rng, values = random_rows(sounds, 6)
    basis = factor(columns_of(values), 6, PLACES, SIZE)
    heard, first = rng.standard_normal((sounds, 90)), rng.integers(0, 90 - SIZE, sounds)
    _, found = projections(basis, heard, first)
    for i in range(sounds):
        _, alone = projections(basis, heard[i : i + 1], first[i : i + 1])
        np.testing.assert_array_equal(alone[0], found[i])


def test_what_depends_on_others_counts_for_nothing():
    """As do rows of rounding errors: those of a mode at half the rate where its sine is 0."""
    rng, values = random_rows(5, 5)
    values[1], values[2], values[4] = 3.0 * values[0], 0.0, 1e-14 * values[4]
    basis = factor(columns_of(values), 5, PLACES, SIZE)
    heard = rng.standard_normal((1, SIZE))
    own = heard[0] / np.linalg.norm(heard)
    _, found = projections(basis, heard, np.zeros(1, int))
    for j, place in enumerate(PLACES):
        rows = rows_of(values, place)
        q, rest = orthonormal(rows[[0, 3, 5, 6]], 2)
        expected = np.sum((q.T @ own) ** 2), *(rest.T @ own)
        assert found[0, :, j] == pytest.approx(expected, abs=1e-12)


def test_silence_has_no_power():
    _, values = random_rows(2, 4)
    basis = factor(columns_of(values), 4, PLACES, SIZE)
    energy, found = projections(basis, np.zeros((2, SIZE)), np.zeros(2, int))
    assert not energy.any()
    assert not found.any()


def test_what_a_model_makes_of_a_sound_is_a_penalised_least_squares_fit():
    rng, values = random_rows(9, 6)
    basis, error, prior = factor(columns_of(values), 6, PLACES, SIZE), 1e-2, (0.5, 0.2)
    sound, out, found = rng.standard_normal(SIZE), np.empty(SIZE), np.empty(8)
    for j, place in enumerate(PLACES):
        fit_at(sound, error, prior, basis, j, found, out)
        rows = rows_of(values, place)
        penalty = np.zeros((8, 8))
        penalty[6, 6], penalty[7, 7] = error / prior[0], error / prior[1]
        amplitudes = np.linalg.solve(rows @ rows.T + penalty, rows @ sound)
        assert found == pytest.approx(amplitudes, abs=1e-11)
        assert out == pytest.approx(rows.T @ amplitudes, abs=1e-11)
