"""NI LVM: layouts, time bases, segments; the real files are in test_io_shared.py."""

from datetime import datetime

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

END = "***End_of_Header***"


def header(x_columns="No", separator="Tab", decimal="."):
    rows = ["LabVIEW Measurement", "Writer_Version\t2", f"Separator\t{separator}"]
    rows += [f"Decimal_Separator\t{decimal}", "Multi_Headings\tYes", f"X_Columns\t{x_columns}"]
    rows += ["Time_Pref\tAbsolute", "Date\t2024/02/29", "Time\t12:00:00.5", END, ""]
    text = "\n".join(rows) + "\n"
    return text.replace("\t", ",") if separator == "Comma" else text


def segment(data, names=("F",), samples=None, delta="0.001", x0="0.0", time="12:00:01", wide=0):
    """A segment of channels in every column but each `wide`-th, which holds X values."""
    width = len(data[0].split("\t"))
    places = [i for i in range(1, width) if not wide or i % wide]

    def row(key, values):
        cells = dict(zip(places, values, strict=False))
        return "\t".join([key] + [cells.get(i, "") for i in range(1, width)]) + "\t"

    count = len(names)
    samples = samples or [len(data)] * count
    deltas = [delta] * count if isinstance(delta, str) else delta
    heading = ["X_Value"] + [
        dict(zip(places, names, strict=False)).get(i, "X_Value") for i in range(1, width)
    ]
    lines = [f"Channels\t{count}\t", row("Samples", map(str, samples))]
    lines += [row("Date", ["2024/02/29"] * count), row("Time", [time] * count)]
    lines += [row("Y_Unit_Label", ["N"] * count), row("X_Dimension", ["Time"] * count)]
    lines += [row("X0", [x0] * count), row("Delta_X", deltas), END + "\t"]
    return "\n".join([*lines, "\t".join([*heading, "Comment"]), *data]) + "\n"


def write(tmp_path, text):
    path = tmp_path / "a.lvm"
    path.write_text(text, encoding="latin-1")
    return path


@pytest.mark.parametrize("separator", ["Tab", "Comma"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_without_x_column(tmp_path, separator, ending):
    text = segment(["\t1.5\t-2", "\t2.5\t-3"], ["F", "G"], delta="2.0E-5", x0="0.125")
    text = text.replace("\t", ",") if separator == "Comma" else text
    path = tmp_path / "a.lvm"
    path.write_bytes((header(separator=separator) + text).replace("\n", ending).encode())
    rec = io.read(path)
    assert (rec.rate, rec.start, rec.channels, rec.unit) == (50_000.0, 0.125, ("F", "G"), "N")
    assert rec.recorded_at == datetime(2024, 2, 29, 12, 0, 1)
    np.testing.assert_array_equal(rec.samples, [[1.5, -2], [2.5, -3]])


def test_comments_at_the_end_of_some_rows(tmp_path):
    data = ["\t1.0", "\t2.0\tthe belt slipped by 1,5 mm", "\t3.0"]
    rec = io.read(write(tmp_path, header() + segment(data)))
    np.testing.assert_array_equal(rec.samples, [1, 2, 3])


def test_one_x_column_holds_for_channels_of_its_delta_x_only(tmp_path):
    data = [f"{i * 0.002:.6f}\t{i}\t{i if i < 2 else ''}" for i in range(6)]
    text = header("One") + segment(data, ["F", "T"], [6, 2], delta=["0.002", "0.5"])
    found = io.info(write(tmp_path, text)).channels
    assert [(c.rate, c.length) for c in found] == [(500.0, 6), (2.0, 2)]


def test_the_x_column_is_taken_where_delta_x_contradicts_it(tmp_path):
    data = [f"{1 + i * 0.002:.6f}\t{i}" for i in range(6)]
    path = write(tmp_path, header("One") + segment(data, delta="1.000000"))
    with pytest.warns(ImpactsigWarning, match="Delta_X of 1.000000 s of 'F' contradicts"):
        rec = io.read(path)
    assert (rec.rate, rec.start) == (500.0, 1.0)


def test_delta_x_is_taken_where_the_x_column_is_not_uniform(tmp_path):
    data = [f"{t}\t1.0" for t in ("0.000", "0.001", "0.005", "0.006")]
    path = write(tmp_path, header("One") + segment(data))
    with pytest.warns(ImpactsigWarning, match=r"not uniform.*Delta_X of the header is taken"):
        assert io.read(path).rate == 1000.0


def test_several_x_columns_of_different_rates(tmp_path):
    data = [f"{i * 0.001:.3f}\t{i}\t" + (f"{i * 0.25}\t{-i}" if i < 3 else "\t") for i in range(9)]
    text = header("Multi") + segment(data, ["F", "T"], [9, 3], delta=["0.001", "0.25"], wide=2)
    path = write(tmp_path, text)
    assert [(c.name, c.rate, c.length) for c in io.info(path).channels] == [
        ("F", 1000.0, 9),
        ("T", 4.0, 3),
    ]
    np.testing.assert_array_equal(io.read(path, channel="T").samples, [0, -1, -2])


def test_an_x_column_of_its_own_counts_whatever_delta_x_the_first_channel_has(tmp_path):
    data = [f"{i * 0.001:.3f}\t{i}\t{1 + i * 0.25}\t{-i}" for i in range(9)]
    text = header("Multi") + segment(data, ["F", "T"], delta=["0.001", "0.5"], wide=2)
    with pytest.warns(ImpactsigWarning, match="Delta_X of 0.5 s of 'T' contradicts"):
        rec = io.read(write(tmp_path, text), channel="T")
    assert (rec.rate, rec.start) == (4.0, 1.0)


def test_a_channel_named_time_is_the_clock_of_all(tmp_path):
    data = [f"\t{i * 0.002:.6f}\t{i}" for i in range(6)]
    text = segment(data, ["time", "F"], delta=["1.000000", "0.001990"]).replace("\tN", "\ts")
    path = write(tmp_path, header() + text)
    with pytest.warns(ImpactsigWarning, match="Delta_X of 0.001990 s of 'F' contradicts"):
        rec = io.read(path)
    assert (rec.rate, rec.channels) == (500.0, ("F",))


@pytest.mark.parametrize(
    ("printed", "rate"),
    [
        ("1.953125E-5", 51_200.0),
        ("0.000250", 4000.0),
        ("0.033333", 30.0),
    ],
)
def test_printed_delta_x_that_singles_out_a_whole_rate(tmp_path, printed, rate):
    path = write(tmp_path, header() + segment(["\t1.0", "\t2.0"], delta=printed))
    assert io.read(path).rate == rate


@pytest.mark.parametrize(
    ("printed", "rate", "told"),
    [
        ("0.000606", 1 / 0.000606, "between 1648.8 and 1651.53 Hz"),
        ("0.000977", 1024.0, "between 1023.02 and 1024.07 Hz; 1024 Hz is taken"),
    ],
)
def test_printed_delta_x_that_leaves_the_rate_open_is_told(tmp_path, printed, rate, told):
    path = write(tmp_path, header() + segment(["\t1.0", "\t2.0"], delta=printed))
    with pytest.warns(ImpactsigWarning, match=told):
        assert io.read(path).rate == pytest.approx(rate, rel=1e-12)


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_names_outside_ascii(tmp_path, encoding):
    path = tmp_path / "a.lvm"
    path.write_bytes((header() + segment(["\t1.0", "\t2.0"], ["Kräfte"])).encode(encoding))
    assert io.read(path).channels == ("Kräfte",)


@pytest.mark.parametrize("delta", ["0.000000", "-1", "nan", ""])
def test_no_usable_delta_x(tmp_path, delta):
    path = write(tmp_path, header() + segment(["\t1.0", "\t2.0"], delta=delta))
    with pytest.raises(InvalidInput, match="give rate="):
        io.read(path)
    assert io.read(path, rate=7).rate == 7.0


def test_a_spectrum_has_no_rate(tmp_path):
    text = header() + segment(["\t1.0", "\t2.0"]).replace("X_Dimension\tTime", "X_Dimension\tFreq")
    with pytest.raises(InvalidInput, match="stand over Freq, not over time"):
        io.read(write(tmp_path, text))


def test_segments_that_follow_each_other_are_one(tmp_path):
    first = segment(["\t1.0", "\t2.0"], time="12:00:01.000")
    second = segment(["\t3.0", "\t4.0"], time="12:00:01.002")
    rec = io.read(write(tmp_path, header() + first + "\n" + second))
    assert rec.channels == ("F",)
    np.testing.assert_array_equal(rec.samples, [1, 2, 3, 4])


def test_segments_with_a_gap_stay_apart(tmp_path):
    first = segment(["\t1.0", "\t2.0", "\t3.0"], time="12:00:01")
    second = segment(["\t4.0", "\t5.0", "\t6.0"], time="12:00:09")
    path = write(tmp_path, header() + first + "\n" + second)
    with pytest.warns(ImpactsigWarning, match="left out: 'segment 1/F'|follow each other"):
        np.testing.assert_array_equal(io.read(path).samples, [1, 2, 3])
    with pytest.warns(ImpactsigWarning, match="2 segments do not follow each other"):
        later = io.read(path, channel="segment 1/F")
    np.testing.assert_array_equal(later.samples, [4, 5, 6])
    assert later.recorded_at == datetime(2024, 2, 29, 12, 0, 9)


def test_segments_that_begin_at_the_same_time_are_not_side_by_side(tmp_path):
    text = segment(["\t1.0", "\t2.0", "\t3.0"])
    path = write(tmp_path, header() + text + "\n" + text)
    with pytest.warns(ImpactsigWarning, match="left out: 'segment 1/F'|follow each other"):
        assert io.read(path).channels == ("segment 0/F",)


@pytest.mark.parametrize("rest", ["\t3.", "\t3.0", "\t"])
def test_a_file_cut_in_a_row_loses_that_row(tmp_path, rest):
    text = header() + segment(["\t1.5", "\t2.5"], samples=[100])
    path = write(tmp_path, text + rest)
    with pytest.warns(ImpactsigWarning, match="cut short: channel 'F' has 2 of 100 samples"):
        rec = io.read(path)
    assert rec.truncated is True
    np.testing.assert_array_equal(rec.samples, [1.5, 2.5])


def test_a_last_row_without_a_line_end_is_complete_if_the_header_expects_it(tmp_path):
    text = header() + segment(["\t1.5", "\t2.5"])
    rec = io.read(write(tmp_path, text.rstrip("\n")))
    np.testing.assert_array_equal(rec.samples, [1.5, 2.5])
    assert not rec.truncated


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("LabVIEW Measurement\t\nSeparator\tTab\n", "header does not end"),
        (header(), "no segment of data"),
        (header() + segment(["\t1.0"]).replace("Channels\t1", "Channels\t9"), "announces 9"),
        (header() + segment(["\tyes", "\tno"]), "holds text"),
        (header() + segment(["\t1.0"]).replace("\t1.0\n", ""), "no samples"),
        (header() + segment(["\t1.0"]).replace("Channels", "Chanels"), "cannot be read as NI LVM"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, text, reason):
    with pytest.raises(UnreadableFile, match=reason):
        io.read(write(tmp_path, text))
