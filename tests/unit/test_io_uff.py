"""Universal files: the columns of their headers, text and numbers, and what is no time history."""

import struct
from datetime import datetime

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

X = np.random.default_rng(9).standard_normal(50).astype(np.float32)


def header(
    count, *, kind=2, even=1, step=1e-3, axis=(17, "Time", "s"), name="hammer", node=0, direction=3
):
    number, label, unit = axis
    lines = [
        "strike 1",
        "NONE",
        "18-Apr-16 13:49:58",
        "NONE",
        "NONE",
        f"{1:5}{0:10}{0:5}{0:10} {name:<10}{node:10}{direction:4} {'NONE':<10}{0:10}{0:4}",
        f"{kind:10}{count:10}{even:10}{2.0:13.5E}{step:13.5E}{0.0:13.5E}",
        f"{number:10}{0:5}{0:5}{0:5} {label:<20} {unit:<20}",
        f"{13:10}{0:5}{0:5}{0:5} {'Force':<20} {'N':<20}",
        *[f"{0:10}{0:5}{0:5}{0:5} {'NONE':<20} {'NONE':<20}"] * 2,
    ]
    return "".join(line + "\n" for line in lines).encode()


def as_text(values, width=13, columns=6):
    cells = [f"{value:{width}.{width - 8}E}" for value in values]
    rows = ["".join(cells[i : i + columns]) for i in range(0, len(cells), columns)]
    return ("\n".join(rows) + "\n").encode()


def text(body, **options):
    return b"    -1\n    58\n" + header(**options) + body + b"    -1\n"


def packed(body, size=None, order=1, form=2, end=b"\n    -1\n", **options):
    first = f"    58b{order:6}{form:6}{11:12}{len(body) if size is None else size:12}"
    return b"    -1\n" + first.encode() + b"\n" + header(**options) + body + end


@pytest.fixture
def write(tmp_path):
    def write(*datasets):
        path = tmp_path / "a.uff"
        path.write_bytes(b"".join(datasets))
        return path

    return write


def test_text_with_names_units_and_time(write):
    one = text(as_text(X), count=50, node=12)
    two = text(as_text(2 * X), count=50, name="")
    path = write(OTHER, one, two)
    rec = io.read(path)
    assert (rec.channels, rec.units) == (("hammer 12+Z", "Force"), ("N", "N"))
    assert (rec.rate, rec.start) == (1000.0, 2.0)
    assert rec.recorded_at == datetime(2016, 4, 18, 13, 49, 58)
    np.testing.assert_array_equal(rec.samples[:, 0], [float(f"{v:.5E}") for v in X])
    np.testing.assert_array_equal(io.read(path, 1, 2.01, 2.02).samples, rec.samples[10:20, 1])


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [2, 4])
def test_numbers_of_either_precision_and_order(write, order, kind):
    dtype = {2: "f4", 4: "f8"}[kind]
    body = X.astype(order + dtype).tobytes()
    path = write(packed(body, order=1 if order == "<" else 2, count=50, kind=kind))
    rec = io.read(path)
    assert rec.samples.dtype == dtype
    np.testing.assert_array_equal(rec.samples, X)


def test_numbers_that_look_like_the_end_of_a_dataset(write):
    marks = b"\n    -1\n    58\n    -1\n"
    body = (marks * 10)[:200]
    path = write(packed(body, count=50), packed(X.tobytes(), count=50))
    rec = io.read(path)
    np.testing.assert_array_equal(rec.samples, np.stack([np.frombuffer(body, "<f4"), X], 1))


OTHER = b"    -1\n   151\nmodel\n 1 2 3\n    -1\n"


@pytest.mark.parametrize("end", [b"    -1\n", b"    -1\r\n", b"\n    -1\n", b"\r\n    -1  \r\n"])
@pytest.mark.parametrize("between", [b"", OTHER])
def test_sets_that_end_right_behind_their_numbers(write, end, between):
    sets = [packed((k * X).tobytes(), count=50, node=k, end=end) for k in range(1, 6)]
    sets.insert(2, text(as_text(X), count=50, node=6))
    rec = io.read(write(between.join(sets)))
    assert rec.channels == tuple(f"hammer {k}+Z" for k in (1, 2, 6, 3, 4, 5))
    expected = np.column_stack([k * X for k in range(1, 6)])
    np.testing.assert_array_equal(rec.samples[:, [0, 1, 3, 4, 5]], expected)


def test_the_last_set_may_end_without_a_line_end(write):
    rec = io.read(write(packed(X.tobytes(), count=50, end=b"    -1")))
    assert not rec.truncated
    np.testing.assert_array_equal(rec.samples, X)


@pytest.mark.parametrize("at", [0, 1, 2])
def test_a_set_without_content_is_passed_over_and_named(write, at):
    sets = [packed(X.tobytes(), count=50, end=b"    -1\n")] * 2
    # The binary writer of pyuff destroys its first set when it overwrites a file.
    sets.insert(at, b"    -1\n")
    path = write(*sets)
    empty = len(b"".join(sets[:at]))
    with pytest.warns(ImpactsigWarning, match=f"-1 at byte {empty} opens no data set"):
        rec = io.read(path)
    np.testing.assert_array_equal(rec.samples, np.column_stack([X, X]))


def test_what_stands_in_no_set_is_named(write):
    one = packed(X.tobytes(), count=50, end=b"    -1\n")
    end = len(one)
    with pytest.warns(ImpactsigWarning, match=f"bytes {end - 1} to {end + 10} stand in"):
        rec = io.read(write(one, b"a comment\n", one))
    np.testing.assert_array_equal(rec.samples, np.column_stack([X, X]))


def test_more_numbers_than_announced_are_an_error(write):
    doubles = X.astype(float).tobytes()  # as pyuff writes them with force_double=False
    path = write(packed(doubles, size=200, count=50, kind=2, end=b"    -1\n"))
    with pytest.raises(UnreadableFile, match=r"announces 200 bytes .* no line of -1 follows them"):
        io.read(path)


@pytest.mark.parametrize("announced", [0, 400])
def test_times_are_not_always_counted(write, announced):
    rows = np.zeros(50, [("t", "f8"), ("x", "f8")])
    rows["t"], rows["x"] = np.arange(50) / 256, X
    one = packed(rows.tobytes(), size=announced, count=50, even=0, kind=4, step=0, end=b"    -1\n")
    rec = io.read(write(one, one))
    assert rec.rate == 256.0
    np.testing.assert_array_equal(rec.samples, np.column_stack([X, X]))


def test_imaginary_parts_are_not_always_counted(write):
    frf = packed(bytes(50 * 16), size=400, count=50, kind=6, axis=(18, "Frequency", "Hz"))
    with pytest.warns(ImpactsigWarning, match="holds complex numbers"):
        np.testing.assert_array_equal(io.read(write(frf, packed(X.tobytes(), count=50))).samples, X)


def test_a_name_that_is_node_and_direction_is_not_repeated(write):
    assert io.read(write(text(as_text(X), count=50, name="7+Z", node=7))).channels == ("7+Z",)


def test_functions_of_one_name_are_told_apart_by_their_titles(write):
    one = text(as_text(X), count=50, name="cell")
    path = write(one, one.replace(b"strike 1", b"strike 2"), text(as_text(X), count=50))
    assert io.read(path).channels == ("cell (strike 1)", "cell (strike 2)", "hammer")
    with pytest.raises(InvalidInput, match=r"one of 'cell \(strike 1\)', 'cell \(strike 2\)'"):
        io.read(path, "cell")


@pytest.mark.parametrize(
    ("direction", "axis"),
    [(0, ""), (1, "+X"), (-1, "-X"), (2, "+Y"), (-2, "-Y"), (3, "+Z"), (-3, "-Z"), (4, "")],
)
def test_the_direction_of_a_node(write, direction, axis):
    path = write(text(as_text(X), count=50, node=12, direction=direction))
    assert io.read(path).channels == (f"hammer 12{axis}",)


@pytest.mark.parametrize(
    ("digits", "year"), [("69", 2069), ("70", 1970), ("99", 1999), ("00", 2000)]
)
def test_the_century_of_a_date(write, digits, year):
    dataset = text(as_text(X), count=50).replace(b"18-Apr-16", b"18-Apr-" + digits.encode())
    assert io.read(write(dataset)).recorded_at == datetime(year, 4, 18, 13, 49, 58)


def test_numbers_of_full_width_with_nothing_between_them(write):
    values = -np.abs(X.astype(float)) * 1e-150
    body = as_text(values, width=14).replace(b" ", b"")
    assert b"-" in body.replace(b"E-", b"").replace(b"\n-", b"")[1:]
    rec = io.read(write(text(body, count=50, kind=4)))
    np.testing.assert_allclose(rec.samples, values, rtol=1e-6)


@pytest.mark.parametrize("times", ["text", "f4", "f8"])
def test_times_beside_the_values(write, times):
    t = 1 + np.arange(50) / 256
    if times == "text":
        pairs = np.column_stack([t, X]).ravel()
        path = write(text(as_text(pairs, 20, 4), count=50, even=0, kind=4, step=0))
    else:
        rows = np.zeros(50, [("t", times), ("x", "f8")])
        rows["t"], rows["x"] = t, X
        path = write(packed(rows.tobytes(), count=50, even=0, kind=4, step=0))
    rec = io.read(path)
    assert (rec.rate, rec.start) == (pytest.approx(256, rel=1e-6), 1.0)
    np.testing.assert_allclose(rec.samples, X, rtol=1e-11)


def test_what_is_no_time_history_is_named(write):
    spectrum = text(as_text(X), count=50, axis=(18, "Frequency", "Hz"), name="psd")
    path = write(spectrum, text(as_text(X), count=25, kind=5, name="frf"))
    with pytest.raises(UnreadableFile, match=r"'psd' .* stands over Frequency.*'frf' .* complex"):
        io.read(path)
    path = write(spectrum, text(as_text(X), count=50))
    with pytest.warns(ImpactsigWarning, match="'psd' is left out"):
        assert io.read(path).channels == ("hammer",)


def test_a_step_of_nothing_gives_no_rate(write):
    path = write(text(as_text(X), count=50, step=0.0))
    with pytest.raises(InvalidInput, match=r"step is given as 0.00000E"):
        io.read(path)
    assert io.read(path, rate=10).rate == 10


@pytest.mark.parametrize("kind", ["text", "numbers"])
def test_cut_short_is_told(write, kind):
    whole = text(as_text(X), count=50) if kind == "text" else packed(X.tobytes(), count=50)
    path = write(whole)
    path.write_bytes(whole[: -70 if kind == "text" else -47])
    with pytest.warns(ImpactsigWarning, match=r"'hammer' has \d+ of 50 values") as warned:
        rec = io.read(path)
    assert rec.truncated is True
    assert f"cut short: 'hammer' has {len(rec)} of 50 values" in str(warned[0].message)
    assert 35 < len(rec) < 50
    np.testing.assert_allclose(rec.samples, X[: len(rec)], rtol=5e-6)  # no number is cut in two
    path.write_bytes(whole[:400])
    with pytest.raises(UnreadableFile, match=r"ends in the header|unknown size"):
        io.read(path)


@pytest.mark.parametrize(
    ("dataset", "reason"),
    [
        (text(as_text(X), count=50, kind=3), "numbers of unknown type 3"),
        (text(as_text(X), count=-5), "-5 numbers of unknown type"),
        (text(as_text(X)[:-200] + b" ?" * 100 + b"\n", count=50), "has an invalid number"),
        (packed(X.tobytes(), form=1, count=50), "an old computer"),
        (packed(X.tobytes(), count=999_999_999), "announces 999999999 values"),
        (packed(X.tobytes(), size=-200, count=50), "58b with the header"),
        (b"    -1\n 12345\n    -1\n", "has no function"),
    ],
)
def test_headers_that_lie(write, dataset, reason):
    with pytest.raises(UnreadableFile, match=reason):
        io.read(write(dataset))


def test_announced_beyond_the_end_of_the_file(write):
    body = struct.pack("<50f", *X)
    with pytest.warns(ImpactsigWarning, match=r"'hammer' has 5\d of 500000000 values"):
        rec = io.read(write(packed(body, size=2_000_000_000, count=500_000_000)))
    np.testing.assert_array_equal(rec.samples[:50], X)


# The expected values were read off the files by eye; numbers are those of the text.
@pytest.mark.parametrize(
    ("name", "channel", "unit", "rate", "length", "first"),
    [
        ("Sample_UFF58_ascii.uff", "Mic 01", "Pa", 65_536.0, 79_292, -1.47553e-2),
        ("Sample_UFF58b_bin.uff", "Mic 01", "Pa", 65_536.0, 79_292, -1.47553e-2),
        ("binary8byte.uff", "sine 5 Hz 1", "g", 100.0, 250, 0.0),
        ("time-history-not-all-columns-filled.uff", "1x", "m/s²", 20_000.0, 13, -3.81956),
    ],
)
def test_real_files(shared_data, name, channel, unit, rate, length, first):
    rec = io.read(shared_data(f"formats/{name}"))
    assert (rec.channels, rec.unit, rec.rate, len(rec)) == ((channel,), unit, rate, length)
    assert rec.samples[0] == pytest.approx(first, rel=1e-5)


def test_every_set_of_a_real_file(shared_data):
    """Four sets, each of which ends right behind its numbers."""
    path = shared_data("formats/MPSTD_fixed_test.uff")
    content = path.read_bytes()
    found = io.info(path).channels
    assert [(c.name, c.length, c.rate, c.unit) for c in found] == [
        (name, 222_400, 3200.0, "m/s2")
        for name in ("1+Z (MPS set1 Dof1)", "2+Z", "3+Z", "1+Z (MPS set1 Dof4)")
    ]
    for index in range(4):
        at = content.index(f"MPS set1 Dof{index + 1}".encode())
        for _ in range(11):
            at = content.index(b"\n", at) + 1
        expected = np.frombuffer(content, "<f4", 222_400, at)
        np.testing.assert_array_equal(io.read(path, channel=index).samples, expected)


def test_the_same_recording_as_text_and_as_numbers(shared_data):
    text, numbers = (
        io.read(shared_data(f"formats/Sample_UFF58{s}.uff")) for s in ("_ascii", "b_bin")
    )
    np.testing.assert_allclose(text.samples, numbers.samples, rtol=5e-6)


def test_a_real_spectrum_is_refused(shared_data):
    with pytest.raises(UnreadableFile, match="'Pilot 1' is left out: it holds complex numbers"):
        io.read(shared_data("formats/sample_dataset58_psd.uff"))
