"""Force records as instruments deliver them: fresh seeds of `benchmarks/disturbances.py`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import signal

import impactsig
from benchmarks.disturbances import records
from benchmarks.recordings import score

CASES = {case.name: case for case in records()}
LEAST = {
    "step, 5": 0.99,
    "step, 0.5": 0.985,
    "bump 0.1 s, 5": 0.99,
    "push 0.5 s, 2": 0.99,
    "settling, 0.05 s": 0.985,
    "settling, 1 s": 0.985,
    "glitch x 1, 400": 0.99,
    "glitch x 30, 10": 0.99,
    "glitch x 30, 400": 0.99,
    "ADC, peak 10, noise 0.1": 0.99,
    "ADC, peak 10, noise 0.3": 0.99,
    "ADC drift, peak 10, noise 0.1": 0.99,
    "ADC gain, peak 100, noise 0.25": 0.99,
    "float32, offset 1e+06": 0.99,
    "hum, 1 ms, 0.5": 0.98,
    "hum, 2 ms, 0.5": 0.97,
    "hum, 3 ms, 0.5": 0.93,
    "AC coupling of 1 ms, 3 ms, noise 0.1": 0.98,
    "AC coupling of 20 ms, 3 ms, noise 0.001": 0.99,
    "widths, 3": 0.99,
    "widths, 30": 0.985,
    "samples a contact, 1": 0.97,
    "touching 2 ms, 2.0 ms": 0.98,
}


def found_in(truth, **options):
    rec = impactsig.Recording(truth.samples, truth.rate, units="N", sensor="force")
    return impactsig.detect_impacts(rec, **options)


@pytest.mark.parametrize("name", LEAST)
def test_impacts_among_disturbances(name):
    truth = CASES[name].make(203)
    found = found_in(truth)
    assert score(found.time, truth.time)[0] >= LEAST[name]


@pytest.mark.parametrize(
    "name", [name for name, case in CASES.items() if case.allowed == 0 and "nothing" in name]
)
def test_no_impact_where_there_is_none(name):
    assert len(found_in(CASES[name].make(203))) == 0


def test_disturbances_are_counted_and_located():
    truth = CASES["glitch x 30, 400"].make(5)
    off = np.abs(truth.samples) > 100
    glitches = [one for one in found_in(truth).disturbances if one.kind == "glitch"]
    np.testing.assert_allclose([one.start for one in glitches], np.flatnonzero(off) / truth.rate)
    truth = CASES["step, 5"].make(5)
    jump = np.argmax(np.abs(np.diff(truth.samples))) / truth.rate
    moves = [one for one in found_in(truth).disturbances if one.kind == "baseline"]
    assert len(moves) == 1
    assert moves[0].start <= jump <= moves[0].start + moves[0].duration


def test_the_instrument_is_read_from_the_samples():
    found = found_in(CASES["ADC gain, peak 10, noise 0.3"].make(5))
    steps = np.diff(np.unique(CASES["ADC gain, peak 10, noise 0.3"].make(5).samples))
    assert found.settings["converter_step"] == pytest.approx(steps[steps > 1e-9].min(), rel=1e-3)
    hum = found_in(CASES["hum, 1 ms, 0.5"].make(5)).settings["hum"]
    assert hum["50 Hz"] == pytest.approx(0.5, rel=0.3)
    assert hum["150 Hz"] == pytest.approx(0.15, rel=0.4)


def test_notes_say_what_is_doubtful_and_nothing_else():
    assert found_in(CASES["stationary, 20 dB"].make(5)).notes == ()
    faint = found_in(CASES["stationary, 6 dB"].make(5)).notes
    assert len(faint) == 1
    assert "hardly stronger than the threshold" in faint[0]


def test_pulses_longer_than_a_contact_are_asked_about():
    rng = np.random.default_rng(1)
    x = 0.01 * rng.standard_normal(200_000)
    t = np.arange(4000) / 4000
    for start in range(25_000, 190_000, 20_000):
        x[start : start + 4000] += np.sin(np.pi * t)
    rec = impactsig.Recording(x, 10_000.0, units="N", sensor="force")
    found = impactsig.detect_impacts(rec)
    assert len(found) == 9
    assert "give contact_time" in found.notes[0]
    given = impactsig.detect_impacts(rec, contact_time=(0.1, 1.0))
    assert len(given) == 9
    assert given.notes == ()
    assert len(impactsig.detect_impacts(rec, contact_time=(0, 0.03))) == 0


def test_a_contact_time_at_a_share_of_each_peak():
    from tests.unit.test_detect_force import half_sines, recording

    x = half_sines([0.05, 0.1], 1e-3, [1.0, 4.0])
    found = impactsig.detect_impacts(recording(x), contact_level="10 %")
    above = 1e-3 * (1 - 2 / np.pi * np.arcsin(0.1))
    np.testing.assert_allclose(found.contact_time, above, rtol=2e-3)
    assert found.contact_level == "10 %"


def test_merged_ringing_keeps_the_first_contact():
    from tests.unit.test_detect_force import half_sines, recording

    x = half_sines([0.05, 0.052, 0.054, 0.1], 600e-6, [1.0, 0.5, 0.25, 1.0])
    found = impactsig.detect_impacts(recording(x), merge_within=0.01)
    np.testing.assert_allclose(found.contact_time, 600e-6, rtol=5e-3)
    np.testing.assert_array_equal(found.pulses, [3, 1])


@pytest.mark.parametrize("name", ["glitch x 30, 10", "glitch x 30, 400"])
@pytest.mark.parametrize("seed", [1, 2])
def test_glitches_do_not_turn_the_record_upside_down(name, seed):
    truth = CASES[name].make(seed)
    found = found_in(truth)
    assert found.settings["polarity"] == "positive"
    assert score(found.time, truth.time)[0] >= 0.99


@pytest.mark.parametrize("noise", [0.1, 0.25])
def test_codes_that_a_slow_drift_holds_are_no_dropouts(noise):
    truth = CASES[f"ADC drift, peak 10, noise {noise}"].make(823)
    found = found_in(truth)
    assert score(found.time, truth.time)[0] > 0.99
    assert not any(one.kind == "dropout" for one in found.disturbances)
    assert not found.notes


def test_hum_as_weak_as_the_noise_is_taken_off_where_only_seconds_beside_show_it():
    truth = CASES["hum, 3 ms, 0.1"].make(302)
    found = found_in(truth)
    assert score(found.time, truth.time)[0] > 0.985  # 0.993 without any hum


def test_hum_that_hides_the_impacts_is_found_in_every_second():
    truth = CASES["hum, 3 ms, 0.2"].make(301)
    found = found_in(truth)
    assert score(found.time, truth.time)[0] >= 0.97
    assert found.settings["hum"]["50 Hz"] == pytest.approx(0.2, rel=0.1)


@pytest.mark.parametrize("how", ["resample", "resample_poly"])
@pytest.mark.parametrize("rate", [5000, 4000, 3000, 2000])
def test_contacts_of_about_one_sample_are_found(rate, how):
    folder = Path(__file__).parents[2] / "data_samples"
    rec = impactsig.read(folder / "loadcell_chaotic_20.1Hz.wav")
    truth = impactsig.Impacts.read_csv(folder / "loadcell_chaotic_20.1Hz.truth.csv")
    x = np.asarray(rec.samples, float).ravel()
    if how == "resample":
        x = signal.resample(x, len(x) * rate // round(rec.rate))
    else:
        x = signal.resample_poly(x, rate, round(rec.rate))
    found = impactsig.detect_impacts(impactsig.Recording(x, float(rate), sensor="force"))
    assert 114 <= len(found) <= 116
    assert score(found.time, truth.time)[0] >= 0.98
    assert found.settings["width"] <= 2.5 / rate


@pytest.mark.parametrize("name", ["bump 0.1 s, 5", "settling, 0.05 s"])
def test_a_bump_hides_no_impacts_beside_it(name):
    # It was taken for a pulse, and what followed within thirty of its widths for its ringing.
    truth = CASES[name].make(301)
    found = found_in(truth)
    assert found.contact_time.max() < 0.036
    assert score(found.time, truth.time)[0] >= 0.99


@pytest.mark.parametrize("swells", [1.0, 2.65])
def test_noise_that_swells_and_fades_is_no_impact(swells):
    rate, rng = 50e3, np.random.default_rng(11)
    time = np.arange(round(8 * rate)) / rate
    noise = (1 + 0.9 * np.sin(2 * np.pi * swells * time)) * rng.standard_normal(len(time))
    found = impactsig.detect_impacts(impactsig.Recording(noise, rate, units="N", sensor="force"))
    assert len(found) <= 16  # 116 and 127 by the noise of whole seconds


def test_pulses_that_fill_half_of_the_time_are_no_swelling_noise():
    rate, rng = 50e3, np.random.default_rng(3)
    time = np.arange(round(10 * rate)) / rate
    pulses = np.sin(2 * np.pi * 22 * time) ** 8 + 0.01 * rng.standard_normal(len(time))
    found = impactsig.detect_impacts(impactsig.Recording(pulses, rate, units="N", sensor="force"))
    assert len(found) > 0.85 * 440  # the others are in spans whose background is all pulse
