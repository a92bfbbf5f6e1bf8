"""Real recordings: channels, units, rates and numbers as they stand in the files' own text.

The expected values were read off the files by eye (head, tail, wc), or come from a second reader
of the standard library.
"""

import struct
import wave
from datetime import UTC, datetime

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

KEYS = "audio_counts/keystrokes/"
WAVES = [KEYS + "0.wav", KEYS + "5.wav", KEYS + "A.wav"]
WAVES += ["audio_counts/taps/nail.wav", "audio_onsets/madmom/sample.wav"]
DRUMS = ["Beatles", "Country1", "Hendrix", "Reggae", "Rock", "Zeppelin"]


def all_channels(path):
    return [(c.name, c.unit, c.rate, c.length) for c in io.info(path).channels]


@pytest.mark.parametrize("name", WAVES)
def test_wav_holds_what_the_standard_library_reads(shared_data, name):
    path = shared_data(name)
    with wave.open(str(path)) as file:
        rate, count = file.getframerate(), file.getnchannels()
        raw = np.frombuffer(file.readframes(file.getnframes()), "<i2")
    rec = io.read(path)
    assert (rec.rate, rec.sensor, rec.samples.dtype, count) == (rate, "sound", np.float32, 1)
    np.testing.assert_array_equal(rec.samples * 32768, raw)


@pytest.mark.parametrize("name", DRUMS)
def test_flac_has_the_length_its_stream_info_tells(shared_data, name):
    path = shared_data(f"audio_onsets/mdb/{name}.flac")
    with path.open("rb") as file:
        (packed,) = struct.unpack(">Q", file.read(26)[18:])
    rec = io.read(path)
    assert (rec.rate, len(rec)) == (packed >> 44, packed & ((1 << 36) - 1))
    assert (rec.rate, rec.sensor, rec.samples.ndim) == (44100, "sound", 1)


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [
        ("00", (11.898135, 93.372833), (7.925087, 90.259520)),
        ("05", (-1788.260539, 376.454438), (-1778.889957, 393.134809)),
    ],
)
def test_headerless_lvm(shared_data, name, first, last):
    path = shared_data(f"impact/ds11_lvm/impact_{name}.lvm")
    assert all_channels(path) == [
        ("channel 0", "", 200_000.0, 20_000),
        ("channel 1", "", 200_000.0, 20_000),
        ("channel 2", "", 200_000.0, 1),
    ]
    with pytest.warns(ImpactsigWarning, match="left out: 'channel 2' \\(1 samples"):
        rec = io.read(path)
    assert rec.samples.shape == (20_000, 2)
    np.testing.assert_array_equal(rec.samples[[0, -1]], [first, last])
    assert io.info(path).format == "NI LVM"


def test_lvm_with_slow_channels_beside_fast_ones(shared_data):
    path = shared_data("impact/ds5_lvm/Test_001.lvm")
    fast = [(f"Acceleration_{i}", "m/s^2", 51_200.0, 51_200) for i in range(2)]
    names = ["Untitled", "Untitled 1", "Untitled 2", "Untitled 3"]
    assert all_channels(path) == fast + [(name, "", 1.0, 5) for name in names]
    with pytest.warns(ImpactsigWarning, match="'Untitled' \\(5 samples at 1 Hz\\)"):
        rec = io.read(path)
    assert rec.recorded_at == datetime(2023, 5, 5, 13, 39, 50, 887019)
    np.testing.assert_array_equal(
        rec.samples[[0, 1, -1]], [[2.525674, 1.805781], [1.069960, -3.528127], [2.707638, 3.127662]]
    )
    slow = io.read(path, channel="Untitled 1")
    np.testing.assert_array_equal(slow.samples, [492489, 5187210, 5.13983e7, 4.1644e8, 5.23721e8])
    assert slow.recorded_at == datetime(2023, 5, 5, 13, 39, 51, 963211)


@pytest.mark.parametrize("shock", ["0.0", "0.3"])
def test_lvm_whose_delta_x_is_wrong_goes_by_its_time_channel(shared_data, shock):
    path = shared_data(f"impact/ds7_lvm/impact{shock}_vib0.5.lvm")
    rate = pytest.approx(1 / 0.000605, rel=1e-9)
    longer = [(f"excitation_{name}", "s", rate, 13_216) for name in ("vibration", "shock")]
    names = ["excitation_composite", "accelerometer_base", "accelerometer_board"]
    assert all_channels(path) == longer + [(name, "s", rate, 12_375) for name in names]
    with pytest.warns(ImpactsigWarning) as caught:
        rec = io.read(path)
    told = " ".join(str(w.message) for w in caught)
    assert "Delta_X of 0.000606 s of 'excitation_vibration', 'excitation_shock' contradicts" in told
    assert "Delta_X of 0.000586 s of 'excitation_composite'" in told
    assert "left out: 'excitation_vibration' (13216 samples" in told
    assert rec.channels == tuple(names)


def test_the_shock_commanded_in_lvm_is_where_its_origin_says(shared_data):
    path = shared_data("impact/ds7_lvm/impact0.3_vib0.5.lvm")
    with pytest.warns(ImpactsigWarning, match="contradicts"):
        rec = io.read(path, channel="excitation_shock")
    assert rec.time[np.argmax(rec.samples)] == pytest.approx(3.993, abs=1e-9)


def test_lvm_appended_to_under_one_header(shared_data):
    path = shared_data("formats/lvm_long_single_header_multi_ch.lvm")
    units = {"F": "g", "m_1": "m/s^2", "m_2": "m/s^2"}
    # 16406 lines, 22 of them headers.
    assert all_channels(path) == [(name, unit, 1024.0, 16_384) for name, unit in units.items()]
    with pytest.warns(ImpactsigWarning) as caught:
        rec = io.read(path)
    told = " ".join(str(w.message) for w in caught)
    assert "announces 8192 samples and 16384 are there" in told
    # The step is printed as 0.000977 s.
    assert "between 1023.02 and 1024.07 Hz; 1024 Hz is taken" in told
    np.testing.assert_array_equal(
        rec.samples[[0, -1]], [[0.052530, 0.234571, 0.244440], [0.052073, 0.235689, 0.263686]]
    )
    assert rec.recorded_at == datetime(2013, 8, 30, 9, 18, 17, 725441)


def test_lvm_with_several_time_columns_cut_short(shared_data):
    path = shared_data("formats/lvm_multi_time_column.lvm")
    assert all_channels(path) == [
        ("Voltage", "Volts", 51_200.0, 3),
        ("Acceleration", "g", 51_200.0, 3),
    ]
    with pytest.warns(ImpactsigWarning, match="'Voltage' has 3 of 51200 samples"):
        rec = io.read(path)
    assert rec.truncated is True
    assert io.info(path).truncated is True
    expected = [[-0.035229, 0.532608], [-0.034882, 0.502991], [-0.034191, 0.467541]]
    np.testing.assert_array_equal(rec.samples, expected)


def test_lvm_that_names_no_decimal_sign(shared_data):
    rec = io.read(shared_data("formats/lvm_no_decimal_separator.lvm"))
    assert (rec.rate, rec.channels, rec.units) == (4000.0, ("ax", "ay", "az"), ("g",) * 3)
    assert not rec.truncated
    np.testing.assert_array_equal(rec.samples[0], [-0.008807, -0.028189, 0.021503])
    np.testing.assert_array_equal(rec.samples[3], [0.059248, -0.021172, -0.009433])


def test_lvm_with_decimal_comma(shared_data):
    rec = io.read(shared_data("formats/lvm_short.lvm"))
    assert rec.channels == ("Excitation (Trigger)", "Response (Trigger)")
    assert (rec.rate, rec.units, len(rec)) == (25_600.0, ("Newtons", "m/s^2"), 10)
    np.testing.assert_array_equal(rec.samples[[0, 6, 9]].T[0], [0.914018, 1.046658, 0.680572])
    assert rec.recorded_at == datetime(2013, 2, 19, 9, 51, 40, 727189)


def test_tdms(shared_data):
    path = shared_data("formats/good_tdms_1.tdms")
    places = [("TP", 19, 315), ("TW", 27, 31), ("TW", 41, 31), ("TW", 69, 31)]
    names = [f"{t}_ACC_LAT{at}_{deg:03}deg_{axis}" for t, at, deg in places for axis in "XY"]
    assert all_channels(path) == [
        (f"acceleration/{name}", "g", pytest.approx(30.0, rel=1e-15), 18_000) for name in names
    ]
    rec = io.read(path, channel=names[3])
    assert (rec.channels, rec.samples.dtype) == ((f"acceleration/{names[3]}",), np.float32)
    assert rec.recorded_at == datetime(2020, 4, 9, 22, tzinfo=UTC)
    # Extremes that the instrument stored as properties of the channel.
    assert rec.samples.min() == np.float32(-0.015495349653065205)
    assert rec.samples.max() == np.float32(0.014763252809643745)


def test_tdms_big_endian(shared_data):
    rec = io.read(shared_data("formats/nptdms_big_endian.tdms"))
    assert rec.channels == ("Measured Data/Amplitude sweep", "Measured Data/Phase sweep")
    assert (rec.rate, rec.samples.shape, rec.recorded_at) == (1000.0, (3500, 2), None)
    assert np.abs(rec.samples).max() < 10  # bytes in the wrong order are 1e300 or denormal
    assert np.abs(rec.samples).max() > 0.1


def test_tdms_raw_timestamps(shared_data):
    rec = io.read(shared_data("formats/nptdms_raw_timestamps.tdms"))
    assert (rec.rate, rec.channels) == (1000.0, ("Untitled/Untitled",))
    assert rec.recorded_at == datetime(2024, 1, 24, 1, 48, 43, 68614, tzinfo=UTC)
    np.testing.assert_allclose(rec.samples, np.sin(2 * np.pi * np.arange(128) / 128), atol=1e-15)


def test_tdms_digital_input_loads_the_undecimated_group(shared_data):
    path = shared_data("formats/nptdms_Digital_Input.tdms")
    line, day = "Dev1_port3_line7 - line 0", "07/09/2012 06:58:23 PM - Digital Input - "
    groups = {"All Data": (2000.0, 20_000), "Decimated Data_Level1": (40.0, 400)}
    groups["Decimated Data_Level2"] = (0.8, 8)
    assert all_channels(path) == [(f"{day}{g}/{line}", "", *rl) for g, rl in groups.items()]
    with pytest.warns(ImpactsigWarning, match="400 samples at 40 Hz"):
        rec = io.read(path)
    assert len(rec) == 20_000
    assert set(np.unique(rec.samples)) == {0.0, 1.0}
    with pytest.raises(InvalidInput, match="Several have this name"):
        io.read(path, channel=line)


def test_corrupt_tdms_is_a_typed_error_with_its_cause(shared_data):
    with pytest.raises(UnreadableFile, match="cannot be read as NI TDMS") as caught:
        io.read(shared_data("formats/faulty_tdms_01.tdms"))
    assert isinstance(caught.value.__cause__, ValueError)


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [
        ("a0", 6.280757999999999619, -1.042910999999999921),
        ("a1", 6.109649000000000107, -1.067827999999999999),
    ],
)
def test_text_with_commented_heading(shared_data, name, first, last):
    rec = io.read(shared_data(f"impact/ds5_base_acc/acc_base_{name}.txt"))
    assert (rec.channels, rec.unit, len(rec)) == (("acceleration",), "g", 1439)
    assert rec.rate == pytest.approx(1 / 2.000277970813059e-05, rel=1e-12)
    assert (rec.samples[0], rec.samples[-1]) == (first, last)


def test_csv_with_a_line_of_units(shared_data):
    path = shared_data("impact/ds1_drop_tower_accel_1.csv")
    with pytest.warns(ImpactsigWarning, match="headings name 7 columns, its rows have 6"):
        rec = io.read(path)
    names = ("accel 1", "accel 2", "accel 3", "accel 4", "accel top")
    assert (rec.rate, rec.channels, rec.units) == (1e6, names, ("kg",) * 5)
    assert (rec.samples.shape, rec.start) == ((5000, 5), 0.0)
    assert rec.samples[1, 0] == 6.226428834799969600e-03
    assert rec.samples[-1, 4] == 2.792321715591999931e-01


def test_csv_of_one_column_needs_a_rate(shared_data):
    path = shared_data("force/treadmill_vGRF_300Hz.csv")
    with pytest.raises(InvalidInput, match="one column of numbers; give rate= \\(--rate\\)"):
        io.read(path)
    rec = io.read(path, rate=300, unit="N")
    assert (len(rec), rec.duration, rec.unit, rec.sensor) == (9000, 30.0, "N", "force")
    np.testing.assert_array_equal(rec.samples[[0, 1, -1]], [329.14, 349.13, 1155.4])


@pytest.mark.parametrize("name", ["mdb/Rock_class.txt", "madmom/sample.onsets"])
def test_annotations_are_no_recordings(shared_data, name):
    with pytest.raises(InvalidInput, match="give rate="):
        io.read(shared_data(f"audio_onsets/{name}"))


def test_hits_of_acoustic_emission_are_no_samples(shared_data):
    with pytest.raises(UnreadableFile, match=r"contains hits, not samples.*tradb"):
        io.read(shared_data("impact/vallen_ae/sample.pridb"))
