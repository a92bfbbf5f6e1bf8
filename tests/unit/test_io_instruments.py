"""Text as instruments write it: rate, names and units stand above or beside the data."""

import warnings
from datetime import datetime, timedelta

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

ROWS = 40
F, A = np.round(np.sin(np.arange(2 * ROWS) / 3), 5).reshape(2, ROWS)
RATE, START = 5e4, -0.002
T = START + np.arange(ROWS) / RATE


def rows(*columns, form="{:.9g}", delimiter=","):
    return (
        "\n".join(delimiter.join(form.format(x) for x in row) for row in zip(*columns, strict=True))
        + "\n"
    )


COUNT = np.arange(ROWS)
FILES = {
    # Rigol: what the columns beyond the data hold stands below their names
    "DS1000Z": "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-2.000000e-03,2.000000e-05\n"
    + rows(COUNT, F, A).replace("\n", ",\n"),
    "DS1000Z, no X": "CH1,CH2,Start,Increment,\nVolt,Volt,-2.00000e-03,2.00000e-05\n"
    + rows(F, A).replace("\n", ",\n"),
    "DS4000": "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-2.400000e-03,2.000000e-05\n"
    + rows(COUNT + 20, F, A).replace("\n", ",\n"),
    "MSO5000": "CH1V,CH2V,t0 =-0.002, tInc = 2e-05,\n" + rows(F, A).replace("\n", ",,\n"),
    # Keysight: channels by number
    "Keysight": "x-axis,1,2\nsecond,Volt,Volt\n" + rows(T, F, A),
    # Tektronix MSO, Siglent, LeCroy, PicoScope: settings above a column of times
    "MSO": "Model,MSO54\nHorizontal Units,s\nSample Interval,2e-05\nRecord Length,40\n\nLabels,,\n"
    "TIME,CH1,CH2\n" + rows(T, F, A),
    "Siglent": "Record Length,Analog:40\nSample Interval,Analog:0.00002\nVertical Units,CH1:V,CH2:V"
    "\nHorizontal Units,s\nModel Number,SDS1104X\nSource,CH1,CH2\nSecond,Volt,Volt\n"
    + rows(T, F, A),
    "LeCroy": "LECROYWS424,12345,Waveform\nSegments,1,SegmentSize,40\nSegment,TrigTime,"
    "TimeSinceSegment1\n#1,27-Mar-2012 10:15:23,0\nTime,Ampl,Ampl 2\n" + rows(T, F, A),
    "PicoScope": "Time,Channel A,Channel B\n(ms),(mV),(mV)\n\n" + rows(1e3 * T, F, A),
    # Yokogawa: no column of times
    "Yokogawa": '"Header Size",16\n"Model Name","DL850"\n"TraceName","load","floor"\n'
    '"BlockSize",40,40\n"VUnit","N","g"\n"HResolution",2.0e-05,2.0e-05\n"HUnit","s","s"\n\n'
    + rows(F, A),
    # LabChart, catman
    "LabChart": "Interval=\t0.02 ms\nExcelDateTime=\t4.3e+04\t11/2/2017 10:15\n"
    "TimeFormat=\tStartOfBlock\nChannelTitle=\tload\tfloor\nRange=\t10.000 V\t5.000 V\n"
    "UnitName=\tN\tg\n" + rows(T, F, A, delimiter="\t"),
    "catman": "Time  1 - default sample rate [s]\tload [N]\tfloor [g]\n"
    + rows(T, F, A, delimiter="\t"),
    # a logger's words, in a sentence, a comment or another language
    "words": "Sampling rate: 50 kHz\nOperator: Meier\nload [N];floor [g]\n"
    + rows(F, A, delimiter=";"),
    "comment": "# fs = 50000\n# load, floor\n" + rows(F, A),
    "spoken": "Sample Rate 50000 S/s\nload,floor\n" + rows(F, A),
    "Abtastrate": "Abtastrate [kHz];50,0\nload;floor\n"
    + rows(F, A, delimiter=";").replace(".", ","),
    "micros": "micros,load,floor\n" + rows(1e6 * T, F, A),
    # Further oscilloscopes and loggers, as their files look
    "TBS1000C": "Model,TBS1072C\nSample Interval,2e-05,,2e-05,\nVertical Units,V,,V,\nLabel,,,,\n"
    "TIME,CH1,TIME,CH2\n" + rows(T, F, T, A),
    "DPO4000": "Model,DPO4054\nSample Interval,2e-05\nVertical Units,V,N\n,,\nLabel,,load\n"
    "TIME,CH1,CH2\n" + rows(T, F, A),
    "RTB2000": "in s,load in V,floor in V\n" + rows(T, F, A),
    "DL850": '"Model Name","DL850"\n"TraceName","load","floor"\n"VUnit","N","g"\n'
    '"HResolution",2.0E-05,2.0E-05\n"HOffset",-2.0E-03,-2.0E-03\n"HUnit","s","s"\n\n' + rows(F, A),
    "Fluke": "Title,Trace A\nX Unit,s\nX at 0%,-2e-3\nX Resolution,2.0E-05\nY Unit,V\n\n"
    + rows(T, F, A),
    "LabChart, ranges": "Interval=\t2e-05 s\nChannelTitle=\tload\tfloor\nUnitName=\tN\tg\n"
    "TopValue=\t1\t1\nBottomValue=\t-1\t-1\n" + rows(T, F, A, delimiter="\t"),
    "catman, rates": "HBM_CATMAN\nZeit  1 - Standardmessrate\tload\tfloor\ns\tN\tg\n"
    "SR_FB:50000 Hz\tSR_FB:50000 Hz\tSR_FB:50000 Hz\n26.02.2020 10:12:13\t\t\n"
    + rows(T, F, A, delimiter="\t"),
    "BenchVue": "Scan Number,Time,load (V),floor (V)\n" + rows(COUNT + 1, T, F, A),
    "Vernier": "Run 1: Time (s),load,floor\n" + rows(T, F, A),
    "PASCO": '"Time (s) Run 1","load","floor"\n' + rows(T, F, A),
    "AndroSensor": "load (N);floor (N);Time since start in ms ;YYYY-MO-DD HH-MI-SS_SSS\n"
    + "".join(
        f"{f};{a};{1e3 * t:.9g};13:46:55:{n}\n" for f, a, t, n in zip(F, A, T, COUNT, strict=True)
    ),
    "mSec": "load floor mSec\n" + rows(F, A, 1e3 * T, delimiter=" "),
    "elapsed_us": "elapsed_us,load,floor\n" + rows(1e6 * T, F, A),
    "DS1052E": ",load,floor\nTime,Volt,Volt\n" + rows(T, F, A),
    "Infiniium": "Type:,Raw\nXInc:,2.0E-05\nXOrg:,-2.0E-03\n\nXData:,load:,floor:\n"
    + rows(T, F, A),
    "WaveJet": "Trigger Address,100\nDelta(second),2.0e-05\nch1 V,ch2 V\n" + rows(F, A),
    "UNI-T": "CH1,CH2\nSample Interval(s):,2.0E-05\n" + rows(F, A),
    "units alone": "Title: x\n\ns\tN\tm/s²\n" + rows(T, F, A, delimiter="\t"),
    "Audacity": "Sample Rate: 50000 Hz. Sample values on linear scale. 2 channels (stereo).\n\n"
    "load\tfloor\n" + rows(F, A, delimiter="\t"),
    "DIN 1313": "Zeit/s;load/N;floor/N\n" + rows(T, F, A, delimiter=";").replace(".", ","),
    "Biopac": "msec,load,floor,\n,40,40,\n" + rows(1e3 * T, F, A).replace("\n", ",\n"),
    "Axon": '"YTop=10,10"\n"Time (ms)"\t"load (mV)"\t"floor (pA)"\n'
    + rows(1e3 * T, F, A, delimiter="\t"),
    "LabChart, remarks": "Interval=\t2e-05 s\nChannelTitle=\tload\tfloor\n"
    + rows(T, F, A, delimiter="\t").replace("\n", "\t#* knock\n", 9).replace("\t#* knock", "", 8),
    "OWON, measured": "Frequency,50.00Hz\nPeriod,20.00ms\nPK-PK,2.00V\nTime interval,20.00uS\n\n"
    "index,load(N),floor(g)\n" + rows(COUNT, F, A),
    "Hantek": "#CHANNEL:CH1\n#CLOCK=20.0uS\n#SIZE=40\n#UNITS:V\n\n" + rows(F, A),
    "DASYLab": "DASYLab - V 13.00.00\nBlock length: 100\nNumber of channels: 2\n"
    "Measurement time[s];load [N];floor [g]\n" + rows(T, F, A, delimiter=";"),
    "any language": "时间(s),load,floor\n" + rows(T, F, A),
    "PULSE": "HeaderSize:\t6\nX-Axis unit:\ts\nX-Axis delta:\t2e-05\nY-Axis unit:\tN\nData:\n"
    + rows(COUNT + 1, T, F, A, delimiter="\t"),
    "prose": "X axis : Time, s\nSampling frequency = 50000 Hz\nNumber of values = 40\n\n"
    + rows(T, F, A, delimiter="   "),
    "LabVIEW": "channel names:\nload\tfloor\nstart times:\n04/05/2023 11:22\t04/05/2023 11:22\n"
    "dt:\n0.000020\t0.000020\ndata:\n" + rows(F, A, delimiter="\t"),
    "quoted": '"Time","load","floor"\n'
    + "".join(
        ",".join(f'"{x:.9g}"'.replace(".", ",") for x in row) + "\n"
        for row in zip(T, F, A, strict=True)
    ),
}
NAMED = {"words", "comment", "spoken", "Abtastrate", "Yokogawa", "LabChart", "catman", "micros"}
NAMED |= {"RTB2000", "DL850", "LabChart, ranges", "catman, rates", "BenchVue", "Vernier", "PASCO"}
NAMED |= {"AndroSensor", "mSec", "elapsed_us", "OWON, measured", "DASYLab", "any language"}
NAMED |= {"DS1052E", "Infiniium", "Audacity", "DIN 1313", "Biopac", "LabChart, remarks", "quoted"}
TIMED = {
    "WaveJet",
    "UNI-T",
    "OWON, measured",
    "Hantek",
    "LabVIEW",
    "Audacity",
    "Yokogawa",
    "words",
    "comment",
    "spoken",
    "Abtastrate",
}  # from 0: they give no start


@pytest.mark.parametrize("name", FILES)
def test_each_instrument(tmp_path, name):
    path = tmp_path / "a.csv"
    path.write_text(FILES[name], encoding="utf-8")
    found = io.read(path)
    np.testing.assert_array_equal(found.samples, np.column_stack([F, A]))
    assert found.rate == pytest.approx(RATE, rel=1e-9)
    assert found.start == pytest.approx(0 if name in TIMED else START, abs=1e-9)
    assert found.channels == ("load", "floor") or name not in NAMED


def test_names_and_units_of_the_header(tmp_path):
    path = tmp_path / "a.txt"
    for name, channels, units in [
        ("DS1000Z", ("CH1", "CH2"), ("Volt", "Volt")),
        ("DS1000Z, no X", ("CH1", "CH2"), ("Volt", "Volt")),
        ("Keysight", ("1", "2"), ("Volt", "Volt")),
        ("Siglent", ("CH1", "CH2"), ("V", "V")),
        ("Yokogawa", ("load", "floor"), ("N", "g")),
        ("LabChart", ("load", "floor"), ("N", "g")),
        ("Abtastrate", ("load", "floor"), ("", "")),
        ("DPO4000", ("CH1", "CH2"), ("V", "N")),
        ("RTB2000", ("load", "floor"), ("V", "V")),
        ("catman, rates", ("load", "floor"), ("N", "g")),
        ("MSO5000", ("CH1", "CH2"), ("V", "V")),
        ("WaveJet", ("ch1", "ch2"), ("V", "V")),
        ("UNI-T", ("CH1", "CH2"), ("", "")),
        ("units alone", ("channel 0", "channel 1"), ("N", "m/s²")),
        ("DIN 1313", ("load", "floor"), ("N", "N")),
        ("Axon", ("load", "floor"), ("mV", "pA")),
    ]:
        path.write_text(FILES[name], encoding="utf-8")
        found = io.read(path)
        assert (found.channels, found.units) == (channels, units), name


@pytest.mark.parametrize("order", ["utf-16-le", "utf-16-be"])
def test_utf_16_without_its_mark(tmp_path, order):
    path = tmp_path / "a.txt"
    text = "Time (s)\tload (N)\r\n" + rows(T, F, delimiter="\t").replace("\n", "\r\n")
    path.write_bytes(text.encode(order))
    found = io.read(path)
    np.testing.assert_array_equal(found.samples, F)
    assert (found.rate, found.channels, found.units) == (RATE, ("load",), ("N",))


def test_small_binary_numbers_are_no_text(tmp_path):
    path = tmp_path / "a.dat"
    path.write_bytes(np.arange(300, dtype="<i2").tobytes())
    with pytest.raises(UnreadableFile, match="its content is not"):
        io.read(path)


def test_settings_beside_the_samples(tmp_path):
    """Tektronix TDS writes its settings into the first columns of the first rows."""
    beside = ["Record Length,40,,", "Sample Interval,2.0e-05,,", "Trigger Point,100,,"]
    beside += ["Source,CH1,,", "Vertical Units,V,,", "Horizontal Units,s,,"]
    times, load = np.tile(T, 1), F
    lines = [
        (beside[i] if i < len(beside) else ",,,") + f"{t:.12f},{x:.5f},"
        for i, (t, x) in enumerate(zip(times, load, strict=True))
    ]
    path = tmp_path / "F0000CH1.CSV"
    path.write_text("\n".join(lines) + "\n")
    found = io.read(path)
    np.testing.assert_array_equal(found.samples, F)
    assert (found.rate, found.start) == (RATE, START)
    assert (found.channels, found.units) == (("CH1",), ("V",))


def test_a_header_that_its_times_contradict_is_named(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("Sampling rate: 10000 Hz\ntime,x\n" + rows(T, F))
    with pytest.warns(ImpactsigWarning, match=r"Sampling rate: 10000 Hz.*50000 Hz, which is taken"):
        assert io.read(path).rate == RATE
    path.write_text("Sampling rate: 10 kHz\nSample interval: 2e-5 s\nx\n" + rows(F))
    with pytest.raises(InvalidInput, match="contradicts itself"):
        io.read(path)
    assert io.read(path, rate=5).rate == 5


def test_words_that_are_no_rate_give_none(tmp_path):
    path = tmp_path / "a.csv"
    for line in [
        "Forcing frequency: 20 Hz",
        "Frequency: 50 Hz\nPeriod: 20 ms",
        "rate 5",
        "Gain: 1000",
        "Interval: 3",
        "fs =",
    ]:
        path.write_text(f"{line}\nx\n" + rows(F))
        with pytest.raises(InvalidInput, match="give rate="):
            io.read(path)


@pytest.mark.parametrize(
    ("form", "worst"), [("{:.2e}", 2e-4), ("{:.3f}", 2e-4), ("{:#.3g}", 2e-4), ("{:.6f}", 1e-6)]
)
@pytest.mark.parametrize("rate", [2000.0, 1024.0, 1739.13])
@pytest.mark.parametrize("start", [-2.0, -0.1, 0.0])
def test_the_rate_of_rounded_times(tmp_path, form, worst, rate, start):
    """All times together fix the rate far better than the first and the last."""
    times = start + np.arange(4000) / rate
    path = tmp_path / "a.csv"
    path.write_text("time,x\n" + "".join(f"{form.format(t)},{t:.3f}\n" for t in times))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImpactsigWarning)
        found = io.read(path).rate
    assert found == pytest.approx(rate, rel=worst)
    assert found == rate or rate != 2000


def test_a_gap_among_rounded_times_is_found(tmp_path):
    times = np.delete(-0.5 + np.arange(4000) / 2000, slice(1500, 1520))
    path = tmp_path / "a.csv"
    path.write_text("time,x\n" + rows(times, times, form="{:.2e}"))
    with pytest.raises(InvalidInput, match="not uniform"):
        io.read(path)


@pytest.mark.parametrize(
    ("form", "date"),
    [
        ("{:%d.%m.%Y %H:%M:%S.%f}", True),
        ("{:%d-%b-%Y %H:%M:%S.%f}", True),
        ("{:%Y-%m-%d %H:%M:%S.%f +0200}", True),
        ("{:%d/%m/%Y %H:%M:%S,%f}", False),
        ("{:%m/%d/%Y %H:%M:%S.%f}", False),
        ("{:%m/%d/%Y %I:%M:%S.%f %p}", False),
        ("{:%d.%m.%Y %H:%M:%S:%f}", True),
    ],
)
def test_dates_as_loggers_print_them(tmp_path, form, date):
    """Over midnight; which of two numbers is the month need not be clear."""
    begin = datetime(2024, 5, 4, 23, 59, 59, 990_000)
    moments = [begin + timedelta(microseconds=2000 * i) for i in range(ROWS)]
    path = tmp_path / "a.csv"
    path.write_text(
        "Date/Time;load;floor\n"
        + "".join(f"{form.format(m)};{f};{a}\n" for m, f, a in zip(moments, F, A, strict=True))
    )
    found = io.read(path)
    np.testing.assert_array_equal(found.samples, np.column_stack([F, A]))
    assert found.rate == pytest.approx(500, rel=1e-9)
    when = found.recorded_at
    assert (when and when.replace(tzinfo=None)) == (begin if date else None)


@pytest.mark.parametrize("digits", [0, 3, 6, 9])
def test_times_since_1970_in_their_own_unit(tmp_path, digits):
    """Sensor loggers write nanoseconds since 1970 into a column called time."""
    times = 1_700_000_000 * 10**digits + 4 * 10 ** max(digits - 3, 0) * COUNT
    path = tmp_path / "a.csv"
    path.write_text("time,load\n" + "".join(f"{t},{f}\n" for t, f in zip(times, F, strict=True)))
    assert io.read(path).rate == pytest.approx(250 if digits else 0.25, rel=1e-5)


def test_stamps_of_a_serial_monitor_are_refused(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("".join(f"14:22:01.{10 * n:03d} -> {n}\n" for n in range(90)))
    with pytest.raises(UnreadableFile, match=r"switch these off, and print micros\(\)"):
        io.read(path)


def uneven(tmp_path, text="time_ms,x,y\n", times=None):
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.integers(8, 13, 400)) if times is None else times
    wave = np.sin(2 * np.pi * 3 * times / 1e3)
    path = tmp_path / "phone.csv"
    path.write_text(text + rows(times, wave, 2 * wave))
    return path, times / 1e3, wave


def test_uneven_times_are_interpolated_where_that_is_asked_for(tmp_path):
    path, times, _ = uneven(tmp_path)
    with pytest.raises(InvalidInput, match=r"or resample= \(--resample\)"):
        io.read(path)
    with pytest.warns(ImpactsigWarning, match=r"0\.01 s \(median\) scatter by 0\.0014.* to 100 Hz"):
        found = io.read(path, resample=100)
    assert (found.rate, found.start, found.channels) == (100.0, times[0], ("x", "y"))
    assert found.stop <= times[-1] + 0.01 < found.stop + 0.01
    at = found.start + np.arange(len(found)) / 100
    truth = np.sin(2 * np.pi * 3 * at)
    # A cubic through samples 10 ms apart of a wave of 333 ms; worst at its crests.
    np.testing.assert_allclose(found.samples, np.column_stack([truth, 2 * truth]), atol=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImpactsigWarning)
        part = io.read(path, "y", 1.0, 2.0, resample=100)
        whole = io.read_blocks(path, 0.7, resample=100)
        np.testing.assert_array_equal(np.concatenate([b.samples for b in whole]), found.samples)
    np.testing.assert_array_equal(part.samples, found.samples[(at >= 1) & (at < 2), 1])


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ({"resample": -1}, "resample: got -1; required: a positive number"),
        ({"resample": 100, "rate": 100}, "Give one of the two"),
        ({"resample": 1e12}, "a rate that makes 2 to"),
        ({"resample": 0.01}, "a rate that makes 2 to"),
    ],
)
def test_what_cannot_be_resampled_says_so(tmp_path, given, match):
    path, _, _ = uneven(tmp_path)
    with pytest.raises(InvalidInput, match=match):
        io.read(path, **given)


def test_even_times_and_those_that_go_back_are_not_resampled(tmp_path):
    even, _, _ = uneven(tmp_path, times=10.0 * np.arange(100))
    with pytest.raises(InvalidInput, match=r"a file with uneven times; .* has 100 Hz"):
        io.read(even, resample=50)
    back, _, _ = uneven(tmp_path, times=np.array([0.0, 11, 20, 12, 30, 44]))
    with pytest.raises(InvalidInput, match=r"goes from 0\.02 s back to 0\.012 s"):
        io.read(back, resample=50)


def test_gaps_and_times_that_stand_twice(tmp_path):
    times = np.delete(10.0 * np.arange(200), slice(50, 90))
    times[10] = times[9]
    path, _, _ = uneven(tmp_path, times=times)
    with pytest.warns(ImpactsigWarning, match=r"longest is 0\.41 s after t = 0\.49 s.* 1 gaps"):
        assert np.isfinite(io.read(path, resample=100).samples).all()


def test_the_finest_of_several_columns_of_times(tmp_path):
    times = np.cumsum(np.random.default_rng(1).integers(8, 13, 300))
    lines = [f"2022-05-19 23:33:{t // 1000:02d},{t},{t % 7}" for t in times]
    path = tmp_path / "phone.csv"
    path.write_text("Timestamp,Milliseconds,x\n" + "\n".join(lines))
    with pytest.warns(ImpactsigWarning, match="uneven"):
        found = io.read(path, resample=100)
    assert found.start == times[0] / 1e3
    assert (found.channels, found.recorded_at.year) == (("x",), 2022)


SETTINGS = (
    "Source:Ch1:\r\nNumberOfAcquisitions:1:\r\nResolution:1e-05:\r\nRecordLength:30:\r\n"
    "XStart:-0.0001:\r\nXStop:0.0002:\r\nHardwareXStart:-0.002:\r\nSignalResolution:2e-05:\r\n"
    "SignalHardwareRecordLength:40:\r\n"
)


def test_settings_and_samples_in_two_files(tmp_path):
    """Rohde & Schwarz: either file is opened with the other."""
    samples, settings = tmp_path / "run.Wfm.csv", tmp_path / "run.csv"
    samples.write_text(rows(F))
    with pytest.raises(InvalidInput, match=r"stands in run\.csv.*put that beside it; give rate="):
        io.read(samples)
    settings.write_text(SETTINGS)
    for path in (samples, settings):
        found = io.read(path)
        np.testing.assert_array_equal(found.samples, F)
        assert (found.rate, found.start, found.channels) == (RATE, START, ("Ch1",))
        told = io.info(path)
        assert (told.path, told.bytes) == (str(samples), samples.stat().st_size)
    settings.write_text(SETTINGS.replace("Length:40", "Length:39"))
    with pytest.raises(UnreadableFile, match="time stamps off"):
        io.read(samples)
    settings.write_text(SETTINGS.replace("Acquisitions:1", "Acquisitions:4"))
    with pytest.raises(UnreadableFile, match="4 acquisitions one after the other"):
        io.read(settings)
    settings.write_text(SETTINGS)
    samples.unlink()
    with pytest.raises(UnreadableFile, match=r"Put run\.Wfm\.csv, which"):
        io.read(settings)


@pytest.mark.parametrize("text", ["time,force\n", "hello\nworld\n"])
def test_text_without_numbers_is_called_so(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(UnreadableFile, match=r"contains no numbers.*Expected columns of numbers"):
        io.read(path)
