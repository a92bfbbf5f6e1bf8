"""Recording: validation, slices, calibration, resampling, pictures."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import InvalidInput, Recording

RATE = 1000.0


def ramp(count=1000, **known):
    return Recording(np.arange(count, dtype=float), RATE, **known)


def test_integers_become_floats_and_floats_stay():
    assert Recording(np.arange(5, dtype=np.int16), 1.0).samples.dtype == np.float64
    single = np.zeros(5, np.float32)
    assert Recording(single, 1.0).samples is single


@pytest.mark.parametrize(
    ("argument", "known"),
    [
        ("rate", {"rate": 0}),
        ("rate", {"rate": float("nan")}),
        ("rate", {"rate": "fast"}),
        ("samples", {"samples": np.zeros((2, 2, 2))}),
        ("samples", {"samples": np.array(["a"])}),
        ("samples", {"samples": np.zeros((5, 0))}),
        ("samples", {"samples": [1j]}),
        ("units", {"units": ("N", "V")}),
        ("channels", {"channels": ("a", "b")}),
        ("sensor", {"sensor": "light"}),
        ("start", {"start": float("inf")}),
    ],
)
def test_bad_arguments_are_named(argument, known):
    with pytest.raises(InvalidInput) as caught:
        Recording(**{"samples": np.zeros(5), "rate": RATE, **known})
    assert caught.value.argument == argument


def test_slices_keep_the_clock_and_share_the_samples():
    rec = ramp(start=10.0)
    part = rec.between(10.1, 10.2)
    assert (len(part), part.start, part.samples[0]) == (100, 10.1, 100.0)
    assert np.shares_memory(part.samples, rec.samples)
    assert part.between(10.15).samples[0] == 150.0
    assert (rec.duration, rec.stop) == (1.0, 11.0)
    np.testing.assert_allclose(part.time[[0, -1]], [10.1, 10.199])
    for start, stop in ((11.0, None), (10.5, 10.5), (10.5, 10.4), (None, 9.0), (np.nan, None)):
        with pytest.raises(InvalidInput):
            rec.between(start, stop)


def test_every_division_at_sample_times_is_exact():
    rec = ramp(997)
    for k in range(1, 997):
        assert len(rec.between(0, k / RATE)) == k
        assert rec.between(k / RATE).samples[0] == k


def test_channels_by_name_index_and_digits():
    rec = Recording(np.arange(6).reshape(3, 2), RATE, units=("N", "V"), channels=("force", "1"))
    assert rec.channel("force").samples.tolist() == [0, 2, 4]
    assert rec.channel(0).unit == "N"
    assert rec.channel("1").unit == "V"  # a name goes before an index
    assert rec.channel("0").channels == ("force",)
    assert rec.unit == "N, V"
    only = rec.channel(0)
    assert only.channel("force") is only
    for which in ("torque", 2, -1, 1.5, True):
        with pytest.raises(InvalidInput, match="channel"):
            rec.channel(which)
    twice = Recording(np.zeros((3, 2)), RATE, channels=("a", "a"))
    with pytest.raises(InvalidInput, match=r"indices \[0, 1\]"):
        twice.channel("a")


def test_calibration():
    rec = ramp(units="V").calibrate(scale=2.0, offset=1.0, unit="N")
    assert rec.samples[3] == 7.0
    assert rec.unit == "N"
    assert ramp(units="V").calibrate().unit == "V"
    for bad in ({"scale": 0}, {"scale": np.inf}, {"offset": np.nan}):
        with pytest.raises(InvalidInput):
            ramp().calibrate(**bad)
    with pytest.raises(InvalidInput, match=r"other than 0\. fit_calibration\(readings, loads\)"):
        ramp().calibrate([0.0, 1.0, 2.0], [0.0, 2.0, 4.0])


def test_resampling_as_in_the_thesis_keeps_tones_and_removes_what_would_alias():
    rate, to = 22_050.0, 8000.0
    t = np.arange(round(rate)) / rate
    for frequency, gain in ((440.0, 1.0), (3000.0, 1.0), (6000.0, 0.0)):
        rec = Recording(np.sin(2 * np.pi * frequency * t), rate).resample(to)
        assert (rec.rate, len(rec)) == (8000.0, 8000)
        expected = gain * np.sin(2 * np.pi * frequency * np.arange(8000) / to)
        np.testing.assert_allclose(rec.samples[400:-400], expected[400:-400], atol=1e-3)
    with pytest.raises(InvalidInput, match="whole numbers"):
        Recording(t, rate).resample(rate * np.pi / 3)


def test_envelope_loses_no_spike():
    x = np.zeros(100_003)
    x[54_321], x[99_999] = 5.0, -3.0
    time, low, high = Recording(x, RATE).envelope(100)
    assert (high.max(), low.min(), len(time)) == (5.0, -3.0, 100)
    at = time[np.argmax(high)]
    assert at <= 54.321 < at + 1.01


def test_text_and_picture_are_safe_and_short():
    rec = ramp(units="<b>", channels="<script>", source="a&b.wav")
    assert repr(rec) == ("Recording(1000 samples; 1000 Hz; 1 s; <b>; <script>; force; a&b.wav)")
    page = rec._repr_html_()
    assert "<script>" not in page
    assert "<svg" in page
    assert Recording(np.full(4, np.nan), 1.0)._repr_html_()
    few = Recording(np.array([0.0, 1.0, np.nan, 0.0, 1.0]), 1.0)._repr_html_()
    assert 'd="M0.0 60.0L72.0 0.0M216.0 60.0L288.0 0.0"' in few  # a line, broken at the gap
    assert Recording(np.empty(0), 1.0)._repr_html_()


@pytest.mark.parametrize(
    ("argument", "known"),
    [
        ("samples", {"samples": [[1.0], [1.0, 2.0]]}),
        ("start", {"start": None}),
        ("start", {"start": "noon"}),
        ("units", {"units": [5]}),
        ("channels", {"channels": [5]}),
    ],
)
def test_what_is_no_number_or_no_text_is_named(argument, known):
    with pytest.raises(InvalidInput, match=argument):
        Recording(**{"samples": np.zeros(5), "rate": RATE, **known})


@pytest.mark.parametrize(
    "call",
    [
        lambda x: x.between("1", 2),
        lambda x: x.calibrate("2"),
        lambda x: x.calibrate(2.0, unit=5),
        lambda x: x.resample(None),
        lambda x: x.envelope(2.5),
    ],
)
def test_methods_refuse_what_is_no_number(call):
    with pytest.raises(InvalidInput):
        call(ramp())


def test_masked_samples_are_missing_ones():
    samples = np.ma.masked_greater(np.array([1.0, 2.0, 99.0]), 50.0)
    np.testing.assert_array_equal(Recording(samples, RATE).samples, [1.0, 2.0, np.nan])
