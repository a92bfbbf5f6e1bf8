"""Standard errors of what force detection measures, against the errors that it makes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import impactsig
from benchmarks.errors import MEASURED, SHAPES, cramer_rao, errors, record
from benchmarks.recordings import add_pulses
from impactsig._trains.impact_columns import ERRORS
from impactsig.impacts import CLIPPED, OPEN_END, OPEN_START


def half_sines(starts, length=50.0, height=1.0, samples=6000, noise=0.0, seed=0):
    """A record of one sample per second."""
    t = np.arange(samples, dtype=float)
    x = noise * np.random.default_rng(seed).standard_normal(samples)
    for start, peak in zip(starts, np.broadcast_to(height, len(starts)), strict=True):
        u = (t - start) / length
        x += np.where((u > 0) & (u < 1), peak * np.sin(np.pi * u), 0.0)
    return x


def detect(x, **options):
    return impactsig.detect_impacts(impactsig.Recording(x, 1.0, units="N"), **options)


def rms_z(rows, name):
    return np.sqrt(np.mean([(row[name] / row[f"{name}_error"]) ** 2 for row in rows]))


def test_bound_of_a_half_sine_is_its_closed_form():
    # Fisher information of A sin(pi (t - s) / T) at n samples a contact, noise of 1: with
    # I(f, g) = n int f g, columns A pi cos(pi u), sin(pi u) and A pi u cos(pi u).
    amplitude, n = 5.0, 80.0
    a = amplitude * np.pi
    information = n * np.array(
        [
            [a**2 / 2, 0.0, a**2 / 4],
            [0.0, 0.5, -amplitude / 4],
            [a**2 / 4, -amplitude / 4, a**2 * (1 / 6 + 1 / (4 * np.pi**2))],
        ]
    )
    expected = np.sqrt(np.linalg.inv(information)[0, 0])
    assert cramer_rao(SHAPES["half-sine"], amplitude, n) == pytest.approx(expected, rel=1e-5)


def test_what_noise_hides_in_each_pulse_shows_in_all(monkeypatch):
    # No member of the family has a third harmonic. Fits of single pulses of 20 samples follow it.
    ripple = lambda u: np.sin(np.pi * u) + 0.1 * np.sin(3.0 * np.pi * u)  # noqa: E731
    monkeypatch.setitem(SHAPES, "rippled", ripple)
    options = {"levels": (10.0, 30.0, 40.0), "count": 100, "scatter": 0.03}
    rows = [row for seed in range(81, 84) for row in errors("rippled", 20e3, seed, **options)]
    clear = [row for row in rows if row["level"] > 20]
    for name in ("time", "contact_time"):
        assert 0.5 < rms_z(clear, name) < 1.5


def test_edges_of_one_sample_leave_contact_times_of_flat_tops_in_doubt():
    # Of six samples one is on each edge; contacts were 2.3 of their errors off.
    options = {"contact": 0.3e-3, "levels": (10.0, 40.0), "count": 100}
    rows = [row for seed in range(81, 85) for row in errors("flat-topped", 20e3, seed, **options)]
    clear = [row for row in rows if row["level"] > 20]
    assert 0.3 < rms_z(clear, "contact_time") < 1.5
    assert 0.3 < rms_z(clear, "time") < 1.5


@pytest.mark.parametrize("pulse", ["half-sine", "raised cosine"])
def test_contacts_of_six_samples_err_by_as_much_as_is_stated(pulse):
    # Two samples on each edge: where a touch lies between samples is hardly seen. Without what is
    # added for that, raised cosines have 1.3.
    options = {"contact": 0.3e-3, "levels": (40.0,), "count": 60, "scatter": 0.03}
    rows = [row for seed in range(91, 97) for row in errors(pulse, 20e3, seed, **options)]
    assert len(rows) > 350
    for name in MEASURED:
        assert 0.55 < rms_z(rows, name) < 1.2


def halves_of_a_record(scatter):
    """Stated and made errors of contact times at 20 dB [s], of the first second and of the rest.

    The first 200 impacts have equal contacts, the others those of such a scatter.
    """
    rng = np.random.default_rng(7)
    rate, count = 50e3, 320
    time = 0.05 + np.cumsum(1e-3 * rng.uniform(20.0, 30.0, count))
    contact = 1e-3 * np.exp(scatter * rng.standard_normal(count) * (np.arange(count) >= 200))
    height = np.where(np.arange(count) % 2, 100.0, 10.0)
    x = rng.standard_normal(round((time[-1] + 0.05) * rate))
    add_pulses(x, rate, time, contact, height, SHAPES["half-sine"])
    found = impactsig.detect_impacts(impactsig.Recording(x, rate, units="N"))
    assert len(found) == count
    rows = np.stack([found.contact_time_error, found.contact_time - contact, found.time], axis=1)
    return rows[(height == 10.0) & (time < 1.0)], rows[(height == 10.0) & (np.arange(count) >= 200)]


def test_spans_that_agree_tell_that_contacts_are_equal():
    # One span cannot tell no spread from a small one; six that see none can.
    first, last = halves_of_a_record(0.0)
    assert np.median(last[:, 0]) < 0.93 * np.median(first[:, 0])
    assert np.sqrt(np.mean((last[:, 1] / last[:, 0]) ** 2)) < 1.3


def test_contacts_that_begin_to_differ_are_no_longer_taken_for_equal():
    _, last = halves_of_a_record(0.1)
    assert np.sqrt(np.mean((last[:, 1] / last[:, 0]) ** 2)) < 1.3


def test_a_foot_of_infinite_slope_is_seen_between_stretches():
    # The mean edge is read in stretches. Of a fiftieth of it each, a foot that rises within a
    # tenth of one left contact times off by two standard errors.
    pulse, options = "skewed early", {"levels": (40.0,), "count": 80}
    rows = [row for seed in range(101, 104) for row in errors(pulse, 200e3, seed, **options)]
    assert rms_z(rows, "time") < 1.2
    assert rms_z(rows, "contact_time") < 1.3


@pytest.mark.parametrize("rate", [20e3, 50e3, 200e3])
def test_errors_are_as_large_as_their_standard_errors(rate):
    # Several records: the error of the shape is common to the impacts of one. Contact times
    # differ, as those of a machine do; equal ones are nearer to their mean than can be known.
    options = {"levels": (10.0, 20.0), "count": 60, "scatter": 0.03}
    rows = [row for seed in range(31, 36) for row in errors("half-sine", rate, seed, **options)]
    assert len(rows) > 220
    for name in MEASURED:
        assert 0.65 < rms_z(rows, name) < 1.3


def test_coloured_noise_makes_errors_larger():
    # Noise below half of Nyquist's frequency has twice the power there, sqrt(2) the deviation.
    options = {"levels": (20.0,), "count": 150, "scatter": 0.03}
    white = errors("half-sine", 50e3, 22, **options)
    coloured = errors("half-sine", 50e3, 22, cutoff=0.5, **options)
    for name in MEASURED:
        assert 0.7 < rms_z(coloured, name) < 1.35
    ratio = np.median([r["impulse_error"] for r in coloured])
    ratio /= np.median([r["impulse_error"] for r in white])
    assert ratio == pytest.approx(np.sqrt(2), rel=0.1)


def test_standard_error_of_an_instant_lies_between_its_bounds():
    # Other impacts show the shape and the length: at best these are as good as given.
    rows = errors("half-sine", 50e3, 23, levels=(10.0,), count=150)
    ratio = np.median([row["time_error"] / row["bound"] for row in rows])
    given = cramer_rao(SHAPES["half-sine"], 10**0.5, 50.0, length_given=True)
    assert given / cramer_rao(SHAPES["half-sine"], 10**0.5, 50.0) < ratio <= 1.3


def test_faint_impacts_are_measured_with_the_shape_of_clear_ones():
    # Feet of zero slope lie below the noise of a faint pulse: by itself it reads short by a
    # third of a contact, and begins late by three times its bound or more.
    rows = errors("sine^1.5", 50e3, 24, levels=(20.0, 40.0), count=150)
    faint = [row for row in rows if row["level"] == 20]
    assert len(faint) > 50
    assert np.sqrt(np.mean([(row["time"] / row["bound"]) ** 2 for row in faint])) < 1.6
    assert abs(np.mean([row["contact_time"] for row in faint])) < 0.02e-3


@pytest.mark.parametrize("pulse", ["half-sine", "sine^1.5", "raised cosine"])
def test_faint_impacts_without_clear_ones_are_as_uncertain_as_they_are_off(pulse):
    # Feet of zero slope lie below the noise of each. Instants of raised cosines were late by three
    # standard errors, and contact times of single seconds up to three times as long.
    options = {"levels": (14.0,), "count": 120}
    rows = [row for seed in range(401, 404) for row in errors(pulse, 50e3, seed, **options)]
    assert 0.6 < rms_z(rows, "time") < 1.25
    assert 0.5 < rms_z(rows, "contact_time") < 1.7
    assert max(abs(row["contact_time"]) for row in rows) < 0.4e-3
    assert np.median([row["time_error"] / row["bound"] for row in rows]) < 1.3


@pytest.mark.parametrize(("pulse", "most"), [("flat-topped", 3.0), ("asymmetric", 8.0)])
def test_clear_impacts_of_another_shape_are_as_uncertain_as_they_are_off(pulse, most):
    # A kink at the top, and a foot of infinite slope: no member of the family has them. Edges of
    # clear impacts show by how much fits are off, and fits leave more than noise.
    options = {"levels": (30.0, 40.0), "count": 60}
    rows = [row for seed in range(71, 75) for row in errors(pulse, 50e3, seed, **options)]
    for name in ("time", "contact_time"):
        assert 0.3 < rms_z(rows, name) < 1.3
    off = np.sqrt(np.mean([(row["time"] / row["bound"]) ** 2 for row in rows]))
    assert off < most


def test_peaks_of_a_skewed_shape_are_no_choice_of_noise(monkeypatch):
    # Its flat top is a hundredth of an edge. Of ten stretches there, with a sample or two in each,
    # the highest was taken for the crest: peaks were up to 2 % too high.
    greatest = 1 / 2.6 * (1.6 / 2.6) ** 1.6
    monkeypatch.setitem(SHAPES, "u (1 - u)^1.6", lambda u: u * (1.0 - u) ** 1.6 / greatest)
    rows = [row for seed in (501, 503) for row in errors("u (1 - u)^1.6", 50e3, seed)]
    off = [row["peak"] for row in rows if row["level"] == 40]  # [%]
    assert np.sqrt(np.mean(np.square(off))) < 0.6


def test_long_flat_tops_are_as_uncertain_as_they_are_off():
    # Misfit hides neither their height, nor do they differ by 0.2 % because a floor says so.
    rows = [row for seed in range(3) for row in errors("flat-topped", 200e3, seed, count=80)]
    clear = [row for row in rows if row["level"] == 40]
    assert 0.5 < rms_z(clear, "peak") < 1.3
    faint = [row["contact_time_error"] for row in rows if row["level"] == 10]
    assert np.median(faint) < 0.33 / 200e3
    assert 0.8 < rms_z(rows, "contact_time") < 1.3


def test_misfit_widens_no_error_where_the_shape_is_of_the_family():
    # At 30 dB the shape is seen well: instants are known to about their bound.
    rows = errors("half-sine", 50e3, 72, levels=(30.0,), count=60)
    assert np.median([row["time_error"] / row["bound"] for row in rows]) < 1.3


@pytest.mark.parametrize("pulse", ["half-sine", "flat-topped", "raised cosine"])
def test_intervals_are_as_uncertain_as_they_are_off(pulse):
    # Clear impacts of one second share most of their error: that of the shape common to them.
    truth = record(pulse, 50e3, 91, levels=(40.0,), count=200, scatter=0.03)
    found = impactsig.detect_impacts(impactsig.Recording(truth.samples, truth.rate))
    assert len(found) == 200
    assert np.median(found.shared_time_error / found.time_error) > 0.3
    off = np.diff(found.time - truth.time)
    z, alone = (
        off / np.sqrt(train.intervals(errors=True)[1].diagonal())
        for train in (found, replace(found, shared_time_error=None))
    )
    assert 0.55 < np.sqrt(np.mean(z**2)) < 1.25
    assert np.sqrt(np.mean(alone**2)) < 0.97 * np.sqrt(np.mean(z**2))


def rarely(seed, gaps=(), polarity=1.0):
    """Half-sines of 1 ms, 20 a second at 20 kHz, twice a second; and their instants."""
    rng = np.random.default_rng(seed)
    time = 0.3 + 0.5 * np.arange(40) + 0.1 * rng.random(40)
    x = polarity * half_sines(20e3 * time, length=20.0, height=40.0, samples=410_000)
    x += rng.standard_normal(len(x))
    for gap in gaps:
        x[slice(*gap)] = np.nan
    return x, time


def test_peaks_of_rare_impacts_are_not_too_low():
    # Alone, each may have had a flat top, and none can have had one shorter than none.
    z = []
    for seed in range(3):
        x, time = rarely(seed)
        found = impactsig.detect_impacts(impactsig.Recording(x, 20e3))
        assert found.time == pytest.approx(time, abs=2e-5)
        z += list((found.peak - 40.0) / found.peak_error)
        assert np.median(found.shared_peak_error / found.peak_error) > 0.1
    assert abs(np.mean(z)) < 0.5
    assert 0.75 < np.std(z) < 1.25


def test_rare_impacts_are_measured_together_across_gaps():
    whole, time = rarely(7)
    parted, _ = rarely(7, gaps=[(60_000, 60_400), (204_000, 205_400)])
    a, b = (
        impactsig.detect_impacts(impactsig.Recording(x, 20e3), gaps="split")
        for x in (whole, parted)
    )
    assert b.time == pytest.approx(time, abs=2e-5)
    assert b.peak == pytest.approx(a.peak, abs=0.2)
    turned = impactsig.detect_impacts(impactsig.Recording(-whole, 20e3))
    np.testing.assert_allclose(turned.peak, a.peak, rtol=1e-9)


def test_impulse_of_a_half_sine_is_as_uncertain_as_noise_and_baseline_make_it():
    # Sum of T samples, and T times the mean of 8 to 10 T samples beside the pulse.
    length, noise = 50.0, 0.02
    found = detect(half_sines([1000.3, 2500.7, 4200.1], length, noise=noise))
    least = noise * np.sqrt(length * (1 + 1 / 10))
    assert np.all(found.impulse_error > 0.9 * least)
    assert np.all(found.impulse_error < 1.2 * least)


def test_impulse_of_a_force_that_begins_with_a_jump_is_uncertain_by_where_it_lies():
    # A fifth of the height lies between two samples: at 40 dB that is more than the noise.
    options = {"levels": (40.0,), "count": 150}
    rows = [row for seed in (81, 82) for row in errors("Kelvin-Voigt", 20e3, seed, **options)]
    assert 0.8 < rms_z(rows, "impulse") < 1.4


def test_errors_grow_with_the_noise_and_scale_with_the_unit():
    starts = 500.0 + 700.0 * np.arange(7) + 0.3
    quiet, loud = (detect(half_sines(starts, noise=noise, seed=1)) for noise in (0.01, 0.05))
    for name in ERRORS:
        assert np.median(getattr(loud, name)) > 2 * np.median(getattr(quiet, name))
    scaled = detect(1024.0 * half_sines(starts, noise=0.05, seed=1))
    np.testing.assert_allclose(scaled.time_error, loud.time_error, rtol=1e-9)
    np.testing.assert_allclose(scaled.peak_error, 1024.0 * loud.peak_error, rtol=1e-9)
    np.testing.assert_allclose(scaled.impulse_error, 1024.0 * loud.impulse_error, rtol=1e-9)


def test_a_converter_of_few_steps_leaves_peak_and_impulse_uncertain_by_its_step():
    step, length = 0.05, 50.0
    starts, heights = [1000.3, 2500.7, 4200.1, 5200.6], [1.0, 1.0, 1.0, 2.0]
    x = step * np.round(half_sines(starts, length, heights) / step)
    found = detect(x)[:3]  # the highest counts as clipped
    # Without noise the baseline may be anywhere within a step: uniform, over sqrt(12).
    assert np.all(found.peak_error > 0.5 * step / np.sqrt(12))
    assert np.all(found.impulse_error > 0.9 * length * step / np.sqrt(12))
    assert np.all(found.peak_error < 3 * step)


def test_what_an_open_or_clipped_pulse_does_not_show_has_an_infinite_error():
    starts = [-20.0, 1000.3, 2500.7, 5970.0]
    x = np.minimum(half_sines(starts, height=[1.0, 1.0, 3.0, 1.0], noise=0.001), 2.0)
    found = detect(x)
    np.testing.assert_array_equal(found.flags, [OPEN_START, 0, CLIPPED, OPEN_END])
    for name, finite in (
        ("time_error", [False, True, True, True]),
        ("contact_time_error", [False, True, True, False]),
        ("peak_error", [True, True, False, True]),
        ("impulse_error", [False, True, False, False]),
    ):
        np.testing.assert_array_equal(np.isfinite(getattr(found, name)), finite, err_msg=name)


@pytest.mark.parametrize("level", [0.3, "30 %"])
def test_contact_between_crossings_of_a_level_errs_by_noise_over_slope(level):
    starts = 500.0 + 400.0 * np.arange(60) + 0.37
    length, noise = 50.0, 0.01
    x = half_sines(starts, length, samples=25_000, noise=noise, seed=5)
    found = detect(x, contact_level=level)
    expected = length * (1.0 - 2.0 / np.pi * np.arcsin(0.3))
    slope = np.pi / length * np.cos(np.arcsin(0.3))
    z = (found.contact_time - expected) / found.contact_time_error
    assert 0.75 < np.sqrt(np.mean(z**2)) < 1.3
    assert np.median(found.contact_time_error) == pytest.approx(
        np.sqrt(4 / 3) * noise / slope, rel=0.25
    )


def test_no_impact_has_no_errors():
    found = detect(np.random.default_rng(0).standard_normal(6000))
    assert len(found) == 0
    for name in ERRORS:
        assert getattr(found, name).shape == (0,)


@pytest.mark.parametrize("level", [5e-324, 1e-200, 0.5, 1.0, 2.0])
def test_contact_times_at_levels_within_the_noise(level):
    """Their errors were 0 far below the noise, and half of the actual ones at half of it."""
    rng, noise, contact = np.random.default_rng(8), 0.02, 6e-4
    start = np.cumsum(rng.uniform(0.05, 0.15, 100))
    peak = np.exp(rng.normal(0, 0.3, 100))
    time = np.arange(int(50e3 * (start[-1] + 0.2))) / 50e3
    samples = noise * rng.standard_normal(len(time))
    for at, height in zip(start, peak, strict=True):
        inside = (time >= at) & (time <= at + contact)
        samples[inside] += height * np.sin(np.pi * (time[inside] - at) / contact)
    level *= noise if level > 0.1 else 1.0
    recording = impactsig.Recording(samples, 50e3)
    found = impactsig.detect_impacts(recording, contact_level=level)
    assert len(found) == 100
    above = contact * (1 - 2 / np.pi * np.arcsin(level / peak))
    z = (found.contact_time - above) / found.contact_time_error
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.25
