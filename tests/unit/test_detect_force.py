"""Impacts in force records: synthetic truth, closed forms, slow twins, real recordings."""

from __future__ import annotations

import numpy as np
import pytest

import impactsig
from benchmarks.recordings import add_pulses, load_cell, score
from impactsig.detect.instrument.converter import converter_step
from impactsig.detect.instrument.mains import find_lines, fit_lines
from impactsig.detect.instrument.mains_kernels import take_off
from impactsig.detect.pulses._fit import fit_pulse
from impactsig.detect.pulses._model import PARAMETERS, put_parameters
from impactsig.detect.search._false_alarms import discovery_level
from impactsig.detect.search._noise_kernels import read_noise
from impactsig.detect.search._response_kernels import CREST, GATE, VALLEY, Stretch, find_crests
from impactsig.detect.search.direction import _events
from impactsig.detect.signal.grid import Grid
from impactsig.detect.signal.ladder import ladder
from impactsig.errors import InvalidInput
from impactsig.impacts import CLIPPED, OPEN_END, OPEN_START
from tests import naive_force

RATE = 50_000.0


def recording(samples, rate=RATE, **known):
    return impactsig.Recording(samples, rate, units="V", channels="load cell", **known)


def half_sines(times, contact=300e-6, amplitude=1.0, duration=0.2, offset=0.0, noise=0.0, seed=0):
    x = offset + noise * np.random.default_rng(seed).standard_normal(round(duration * RATE))
    times = np.asarray(times, float)
    add_pulses(
        x,
        RATE,
        times,
        np.full(len(times), contact),
        np.broadcast_to(amplitude, len(times)),
        lambda u: np.sin(np.pi * u),
    )
    return x


# -- the numbers promised ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "seed", [0, 109, *(pytest.param(s, marks=pytest.mark.slow) for s in (1, 2))]
)
def test_load_cell_with_defaults(seed):
    truth = load_cell(seed=seed)
    found = impactsig.detect_impacts(recording(truth.samples))
    f1, timing, pairs = score(found.time, truth.time)
    error = found.contact_time[pairs[:, 0]] - truth.contact_time[pairs[:, 1]]
    assert f1 >= 0.995
    assert timing <= 11e-6
    assert np.sqrt(np.mean(error**2)) <= 28e-6
    assert abs(error.mean()) <= 12e-6


@pytest.mark.parametrize("pulse", ["asymmetric", "flat-topped"])
def test_contact_time_does_not_assume_a_shape(pulse):
    truth = load_cell(pulse=pulse, seed=3)
    found = impactsig.detect_impacts(recording(truth.samples))
    f1, _, pairs = score(found.time, truth.time)
    error = found.contact_time[pairs[:, 0]] - truth.contact_time[pairs[:, 1]]
    assert f1 >= 0.995
    assert np.sqrt(np.mean(error**2)) <= 40e-6
    assert abs(error.mean()) <= 20e-6


def test_peak_and_impulse_under_noise_are_unbiased():
    truth = load_cell(seed=4)
    found = impactsig.detect_impacts(recording(truth.samples))
    _, _, pairs = score(found.time, truth.time)
    amplitude = truth.amplitude[pairs[:, 1]]
    impulse = amplitude * 300e-6 * 2 / np.pi
    assert abs(np.mean(found.peak[pairs[:, 0]] - amplitude)) < 0.03
    assert abs(np.mean(found.impulse[pairs[:, 0]] / impulse - 1)) < 0.03


# -- closed forms, without noise -----------------------------------------------------------------


@pytest.mark.parametrize("contact", [150e-6, 300e-6, 3e-3, 20e-3])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_clean_half_sine(contact, sign):
    times = np.array([0.0512345, 0.1876543, 0.3, 0.55555])
    x = half_sines(times, contact, [1.0, 2.0, 0.5, 1.5], duration=0.7)
    found = impactsig.detect_impacts(recording(sign * x + 7.0))
    amplitude = np.array([1.0, 2.0, 0.5, 1.5])
    assert len(found) == 4
    assert found.settings["polarity"] == ("positive" if sign > 0 else "negative")
    # A twenty-fifth of a sample where a pulse has less than eight of them.
    np.testing.assert_allclose(found.time, times, atol=max(2e-3 * contact, 0.04 / RATE))
    np.testing.assert_allclose(found.contact_time, contact, rtol=5e-3, atol=0.05 / RATE)
    np.testing.assert_allclose(found.peak, amplitude, rtol=5e-3)
    np.testing.assert_allclose(found.impulse, amplitude * contact * 2 / np.pi, rtol=5e-3)
    np.testing.assert_allclose(found.rise_time, contact / 2, rtol=2e-2)
    assert not found.flags.any()


@pytest.mark.parametrize("edge", [0, 1, 3])
@pytest.mark.parametrize("plateau", [20, 100])
def test_steep_sided_pulses(plateau, edge):
    pulse = np.convolve(np.ones(plateau), np.ones(edge + 1) / (edge + 1)) * 10
    x = 0.03 * np.random.default_rng(14).standard_normal(40_000)
    for k in range(500, 39_000, 500):
        x[k : k + len(pulse)] += pulse
    found = impactsig.detect_impacts(recording(x, 1e4))
    assert len(found) == 77
    # The sides lie between the last sample at the foot and the first at the top.
    np.testing.assert_allclose(found.contact_time, (plateau + edge) / 1e4, atol=3.5e-4)
    np.testing.assert_allclose(found.peak, 10, atol=0.15)


def test_contact_time_at_a_level():
    x = half_sines([0.05, 0.1], 1e-3, [1.0, 4.0])
    found = impactsig.detect_impacts(recording(x), contact_level=0.5)
    above = 1e-3 * (1 - 2 / np.pi * np.arcsin(0.5 / np.array([1.0, 4.0])))
    np.testing.assert_allclose(found.contact_time, above, rtol=2e-3)
    np.testing.assert_allclose(found.time, [0.05, 0.1], atol=2e-6)
    assert found.contact_level == 0.5


def test_both_hits_of_a_double_are_reported():
    x = half_sines([0.05, 0.052, 0.1], 300e-6, [1.0, 0.6, 1.0], noise=0.02)
    found = impactsig.detect_impacts(recording(x))
    np.testing.assert_allclose(found.time, [0.05, 0.052, 0.1], atol=2e-5)
    merged = impactsig.detect_impacts(recording(x), merge_within=0.005)
    np.testing.assert_array_equal(merged.time, found.time[[0, 2]])
    assert merged.impulse[0] == pytest.approx(found.impulse[:2].sum())
    assert merged.peak[0] == found.peak[0]
    dead = impactsig.detect_impacts(recording(x), dead_time=0.005)
    np.testing.assert_array_equal(dead.impulse, found.impulse[[0, 2]])


# -- noise ---------------------------------------------------------------------------------------


def test_noise_level_of_gaussian_noise():
    x = half_sines(np.arange(1, 40) * 0.1, noise=0.05, duration=4.0)
    assert impactsig.detect_impacts(recording(x)).noise == pytest.approx(0.05, rel=0.08)


def test_record_that_is_mostly_exactly_zero():
    found = impactsig.detect_impacts(recording(half_sines([0.05, 0.09], amplitude=[1.0, 0.1])))
    assert found.noise == 0.0
    np.testing.assert_allclose(found.time, [0.05, 0.09], atol=1e-6)


def test_short_record_that_is_mostly_pulse():
    x = half_sines([0.004], 20e-3, 1.0, duration=0.029, noise=0.005)
    found = impactsig.detect_impacts(recording(x))
    assert len(found) == 1
    assert found.contact_time[0] == pytest.approx(20e-3, rel=0.1)


def test_drift_and_hum_change_nothing_of_note():
    t = np.arange(round(2 * RATE)) / RATE
    x = half_sines(np.arange(1, 20) * 0.1, noise=0.03, duration=2.0)
    hum = 5 + 2 * t + 0.1 * np.sin(2 * np.pi * 50 * t) + 0.03 * np.sin(2 * np.pi * 150 * t)
    plain, humming = (impactsig.detect_impacts(recording(y)) for y in (x, x + hum))
    assert len(plain) == len(humming) == 19
    np.testing.assert_allclose(humming.time, plain.time, atol=15e-6)
    np.testing.assert_allclose(humming.peak, plain.peak, atol=0.03)


@pytest.mark.parametrize("idle", [0.0, 0.002])
def test_record_that_is_idle_most_of_the_time(idle):
    # One second in ten is recorded with a noise of 0.1, every other of these with impacts.
    rng = np.random.default_rng(12)
    x = idle * rng.standard_normal(60 * 50_000)
    truth = load_cell(duration=1.0, drift=False, seed=13)
    times = []
    for second in range(5, 60, 10):
        part = slice(second * 50_000, (second + 1) * 50_000)
        x[part] = 0.1 * rng.standard_normal(50_000)
        if second % 20 == 5:
            x[part] = truth.samples
            times.append(second + truth.time)
    found = impactsig.detect_impacts(recording(x))
    f1, timing, pairs = score(found.time, np.concatenate(times))
    assert f1 >= 0.985
    assert len(found) - len(pairs) <= 1
    assert timing <= 13e-6


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_holds_no_impact(seed):
    x = np.random.default_rng(seed).standard_normal(500_000)
    found = impactsig.detect_impacts(recording(x))
    assert len(found) == 0
    assert "no pulse reaches the threshold" in found.reason


@pytest.mark.parametrize("x", [np.zeros(1000), np.full(1000, 3.3), np.arange(10.0)])
def test_constant_or_tiny_record_says_why_it_holds_none(x):
    found = impactsig.detect_impacts(recording(x))
    assert len(found) == 0
    assert "constant" in found.reason


# -- flags and gaps ------------------------------------------------------------------------------


def test_pulse_open_at_either_end():
    x = half_sines([0.0, 0.05, 0.1], 2e-3, noise=0.01, duration=0.11)[50:-450]
    found = impactsig.detect_impacts(recording(x))
    assert found.flags.tolist() == [OPEN_START, 0, OPEN_END]
    assert found.time[0] == 0.0
    assert found.contact_time[0] == pytest.approx(1e-3, rel=0.1)
    assert found.time[2] + found.contact_time[2] == pytest.approx(found.stop, abs=2 / RATE)


def test_clipped_peaks_are_flagged():
    x = np.minimum(half_sines([0.03, 0.06, 0.1], 1e-3, [1.0, 3.0, 3.0]), 2.0)
    found = impactsig.detect_impacts(recording(x))
    assert found.flags.tolist() == [0, CLIPPED, CLIPPED]
    assert found.settings["saturation"] == 2.0
    assert any("67% of the impacts are clipped" in note for note in found.notes)
    below = impactsig.detect_impacts(recording(5.0 - x)).settings
    assert below["polarity"] == "negative"
    assert below["saturation"] == 3.0
    assert "saturation" not in impactsig.detect_impacts(recording(x[: round(0.05 * RATE)])).settings


def test_gaps_are_refused_or_split():
    x = half_sines([0.03, 0.06, 0.1, 0.15], noise=0.01)
    x[round(0.08 * RATE) : round(0.09 * RATE)] = np.nan
    with pytest.raises(InvalidInput, match=r"nan at 0\.08 s.*gaps=\"split\""):
        impactsig.detect_impacts(recording(x))
    found = impactsig.detect_impacts(recording(x), gaps="split")
    np.testing.assert_allclose(found.gaps, [[0.08, 0.09]])
    np.testing.assert_allclose(found.intervals(), [0.03, 0.05], atol=3e-5)
    assert len(found) == 4


def test_infinite_samples_are_refused():
    x = half_sines([0.03])
    x[7] = np.inf
    with pytest.raises(InvalidInput, match=r"inf at 0\.00014 s"):
        impactsig.detect_impacts(recording(x))


# -- skips and blocks ----------------------------------------------------------------------------


def equal(a, b):
    for name in ("time", "contact_time", "peak", "impulse", "rise_time", "flags", "gaps"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    assert (a.threshold, a.noise, a.duration) == (b.threshold, b.noise, b.duration)


def test_skipping_quiet_stretches_changes_nothing():
    x = np.zeros(3_000_000)
    times = np.cumsum(np.random.default_rng(5).exponential(1.0, 50))
    burst = half_sines(times[times < 59], noise=0, duration=60.0)
    noise = 0.02 * np.random.default_rng(6).standard_normal(len(x))
    for y in (
        burst,
        burst + noise,
        np.where(np.arange(len(x)) % 700_000 < 400_000, burst, burst + noise),
    ):
        rec = recording(y)
        equal(impactsig.detect_impacts(rec), impactsig.detect_impacts(rec, skip_quiet=False))


@pytest.mark.parametrize("block", [17, 1000, 65_536, 65_537, 250_000])
def test_blocks_give_what_the_whole_gives(block):
    truth = load_cell(duration=8.0, seed=7)
    x = truth.samples if block > 500 else truth.samples[:20_000]
    whole = recording(x)
    blocks = [whole.between(k / RATE, (k + block) / RATE) for k in range(0, len(x), block)]
    equal(impactsig.detect_impacts(whole), impactsig.detect_impacts(blocks))


@pytest.mark.parametrize("scale", [1e-300, 1e-160, 1e90, 1e300])
def test_impacts_do_not_depend_on_the_unit(scale):
    truth = load_cell(duration=5.0)
    plain = impactsig.detect_impacts(recording(truth.samples))
    scaled = impactsig.detect_impacts(recording(scale * truth.samples))
    np.testing.assert_allclose(scaled.time, plain.time, rtol=1e-12)
    np.testing.assert_allclose(scaled.contact_time, plain.contact_time, rtol=1e-6)
    np.testing.assert_allclose(scaled.peak, scale * plain.peak, rtol=1e-9)
    assert scaled.noise == pytest.approx(scale * plain.noise)


def test_float32_is_searched_as_it_is():
    truth = load_cell(duration=5.0)
    a = impactsig.detect_impacts(recording(truth.samples))
    b = impactsig.detect_impacts(recording(truth.samples.astype(np.float32)))
    np.testing.assert_allclose(a.time, b.time, atol=1e-6)


# -- slow twins ----------------------------------------------------------------------------------


def test_crests_are_their_definition():
    # Widths of 1 to 24 samples; the wider ones see means of four samples.
    rng = np.random.default_rng(8)
    x = rng.standard_normal(4096) + 1e3
    for start in (0, 700, 900, 905, 2048, 4090):
        x[start : start + 12] += rng.uniform(3, 9)
    rungs = ladder(24.0)
    least = np.full(len(rungs.width), 1.2)
    out = np.empty((4096, CREST))
    here = Stretch(x, 0, len(x), 0, len(x), rungs, np.full(len(least), 0.5))
    whole = find_crests(here, least, out)
    found = out[:whole].copy()
    assert whole > 200
    for j, unit in enumerate(rungs.unit):
        values = x if rungs.level[j] == 0 else x.reshape(-1, 4 ** rungs.level[j]).mean(axis=1)
        block = 4 ** rungs.level[j]
        y = naive_force.responses(values, unit, rungs.near[j], rungs.far[j], rungs.gain[j], GATE)
        slow = np.array(naive_force.crests(y, 1.2, VALLEY)).reshape(-1, 2)
        fast = found[found[:, 1] == j]
        shift = (unit - 1) / 2 - (unit - 1) // 2
        np.testing.assert_allclose(fast[:, 0], (slow[:, 0] + 0.5 + shift) * block - 0.5)
        np.testing.assert_allclose(fast[:, 2], slow[:, 1], atol=1e-9)
        np.testing.assert_allclose(fast[:, 3], slow[:, 1] / 0.5, atol=1e-9)


def test_a_stretch_turned_over_shows_what_points_downward():
    x = half_sines([0.5, 1.3, 1.99, 2.01, 2.7], duration=3.0, noise=0.02, seed=3)
    x -= half_sines([0.2, 0.9, 2.0], contact=1e-3, duration=3.0)
    grid = Grid(RATE, 0.03 * RATE)
    ways, turned = _events(x, grid, 0.0), _events(-x, grid, 0.0)
    for one, other, count in zip(ways, turned[::-1], (5, 3), strict=True):
        clear, again = one[one[:, 3] > 20], other[other[:, 3] > 20]
        assert len(clear) == count
        np.testing.assert_allclose(clear[:, :3], again[:, :3], rtol=1e-9)


def test_noise_of_white_noise_at_every_width():
    rng = np.random.default_rng(9)
    rungs = ladder(200.0)
    noise = np.array(
        [read(np.zeros(0, np.int64), 2.0 * rng.standard_normal(50_000), rungs) for _ in range(40)]
    )
    span = (rungs.far - rungs.near) * 4.0**rungs.level
    expected = 2.0 * rungs.gain * np.sqrt(1 / rungs.width + 1 / (2 * span))
    # 320 responses tell the median magnitude to 6.5 %, neighbouring ones share samples.
    np.testing.assert_allclose(noise.mean(axis=0), expected, rtol=0.05)


def read(spikes, x, rungs):
    out = np.empty(len(rungs.width))
    room = np.empty(len(x) + 1)
    read_noise(x, spikes, np.zeros(len(x), np.uint8), rungs, 0.0, 0.0, 0.0, room, out)
    return out


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("noise", [0.1, 0.3, 1.0, 5.0])
def test_the_step_of_a_converter_is_read_behind_any_gain(noise, offset):
    rng = np.random.default_rng(3)
    codes = np.round(
        noise * rng.standard_normal(50_000) + half_sines(np.arange(1, 20) * 0.05, 3e-3, 40.0, 1.0)
    )
    assert converter_step(0.00123 * codes + offset) == pytest.approx(0.00123, rel=1e-3)


@pytest.mark.parametrize(
    "x",
    [
        np.random.default_rng(4).standard_normal(50_000),
        np.sin(2 * np.pi * np.arange(50_000) / 1000),
        half_sines([0.05, 0.1]),
        np.arange(50_000.0),
    ],
)
def test_no_step_is_seen_where_there_is_none(x):
    assert converter_step(x) == 0.0 or np.array_equal(np.diff(x), np.ones(len(x) - 1))


def test_mains_lines_are_fitted_to_what_they_are():
    rate, block = 50_000.0, 33
    t = np.arange(49_500) / rate
    x = 0.5 * np.cos(2 * np.pi * 50.03 * t + 1) + 0.1 * np.cos(2 * np.pi * 150.09 * t)
    x += 0.01 * np.random.default_rng(5).standard_normal(len(t))
    sums, counts = x.reshape(-1, block).sum(axis=1), np.full(1500, float(block))
    lines = find_lines(sums, counts, rate / block, rate, 0.01)
    assert lines == (50.0, 150.0)
    rest = x.copy()
    for _ in range(2):  # as the search does
        sums = rest.reshape(-1, block).sum(axis=1)
        fit = fit_lines(sums, counts, block, rate, lines)
        take_off(rest, block, len(sums), np.array(lines) / rate, fit)
    # A frequency that is 0.06 % off bends the phase by 0.094 rad from end to middle.
    assert rest.std() == pytest.approx(0.01, rel=0.15)


def test_pulse_fit_finds_the_posterior_minimum():
    rng = np.random.default_rng(10)
    t = np.arange(30.0)
    worse = 0
    for _ in range(60):
        amplitude, start = np.exp(rng.normal(2.5, 0.5)), rng.uniform(6, 9)
        x = naive_force.pulse_shape(t, amplitude, start, 7.0, 1.0, 6.0, 1.0) + rng.standard_normal(
            30
        )
        first = np.empty(PARAMETERS)
        put_parameters(amplitude, 7.5, 6.5, 1.5, 6.5, first)
        p = first.copy()
        fit_pulse(t, x, np.log(6.0), p)
        cost = np.sum(naive_force.posterior_residuals(p, t, x, np.log(6.0)) ** 2)
        worse += cost > naive_force.fit_pulse(t, x, np.log(6.0), first)[1] + 0.05
    # The cost has kinks where a sample enters the pulse: now and then either stops at another
    # of its minima.
    assert worse <= 6


def test_discovery_level_of_noise_and_of_impacts():
    # Rice's formula for a sliding mean: u^2 Q(u) excursions a width; 0.02 a minute.
    from scipy.stats import norm

    level = discovery_level(np.empty(0), 1e5, 60.0)
    assert 1e5 * level**2 * norm.sf(level) == pytest.approx(0.02, rel=0.01)
    # Among four thousand certain impacts two false ones are borne, so the level falls to 5 sigma.
    assert discovery_level(np.r_[np.full(4000, 50.0), 5.01], 1e5, 60.0) == 5.01
    assert discovery_level(np.r_[np.full(10, 50.0), 5.01], 1e5, 60.0) == level


# -- arguments -----------------------------------------------------------------------------------


def test_threshold_in_the_unit_and_in_sigma():
    x = half_sines([0.03, 0.06, 0.1], amplitude=[1.0, 2.0, 4.0], noise=0.02)
    by_unit = impactsig.detect_impacts(recording(x), threshold=1.5)
    assert by_unit.threshold == 1.5
    np.testing.assert_allclose(by_unit.time, [0.06, 0.1], atol=1e-5)
    by_sigma = impactsig.detect_impacts(recording(x), threshold="9 sigma")
    assert by_sigma.threshold == pytest.approx(9 * by_sigma.settings["response_noise"])


def test_a_multiple_of_no_noise_is_refused():
    x = half_sines([0.03, 0.06, 0.1], amplitude=[1.0, 2.0, 4.0])
    for offset in (0.0, 0.1):
        with pytest.raises(InvalidInput, match="no noise to take a multiple of") as caught:
            impactsig.detect_impacts(recording(x + offset), threshold="6 sigma")
        assert (caught.value.argument, caught.value.value) == ("threshold", "6 sigma")
    assert len(impactsig.detect_impacts(recording(x), threshold=0.5)) == 3
    # Where it is silent for some seconds only, there is noise to take a multiple of.
    quiet = half_sines([0.5, 1.5, 2.5], duration=4.0)
    quiet[50_000:100_000] += 0.01 * np.random.default_rng(1).standard_normal(50_000)
    assert len(impactsig.detect_impacts(recording(quiet), threshold="6 sigma")) == 3


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("threshold", "high"),
        ("threshold", -1.0),
        ("threshold", float("nan")),
        ("polarity", "up"),
        ("contact_level", -1.0),
        ("merge_within", float("inf")),
        ("dead_time", -0.1),
        ("gaps", "fill"),
        ("sensor", "light"),
        ("channel", "nowhere"),
    ],
)
def test_bad_arguments_are_named(argument, value):
    with pytest.raises(InvalidInput) as caught:
        impactsig.detect_impacts(recording(half_sines([0.1])), **{argument: value})
    assert caught.value.argument == argument


def test_several_channels_need_a_choice():
    x = half_sines([0.1], noise=0.01)
    rec = impactsig.Recording(
        np.column_stack((x, 0 * x)), RATE, units=("N", "V"), channels=("F", "aux")
    )
    with pytest.raises(InvalidInput, match="0: 'F', 1: 'aux'"):
        impactsig.detect_impacts(rec)
    found = impactsig.detect_impacts(rec, channel="F")
    assert (len(found), found.unit, found.settings["channel"]) == (1, "N", "F")


def test_sources_that_cannot_be_searched():
    rec = recording(half_sines([0.1], noise=0.01))
    for source in (3.0, (block for block in [rec]), [1, 2], []):
        with pytest.raises(InvalidInput, match="source"):
            impactsig.detect_impacts(source)
    overlapping = [rec.between(0, 0.1), rec.between(0.05, 0.2)]
    with pytest.raises(InvalidInput, match="overlap"):
        impactsig.detect_impacts(overlapping)
    with pytest.raises(InvalidInput, match="one rate"):
        impactsig.detect_impacts([rec.between(0, 0.1), recording(rec.samples, 1e3, start=0.1)])


# -- real recordings -----------------------------------------------------------------------------

RINGING = {"merge_within": 0.1}  # a shock on a structure that rings on


@pytest.mark.parametrize(
    ("file", "channel"),
    [
        ("impact/ds5_base_acc/acc_base_a0.txt", None),
        ("impact/ds5_base_acc/acc_base_a1.txt", None),
        ("impact/ds5_base_acc/acc_base_a10.txt", None),
        ("impact/ds11_lvm/impact_05.lvm", 0),
        ("impact/ds11_lvm/impact_05.lvm", 1),
        ("impact/ds5_lvm/Test_001.lvm", "Acceleration_0"),
        ("impact/ds5_lvm/Test_001.lvm", "Acceleration_1"),
        ("impact/ds7_lvm/impact0.3_vib0.5.lvm", "excitation_shock"),
        ("impact/ds1_drop_tower_accel_1.csv", "accel 1"),
    ],
)
@pytest.mark.filterwarnings("ignore::impactsig.ImpactsigWarning")
def test_one_impact_in_each_single_impact_file(shared_data, file, channel):
    found = impactsig.detect_impacts(
        impactsig.read(shared_data(file), channel=channel, sensor="force"), **RINGING
    )
    assert len(found) == 1


@pytest.mark.parametrize(
    ("file", "channel"),
    [
        ("impact/ds11_lvm/impact_00.lvm", 0),
        ("impact/ds11_lvm/impact_00.lvm", 1),
        *(
            ("impact/ds7_lvm/impact0.0_vib0.5.lvm", name)
            for name in (
                "excitation_shock",
                "excitation_composite",
                "accelerometer_base",
                "accelerometer_board",
            )
        ),
    ],
)
@pytest.mark.filterwarnings("ignore::impactsig.ImpactsigWarning")
def test_nothing_in_the_negative_controls(shared_data, file, channel):
    rec = impactsig.read(shared_data(file), channel=channel)
    for settings in ({}, RINGING):
        assert len(impactsig.detect_impacts(rec, **settings)) == 0


@pytest.mark.filterwarnings("ignore::impactsig.ImpactsigWarning")
def test_commanded_shock_is_found_at_its_time(shared_data):
    rec = impactsig.read(
        shared_data("impact/ds7_lvm/impact0.3_vib0.5.lvm"), channel="excitation_shock"
    )
    found = impactsig.detect_impacts(rec)
    assert found.time[0] + found.rise_time[0] == pytest.approx(3.993, abs=0.02)
