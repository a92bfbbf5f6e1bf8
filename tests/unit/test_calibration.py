"""Gain and offset from known loads."""

from __future__ import annotations

import doctest

import numpy as np
import pytest

from impactsig import (
    InvalidInput,
    Recording,
    calibration,
    detect_impacts,
    fit_calibration,
    match_impacts,
)


def test_example():
    assert doctest.testmod(calibration, extraglobs={"np": np}).failed == 0


@pytest.mark.parametrize("through_zero", [False, True])
@pytest.mark.parametrize("given", ["none", "load", "both"])
def test_standard_errors_are_those_of_many_fits(given, through_zero):
    rng = np.random.default_rng(3)
    load = np.linspace(5.0, 60.0, 12)
    of_load = np.full(12, 0.05) if given == "none" else 0.002 * load
    of_reading = 0.3 if given == "both" else 0.0
    offset = 0.0 if through_zero else 1.5
    errors = {
        "none": {},
        "load": {"load_error": of_load},
        "both": {"load_error": of_load, "reading_error": of_reading},
    }[given]
    z = []
    for _ in range(800):
        reading = (load - offset) / 8.0 + of_reading * rng.standard_normal(12)
        known = load + of_load * rng.standard_normal(12)
        fit = fit_calibration(reading, known, through_zero=through_zero, **errors)
        at = fit.scale * 3.0 + fit.offset - (8.0 * 3.0 + offset)
        z.append(((fit.scale - 8.0) / np.sqrt(fit.covariance[0, 0]), at / fit.error(3.0)))
    # Student's t with 10 or 11 degrees of freedom where the size of the errors is fitted.
    expected = np.sqrt(10 / 8) if given == "none" else 1.0
    assert np.all(np.abs(np.std(z, axis=0) / expected - 1) < 0.1)
    assert np.all(np.abs(np.mean(z, axis=0)) < 0.15)


@pytest.mark.parametrize("through_zero", [False, True])
@pytest.mark.parametrize("power", [0.0, 1.0])
def test_what_all_errors_share_no_number_of_loads_takes_away(power, through_zero):
    rng = np.random.default_rng(4)
    load = np.linspace(5.0, 60.0, 40)
    reading = load / 8.0
    of_reading, of_load = 0.01 * reading**power, 0.004 * load**power
    z = []
    for _ in range(600):
        x, y = (
            true + of * (0.8 * rng.standard_normal(40) + 0.6 * rng.standard_normal())
            for true, of in ((reading, of_reading), (load, of_load))
        )
        fit = fit_calibration(
            x,
            y,
            reading_error=of_reading,
            load_error=of_load,
            shared_reading_error=0.6 * of_reading,
            shared_load_error=0.6 * of_load,
            through_zero=through_zero,
        )
        z.append((fit.scale * 3.0 + fit.offset - 24.0) / fit.error(3.0))
    # The shared part is in the errors that the points are weighted by, too.
    assert 0.85 < np.std(z) < 1.07


def test_an_exact_line_and_a_recording():
    fit = fit_calibration([0.0, 1.0, 2.0], [3.0, 5.0, 7.0], unit="N")
    assert (fit.scale, fit.offset) == (pytest.approx(2.0), pytest.approx(3.0))
    done = fit.apply(Recording([0.0, 0.5], 100.0, units="V"))
    assert done.samples == pytest.approx([3.0, 4.0])
    assert done.unit == "N"


@pytest.mark.parametrize(
    ("reading", "load", "more", "words"),
    [
        ([1.0, 2.0], [1.0, 2.0], {}, "3 or more"),
        ([1.0, 2.0, 3.0], [1.0, 2.0], {}, "as many of both"),
        ([1.0, 1.0, 1.0], [1.0, 2.0, 3.0], {}, "differ"),
        ([1.0, np.nan, 1.0], [1.0, 2.0, 3.0], {}, "finite"),
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], {"load_error": 0.0}, "load_error"),
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], {"unit": 3}, "unit: got 3; required: text"),
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], {"reading_error": [1.0, 1.0]}, "reading_error"),
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], {"shared_load_error": 0.1}, "load_error, and no more"),
        (
            [1.0, 2.0, 3.0],
            [1.0, 2.0, 3.0],
            {"reading_error": 0.2, "shared_reading_error": [0.1, 0.1, 0.3]},
            "shared_reading_error",
        ),
    ],
)
def test_refusals(reading, load, more, words):
    with pytest.raises(InvalidInput, match=words):
        fit_calibration(reading, load, **more)


def test_a_hammer_of_known_mass():
    """Blows of a hammer that carries an accelerometer, on a cell of 0.2 mV/N."""
    mass, gain, rate = 0.32, 2e-4, 50_000
    z, errors = [], []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        t = np.arange(2 * rate) / rate
        acceleration, volts = 8.0 * rng.standard_normal(len(t)), 1e-4 * rng.standard_normal(len(t))
        for touch in 0.05 + 0.09 * np.arange(21) + 0.01 * rng.random(21):
            u = (t - touch) / 1e-3
            blow = rng.uniform(50.0, 400.0) * np.where((u > 0) & (u < 1), np.sin(np.pi * u), 0.0)
            acceleration += blow / mass
            volts += gain * blow
        volts = 5e-5 * np.round(volts / 5e-5)  # the converter's steps
        hammer, cell = (detect_impacts(Recording(one, rate)) for one in (acceleration, volts))
        cells, blows = match_impacts(cell, hammer).pairs.T
        assert len(cells) == 21
        for what in ("peak", "impulse"):
            of_hammer, of_cell = (
                (getattr(train, what)[own], getattr(train, f"{what}_error")[own])
                for train, own in ((hammer, blows), (cell, cells))
            )
            shared = {}
            if what == "peak":
                shared["shared_reading_error"] = cell.shared_peak_error[cells]
                shared["shared_load_error"] = mass * hammer.shared_peak_error[blows]
            fit = fit_calibration(
                of_cell[0],
                mass * of_hammer[0],
                reading_error=of_cell[1],
                load_error=mass * of_hammer[1],
                through_zero=True,
                unit="N",
                **shared,
            )
            error = np.sqrt(fit.covariance[0, 0])
            z.append((fit.scale - 1 / gain) / error)
            errors.append(error * gain)
    assert np.sqrt(np.mean(np.square(z))) < 1.3
    assert max(errors) < 3e-3  # of the scale
