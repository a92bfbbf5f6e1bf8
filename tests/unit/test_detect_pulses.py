"""One pulse of a force record at a time, against closed forms: flags, crest, rise time, end."""

from __future__ import annotations

import numpy as np
import pytest

import impactsig
from impactsig.detect.pulses._extent import Place, summit
from impactsig.detect.pulses.edges import FIT
from impactsig.detect.pulses.fit_errors import KEPT
from impactsig.detect.pulses.pulse import measure_all
from impactsig.impacts import CLIPPED


def detect(x, **options):
    """Impacts of a record of one sample per second: all times are in samples."""
    return impactsig.detect_impacts(impactsig.Recording(x, 1.0, units="N"), **options)


def half_sines(starts, length, height=1.0, samples=6000):
    t = np.arange(samples, dtype=float)
    x = np.zeros(samples)
    for start, peak in zip(starts, np.broadcast_to(height, len(starts)), strict=True):
        u = (t - start) / length
        x += np.where((u > 0) & (u < 1), peak * np.sin(np.pi * u), 0.0)
    return x


def test_a_wide_pulse_is_measured_within_the_samples_at_hand():
    # 12 widths to either side are looked at, where there are as many.
    x = half_sines([100.3], 100.0, samples=1000)
    x[750:] = np.nan  # too far from it to count
    events, rows = np.array([[2150.0, 0.0, 74.0, 1.0]]), np.empty((1, FIT + KEPT))
    again = np.ones(1, np.bool_)
    measure_all(x, 2000, 9000, events, again, 0.0, -1.0, 9000.0, 0.0, False, rows)
    np.testing.assert_allclose(rows[0, :2], [2100.3, 100.0], atol=0.05)
    assert rows[0, 5] == 0


@pytest.mark.parametrize("heights", [(1.0, 3.0), (3.0, 1.0)])
@pytest.mark.parametrize("apart", [100, 150, 400])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_clipped_neighbour_does_not_make_a_pulse_clipped(heights, apart, sign):
    starts = [2000.3, 2000.3 + apart, 5000.3]
    x = sign * np.minimum(half_sines(starts, 50.0, (*heights, 1.0)), 2.0)
    found = detect(x)
    np.testing.assert_allclose(found.time, starts, atol=0.05)
    np.testing.assert_array_equal(found.flags[:2], [CLIPPED if h > 2 else 0 for h in heights])
    assert found.flags[2] == 0


@pytest.mark.parametrize(
    ("crest", "clipped"),
    [
        ([1.0], False),
        ([1.0, 1.0], False),
        ([1.0, 1.0, 1.0], True),
        ([1.0, 1.0, 1.0, 1.0], True),
        ([1.0, 1.0, 0.95, 1.0, 1.0], False),
    ],
)
def test_clipped_are_three_samples_in_a_row_at_the_greatest_value(crest, clipped):
    x = np.zeros(6000)
    for first, top in ((1500, [1.0]), (3000, crest), (4500, [1.0])):
        pulse = np.concatenate((np.arange(0.0, 0.95, 0.05), top, np.arange(0.9, 0.0, -0.05)))
        x[first : first + len(pulse)] = pulse
    np.testing.assert_array_equal(detect(x).flags, [0, CLIPPED if clipped else 0, 0])


def test_rise_time_of_a_pulse_that_is_measured_by_its_edges():
    # Straight sides, unequal and meeting zero at an angle, under a parabola: no member of the
    # family of shapes; but a parabola through three samples gives its crest exactly, and a
    # straight line through the samples of a side its touch.
    rise, fall = 20.0, 80.0
    starts = np.array([500.3, 1100.8, 1900.1])
    x = np.zeros(3000)
    for start in starts:
        u = np.arange(3000.0) - start - rise
        x += np.where(np.abs(u) <= rise / 2, 1 - 0.4 * (2 * u / rise) ** 2, 0.0)
        x += np.where((u > -rise) & (u < -rise / 2), 1.2 * (u + rise) / rise, 0.0)
        x += np.where((u > rise / 2) & (u < fall), 0.6 * (fall - u) / (fall - rise / 2), 0.0)
    found = detect(x)
    np.testing.assert_allclose(found.time, starts, atol=1e-6)
    np.testing.assert_allclose(found.rise_time, rise, atol=1e-6)
    np.testing.assert_allclose(found.peak, 1.0, atol=1e-9)


@pytest.mark.parametrize("length", [15.0, 40.0])
@pytest.mark.parametrize("beyond", [0.1, 0.3])
def test_a_contact_that_outlasts_the_record_ends_with_its_last_sample(length, beyond):
    last = 1999
    starts = np.array([300.3, 900.7, last + beyond - length])
    found = detect(half_sines(starts, length, samples=last + 1))
    np.testing.assert_allclose(found.time, starts, atol=0.05)
    end = found.time + found.contact_time
    np.testing.assert_allclose(end[:2], starts[:2] + length, atol=0.05)
    assert end[2] == pytest.approx(last, abs=1e-6)


@pytest.mark.parametrize("heights", [(0.8, 0.6), (0.6, 0.8)])
@pytest.mark.parametrize("apart", [42, 43])
def test_one_crest_is_not_measured_for_two_pulses(heights, apart):
    # The response, as wide as the long pulses, is flat as it passes a short one and greatest
    # anywhere near it: the crest of the short pulse before lies no further away.
    x = half_sines([300.3, 900.7, 1500.1, 2000.2, 2600.1, 3000.3], 50.0)
    for centre, height in zip((5000, 5000 + apart), heights, strict=True):
        x[centre - 1 : centre + 2] += height * np.array([0.5, 1.0, 0.5])
    found = detect(x)
    assert len(found) == 8
    np.testing.assert_allclose(found.peak[6:], heights, rtol=1e-6)
    assert np.all(found.time[6:] < [5000, 5000 + apart])
    assert np.all(found.time[6:] > [4996, 4996 + apart])


@pytest.mark.parametrize("apart", [6, 7])
def test_every_sample_between_two_crests_is_looked_at_for_one_of_them(apart):
    # Were the sample half way looked at for both, the falling side of the stronger would be taken
    # for the crest of the weaker.
    first, second, total = 20, 20 + apart, 50
    places = (
        Place(-1, first, second, 0, total, total),
        Place(first, second, total, 0, total, total),
    )
    for sample in range(first + 1, second):
        x = np.zeros(total)
        x[sample] = 1.0
        tops = [summit(x, place, 0.0, 10, 0.0)[0] for place in places]
        assert sorted(top == sample for top in tops) == [False, True], sample


@pytest.mark.parametrize(("seed", "start"), [(2303, 481.94)])
def test_the_sample_half_way_to_a_neighbour_is_the_neighbours(seed, start):
    # Close trains of half-sines of any length: were that sample looked at for both pulses, the
    # falling side of the stronger would be taken for the crest of the weaker, which is then lost.
    rng = np.random.default_rng(seed)
    samples = int(rng.integers(300, 3000))
    x = rng.choice([0, 0.01, 0.1]) * rng.standard_normal(samples)
    longest, at = rng.uniform(5, 60), rng.uniform(0, 30)
    truth = []
    while at < samples:
        length = longest * rng.uniform(0.1, 1)
        truth.append(at)
        x += half_sines([at], length, rng.uniform(0.3, 1), samples)
        at += length + rng.choice([0.2, 0.5, 1, 4]) * longest * rng.random()
    assert np.abs(np.array(truth) - start).min() < 0.01
    # The weak beginning of a pulse may be hidden by the fall of the one before.
    assert np.abs(detect(x).time - start).min() < 2
