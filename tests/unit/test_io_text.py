"""Text tables: how they are written, what counts as time, what is wrong with them."""

import sys
import warnings
from datetime import datetime, timedelta

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile
from impactsig.io._units import split_heading


def write(tmp_path, text, name="a.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


ROWS = [(0.0, 1.5, -2.0), (0.25, 2.5, -3.0), (0.5, 3.5, -4.5), (0.75, 4.5, 5.0)]
F, A = np.array(ROWS).T[1:]


def table(delimiter=",", decimal=".", heading="time [s],Force [N],acc (m/s^2)", rows=ROWS):
    lines = [heading.replace(",", delimiter)] if heading else []
    for row in rows:
        lines.append(delimiter.join(str(x).replace(".", decimal) for x in row))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("delimiter", "decimal"),
    [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("  ", "."), (", ", ".")],
)
@pytest.mark.parametrize("heading", ["time,Force,acc", "", "# time,Force,acc"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_delimiters_decimal_signs_and_headings(tmp_path, delimiter, decimal, heading, ending):
    text = table(delimiter, decimal, heading).replace("\n", ending)
    rec = io.read(write(tmp_path, text))
    assert (rec.rate, rec.start, rec.sensor) == (4.0, 0.0, "force")
    assert rec.channels == (("Force", "acc") if heading else ("channel 0", "channel 1"))
    np.testing.assert_array_equal(rec.samples, np.column_stack([F, A]))


@pytest.mark.parametrize(
    ("heading", "names", "units"),
    [
        ("time [s],Force [N],acc (m/s^2)", ("Force", "acc"), ("N", "m/s^2")),
        ("Time (s),F / kN,a / m/s²", ("F", "a"), ("kN", "m/s²")),
        ("t,Excitation (Trigger),in/out", ("Excitation (Trigger)", "in/out"), ("", "")),
        ("time,force,acc\ns,N,m/s^2", ("force", "acc"), ("N", "m/s^2")),
        ("time,force,acc\n[s],[N],[g]", ("force", "acc"), ("N", "g")),
        ("time,force,acc\ntime - seconds (later),load - kN,acc - g", ("force", "acc"), ("kN", "g")),
        ("# rig 3\n% t [s],x [mV],y []", ("x", "y"), ("mV", "")),
        ('"time","load, upper","y"', ("load, upper", "y"), ("", "")),
        ("Rig;3\nOperator;Meier\ntime,force,acc", ("force", "acc"), ("", "")),
    ],
)
def test_names_and_units(tmp_path, heading, names, units):
    rows = table(heading="")
    rec = io.read(write(tmp_path, f"{heading}\n{rows}"))
    assert (rec.channels, rec.units, rec.rate) == (names, units, 4.0)


def test_a_unit_in_round_brackets_must_read_as_one():
    assert split_heading("Force (N)") == ("Force", "N")
    assert split_heading("Strain (µm/m)") == ("Strain", "µm/m")
    assert split_heading("Response (Trigger)") == ("Response (Trigger)", "")
    assert split_heading("Response [Trigger]") == ("Response", "Trigger")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_encodings(tmp_path, encoding):
    rec = io.read(write(tmp_path, table(heading="time,Kraft µ,acc"), encoding=encoding))
    assert rec.channels == ("Kraft µ", "acc")
    np.testing.assert_array_equal(rec.samples[:, 0], F)


@pytest.mark.parametrize("mark", ["#", "%", "!", ";"])
def test_comment_lines_above_and_among_the_data(tmp_path, mark):
    head, *rows = table().splitlines()
    lines = [f"{mark} rig 3", head, *rows[:2], f"{mark} paused here", *rows[2:]]
    rec = io.read(write(tmp_path, "\n".join(lines)))
    np.testing.assert_array_equal(rec.samples[:, 1], A)


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("time [ms]", 1e-3),
        ("Zeit (µs)", 1e-6),
        ("t_ms", 1e-3),
        ("ms", 1e-3),
        ("seconds", 1.0),
        ("Time (h)", 3600.0),
        ("X_Value", 1.0),
    ],
)
def test_the_time_column_by_name_and_unit_anywhere(tmp_path, heading, factor):
    lines = [f"force,{heading}"] + [f"{f},{3 + 0.5 * i:.6f}" for i, f in enumerate(F)]
    rec = io.read(write(tmp_path, "\n".join(lines)))
    assert rec.rate == pytest.approx(2 / factor, rel=1e-12)
    assert rec.start == pytest.approx(3 * factor)
    assert rec.channels == ("force",)


def test_a_capital_t_is_a_temperature(tmp_path):
    path = write(tmp_path, "T,t\n20.5,0.0\n21.0,0.5\n21.5,1.0\n")
    assert (io.read(path).channels, io.read(path).rate) == (("T",), 2.0)


def test_parts_go_by_the_times_of_the_file(tmp_path):
    path = write(tmp_path, "time,x\n" + "\n".join(f"{12 + i / 8},{i}" for i in range(80)))
    rec = io.read(path, start=13, stop=14)
    np.testing.assert_array_equal(rec.samples, np.arange(8, 16))
    assert (rec.start, rec.time[-1]) == (13.0, 13.875)
    with pytest.raises(InvalidInput, match="inside 12 to 22 s"):
        io.read(path, start=0, stop=5)


@pytest.mark.parametrize("digits", [5, 6])
def test_rounding_of_the_printed_times_is_no_jitter(tmp_path, digits):
    # 48 kHz: the step is 20.8333 us, so that printed steps differ by half of it and more.
    lines = [f"{i / 48_000:.{digits}f}\t{i}" for i in range(4801)]
    rec = io.read(write(tmp_path, "time\tx\n" + "\n".join(lines), "a.txt"))
    assert rec.rate == pytest.approx(48_000, rel=10.0**-digits / 0.1)


def test_a_whole_rate_is_found_through_rounded_times(tmp_path):
    # The last of 51 200 times, 0.99998046875, is printed as 0.999980: 51 200.024 Hz if believed.
    lines = ["time,x"] + [f"{i / 51_200:.6f},{i}" for i in range(51_200)]
    assert io.read(write(tmp_path, "\n".join(lines))).rate == 51_200.0


def test_times_printed_too_coarsely_to_fix_the_rate_are_told(tmp_path):
    lines = ["time,x"] + [f"{i / 51_282.05:.4f},{i}" for i in range(100)]
    path = write(tmp_path, "\n".join(lines))
    with pytest.warns(ImpactsigWarning, match=r"leave the rate between .* give rate= \(--rate\)"):
        rec = io.read(path)
    assert rec.rate == pytest.approx(51_282.05, rel=2e-3)


def test_a_missing_row_is_named(tmp_path):
    times = np.delete(np.arange(1000) / 1000, 700)
    lines = ["time,x"] + [f"{t:.6f},1.0" for t in times]
    path = write(tmp_path, "\n".join(lines))
    # The mean step is 999/998 of the true one, and the gap is two true steps: 99.8 % too long.
    with pytest.raises(InvalidInput, match=r"up to 99\.8 % .*after sample 699, t = 0\.699 s"):
        io.read(path)
    assert io.read(path, rate=1000).channels == ("x",)


def test_a_missing_row_is_found_even_where_the_digits_end_at_the_step(tmp_path):
    lines = ["time,x"] + [f"{t:.3f},1.0" for t in np.delete(np.arange(1000) / 1000, 700)]
    with pytest.raises(InvalidInput, match="after sample 699"):
        io.read(write(tmp_path, "\n".join(lines)))


def test_a_clock_that_drifts_is_not_uniform(tmp_path):
    times = np.cumsum(np.linspace(1e-3, 1.01e-3, 1000))
    lines = ["time,x"] + [f"{t:.9f},1.0" for t in times]
    with pytest.raises(InvalidInput, match="not uniform"):
        io.read(write(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize("times", ["1 1 1 1", "4 3 2 1", "a b c d", "01.05.2024 02.05.2024 3 4"])
def test_columns_that_are_no_times(tmp_path, times):
    lines = ["time,x"] + [f"{t},1.0" for t in times.split()]
    with pytest.raises(InvalidInput, match="give rate="):
        io.read(write(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize("heading", ["", "sample,x,y\n", ",x,y\n"])
def test_a_column_that_counts_rows_is_no_time(tmp_path, heading):
    rows = "".join(f"{i},{a},{b}\n" for i, (_, a, b) in enumerate(ROWS))
    path = write(tmp_path, heading + rows)
    with pytest.raises(InvalidInput, match="no column of times"):
        io.read(path)
    np.testing.assert_array_equal(io.read(path, rate=2).samples, np.column_stack([F, A]))


def test_a_first_column_without_a_name_that_is_not_uniform_is_a_signal(tmp_path):
    path = write(tmp_path, "0.10 5.0\n0.40 6.0\n0.50 7.0\n", "a.txt")
    with pytest.raises(InvalidInput, match=r"its first column is none: .*not uniform"):
        io.read(path)
    np.testing.assert_array_equal(io.read(path, rate=1).samples[:, 0], [0.1, 0.4, 0.5])


@pytest.mark.parametrize("text", ["1,5\n2,0625\n3,25\n", "x\n1,5\n2,0625\n3,25\n"])
def test_one_column_with_decimal_comma(tmp_path, text):
    rec = io.read(write(tmp_path, text), rate=1)
    np.testing.assert_array_equal(rec.samples, [1.5, 2.0625, 3.25])


def test_two_columns_of_whole_numbers_are_not_decimals(tmp_path):
    rec = io.read(write(tmp_path, "1,5\n3,6\n2,25\n"), rate=1)
    np.testing.assert_array_equal(rec.samples, [[1, 5], [3, 6], [2, 25]])


def test_a_given_rate_takes_precedence(tmp_path):
    assert io.read(write(tmp_path, table()), rate=5).rate == 5.0


def test_a_column_of_text_is_left_out_and_told(tmp_path):
    lines = ["time,state,x"] + [f"{i / 4},ok,{i}" for i in range(8)]
    path = write(tmp_path, "\n".join(lines))
    with pytest.warns(ImpactsigWarning, match="column state holds text and is left out"):
        assert io.read(path).channels == ("x",)


@pytest.mark.parametrize("stray", ["End of file\n", "0.3;oops", "x;1.0"])
def test_text_among_numbers_is_an_error_that_names_the_row(tmp_path, stray):
    path = write(tmp_path, "time;F\n0.0;1.5\n0.1;2.5\n0.2;3.5\n" + stray)
    with pytest.raises(UnreadableFile, match="in row 3 of the data"):
        io.read(path, rate=1)


def test_a_last_line_of_text_that_is_not_ended_is_left_out(tmp_path):
    path = write(tmp_path, "time;F\n0,0;1,5\n0,1;2,5\n0,2;3,5\nEnd of fi")
    with pytest.warns(ImpactsigWarning, match="'End of fi', is not complete"):
        rec = io.read(path)
    assert (rec.rate, rec.truncated) == (10.0, True)
    np.testing.assert_array_equal(rec.samples, [1.5, 2.5, 3.5])


def test_a_last_line_that_is_a_comment_is_not_a_row_cut_short(tmp_path):
    rec = io.read(write(tmp_path, table() + "# end"))
    assert (len(rec), rec.truncated) == (4, False)


def test_more_headings_than_data(tmp_path):
    path = write(tmp_path, "Channel;Place;Remark\n" * 40 + "t;F;G\n" + table(";", heading=""))
    assert io.read(path).channels == ("F", "G")


MIDNIGHT = datetime(2024, 2, 28, 23, 59, 59, 900_000)


@pytest.mark.parametrize(
    ("heading", "shown"),
    [
        ("timestamp;F", "{:%Y-%m-%dT%H:%M:%S.%f}"),
        ("Date/Time;F", "{:%Y-%m-%d %H:%M:%S.%f}"),
        ("", "{:%Y-%m-%d %H:%M:%S,%f}"),
    ],
)
def test_dates_as_times(tmp_path, heading, shown):
    stamps = [shown.format(MIDNIGHT + i * timedelta(milliseconds=2)) for i in range(100)]
    lines = [heading] + [f"{stamp};{i}" for i, stamp in enumerate(stamps)]
    rec = io.read(write(tmp_path, "\n".join(lines)))
    assert (rec.rate, rec.start, rec.recorded_at) == (500.0, 0.0, MIDNIGHT)
    np.testing.assert_array_equal(rec.samples, np.arange(100))


def test_times_of_day_printed_to_milliseconds(tmp_path):
    # 300 Hz: the step of 3.33 ms is printed as 3 or 4 ms.
    begin = datetime(2024, 2, 28, 9)
    stamps = [begin + timedelta(microseconds=round(i * 1e6 / 300)) for i in range(3001)]
    lines = ["time,F"] + [f"{t:%H:%M:%S}.{t.microsecond // 1000:03},1" for t in stamps]
    rec = io.read(write(tmp_path, "\n".join(lines)))
    assert rec.rate == pytest.approx(300.0, rel=1e-4)


def test_columns_of_two_lengths(tmp_path):
    lines = ["time,x,y"] + [f"{i / 4},{i}," + (f"{i}" if i < 3 else "") for i in range(8)]
    path = write(tmp_path, "\n".join(lines))
    with pytest.warns(ImpactsigWarning, match=r"'y' \(3 samples at 4 Hz\).*channel='y'"):
        assert len(io.read(path)) == 8
    np.testing.assert_array_equal(io.read(path, channel="y").samples, [0, 1, 2])


def test_a_missing_value_inside_stays_a_gap(tmp_path):
    lines = ["time,x"] + [f"{i / 4}," + (f"{i}" if i != 3 else "") for i in range(8)]
    samples = io.read(write(tmp_path, "\n".join(lines))).samples
    assert np.flatnonzero(np.isnan(samples)).tolist() == [3]


def test_a_last_line_cut_in_the_middle_is_left_out_and_told(tmp_path):
    text = table()
    path = write(tmp_path, text[: text.rindex(",")])
    with pytest.warns(ImpactsigWarning, match="cut short: its last line, '0.75,4.5', is not"):
        rec = io.read(path)
    assert rec.truncated is True
    np.testing.assert_array_equal(rec.samples, np.column_stack([F, A])[:3])


@pytest.mark.parametrize(
    "text", ["no numbers here, 1\nnot one, no\n", "<html>1</html>\n", "a,b1,c\n"]
)
def test_text_without_rows_of_numbers(tmp_path, text):
    with pytest.raises(UnreadableFile, match="no rows of numbers"):
        io.read(write(tmp_path, text), rate=1)


def test_rows_of_changing_width_name_the_line(tmp_path):
    path = write(tmp_path, "1,2\n3,4\n5,6\n7,8\n9,10,11\n")
    with pytest.raises(UnreadableFile, match="line 5") as caught:
        io.read(path, rate=1)
    assert caught.value.__cause__ is not None


# -- pyarrow, pandas, and files too large to be held -------------------------------------------

MANY = [(i / 64, (i * 7919) % 1000 / 7, -i / 3) for i in range(200)]
STYLES = {
    "plain": table(rows=MANY),
    "decimal comma": table(";", ",", rows=MANY),
    "tabs, no heading": table("\t", heading="", rows=MANY),
    "white space": table("  ", rows=MANY),
    "one column": "force\n" + "".join(f"{row[1]}\n" for row in MANY),
    "comments and blank lines": table(rows=MANY).replace("\n1.5,", "\n# here\n\n1.5,"),
    "blank lines at the end": table(rows=MANY) + "\n" * 500,
    "missing values": table(rows=MANY).replace(",-20.0\n", ",\n").replace(",-21.0\n", ",NA\n"),
    "a short column": table(rows=[r if i < 90 else (*r[:2], "") for i, r in enumerate(MANY)]),
    "a column of text": table(heading="time,x,y,mood", rows=[(*r, "calm") for r in MANY]),
    "dates": table(
        heading="time,x",
        rows=[(f"2024-05-01 10:00:{i // 50:02}.{i % 50 * 2:02}", r[1]) for i, r in enumerate(MANY)],
    ),
    "a counter": table(heading="index,x,y", rows=[(i, *r[1:]) for i, r in enumerate(MANY)]),
    "line ends of old": table(rows=MANY).replace("\n", "\r"),
    "cut in its last line": table(rows=MANY)[:-20],
    "byte order mark": "\ufeff" + table(heading="", rows=MANY),
    "quoted": table(rows=MANY).replace("time [s]", '"time, [s]"').replace("1.5,", '"1.5",'),
}


def everything(path):
    """All that is read of a file, whole, in blocks and in part."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        listed = io.info(path)
        rate = 64 if listed.channels[0].rate is None else None
        rec = io.read(path, rate=rate)
        blocks = [b.samples for b in io.read_blocks(path, 0.3, rate=rate)]
        part = io.read(path, 0, rec.start + 1, rec.start + 1.5, rate=rate)
    np.testing.assert_array_equal(np.concatenate(blocks), rec.samples)
    messages = sorted({str(w.message) for w in told})
    return repr(listed), repr(rec), rec.samples.tobytes(), part.samples.tobytes(), messages


@pytest.mark.parametrize("style", STYLES)
def test_pyarrow_and_pandas_read_alike(tmp_path, style, monkeypatch):
    path = write(tmp_path, STYLES[style])
    by_arrow = everything(path)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert everything(path) == by_arrow


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(
    "size", [250, 1000, *(pytest.param(n, marks=pytest.mark.slow) for n in (100, 3000))]
)
def test_in_pieces_as_whole(tmp_path, style, size, monkeypatch):
    path = write(tmp_path, STYLES[style])
    whole = everything(path)
    monkeypatch.setattr("impactsig.io.text._table.LARGE", 10)
    monkeypatch.setattr("impactsig.io.text._table.PIECE", size)
    assert everything(path) == whole


def test_pieces_of_another_width_are_refused(tmp_path, monkeypatch):
    # The way that a file is written is told from its first 128 KiB.
    rows = table(rows=MANY * 50) + table(heading="", rows=[(*r, 1.0) for r in MANY])
    path = write(tmp_path, rows)
    monkeypatch.setattr("impactsig.io.text._table.LARGE", 10)
    monkeypatch.setattr("impactsig.io.text._table.PIECE", 5000)
    with pytest.raises(UnreadableFile, match=r"Expected 3 fields|has rows of 4 cells, not 3"):
        io.read(path)


def test_what_pyarrow_takes_is_what_pandas_takes(tmp_path):
    from impactsig.io.text import _columns
    from impactsig.io.text._dialect import find_dialect

    pytest.importorskip("pyarrow")
    rng = np.random.default_rng(13)
    x = rng.standard_normal(3000) * 10.0 ** rng.integers(-300, 300, 3000)
    path = write(
        tmp_path, "\n".join(f"{a!r},{b:.17g}" for a, b in zip(x.tolist(), -x, strict=True))
    )
    dialect = find_dialect(path.read_bytes()[:100_000], False)
    arrow, pandas = (
        _columns._columns_by_arrow(path, dialect),
        _columns._columns_by_pandas(path, dialect),
    )
    np.testing.assert_array_equal(arrow, [x, -x])
    np.testing.assert_array_equal(pandas, [x, -x])


@pytest.mark.parametrize("steps", [1, 2, 7, 64, 1000])
def test_times_are_judged_alike_in_pieces_of_any_size(monkeypatch, steps):
    from impactsig.io.times import timebase

    rng = np.random.default_rng(17)
    even = 3 + np.arange(500) / 64
    missing, late, rounded = np.delete(even, 200), even.copy(), np.round(even, 2)
    late[333] += 0.01
    noisy, broken = even + rng.normal(0, 5e-4, 500), even.copy()
    broken[64] = np.nan
    cases = [(t, 0.0) for t in (even, missing, late, noisy, broken, even[::-1], even[:2], even[:1])]
    cases.append((rounded, 0.01))

    def judged():
        return [repr(timebase.time_base(*case)) for case in cases]

    whole = judged()
    monkeypatch.setattr(timebase, "_NEAR", steps)
    monkeypatch.setattr(timebase, "_FAR", 3 * steps)
    assert judged() == whole
    assert sum("rate=64.0" in found for found in whole) == 3  # even, the first two, and rounded
