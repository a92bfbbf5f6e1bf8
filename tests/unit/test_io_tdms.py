"""NI TDMS built byte by byte from NI's description of the format, and by npTDMS' writer."""

import logging
import struct
import sys
from datetime import UTC, datetime

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, MissingExtra, UnreadableFile

nptdms = pytest.importorskip("nptdms")

A = np.arange(12) * 1.5 - 3
B = np.cos(np.arange(12.0))
TYPES = {"f8": 10, "f4": 9, "i2": 2, "i4": 3, "u1": 5}


def text(order, value):
    return struct.pack(order + "I", len(value)) + value.encode()


def segment(channels, order="<", interleaved=False, chunks=1, increment=0.001):
    """One segment of a file: arrays by name, cut into equal chunks."""
    body = struct.pack(order + "I", len(channels))
    for name, array in channels.items():
        body += text(order, f"/'g'/'{name}'")
        kind = TYPES[array.dtype.str[1:]]
        body += struct.pack(order + "IIIQ", 20, kind, 1, len(array) // chunks)
        body += struct.pack(order + "I", 1) + text(order, "wf_increment")
        body += struct.pack(order + "Id", 10, increment)
    raw = b""
    for chunk in range(chunks):
        parts = []
        for array in channels.values():
            size = len(array) // chunks
            part = array[chunk * size : (chunk + 1) * size]
            parts.append(part.astype(part.dtype.newbyteorder(order)))
        if interleaved:
            rows = range(len(parts[0]))
            raw += b"".join(part[i : i + 1].tobytes() for i in rows for part in parts)
        else:
            raw += b"".join(part.tobytes() for part in parts)
    contents = 2 | 4 | 8 | (32 if interleaved else 0) | (64 if order == ">" else 0)
    lead = b"TDSm" + struct.pack("<I", contents)
    return lead + struct.pack(order + "IQQ", 4713, len(body) + len(raw), len(body)) + body + raw


def write(tmp_path, *segments):
    path = tmp_path / "a.tdms"
    path.write_bytes(b"".join(segments))
    return path


def written(path, segments, **properties):
    with nptdms.TdmsWriter(str(path)) as file:
        for channels in segments:
            file.write_segment(
                [nptdms.ChannelObject(*name, array, properties) for name, array in channels.items()]
            )
    return path


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("interleaved", [False, True])
@pytest.mark.parametrize("chunks", [1, 3])
@pytest.mark.parametrize(
    ("kind", "kept"), [("f8", np.float64), ("f4", np.float32), ("i2", np.float32)]
)
def test_every_layout_and_every_part(tmp_path, order, interleaved, chunks, kind, kept):
    a, b = A.astype(kind), (10 * B).astype(kind)
    one = segment({"a": a, "b": b}, order, interleaved, chunks)
    path = write(tmp_path, one, one)
    rec = io.read(path)
    assert (rec.rate, rec.channels, rec.samples.dtype) == (1000.0, ("g/a", "g/b"), kept)
    whole = np.tile(np.column_stack([a, b]), (2, 1))
    np.testing.assert_array_equal(rec.samples, whole)
    for first in range(0, 24, 5):
        part = io.read(path, start=first / 1000, stop=(first + 7) / 1000)
        np.testing.assert_array_equal(part.samples, whole[first : first + 7])


def test_layouts_are_read_without_npTDMS_reading_samples(tmp_path, monkeypatch):
    path = write(tmp_path, segment({"a": A, "b": B}, chunks=3))
    monkeypatch.setattr(nptdms.TdmsChannel, "__getitem__", None)
    np.testing.assert_array_equal(io.read(path, channel="a").samples, A)


def test_a_part_of_one_large_chunk_reads_no_more_than_the_part(tmp_path, monkeypatch):
    path = write(tmp_path, segment({"a": np.arange(100_000.0), "b": np.zeros(100_000)}))
    asked = []
    original = np.empty

    def counting(shape, *rest, **options):
        asked.append(int(np.prod(shape)))
        return original(shape, *rest, **options)

    monkeypatch.setattr(np, "empty", counting)
    part = io.read(path, channel="a", start=50, stop=50.01)
    np.testing.assert_array_equal(part.samples, np.arange(50_000, 50_010))
    assert max(asked) <= 100


def test_files_whose_layout_is_not_plain_are_left_to_npTDMS(tmp_path, monkeypatch):
    path = write(tmp_path, segment({"a": A, "b": B}))
    monkeypatch.setattr("impactsig.io.instruments.tdms.layout", lambda *arguments: None)
    np.testing.assert_array_equal(io.read(path, channel="b", start=0.002).samples, B[2:])


def test_scaled_counts(tmp_path):
    properties = {
        "wf_increment": 2e-5,
        "unit_string": "V",
        "NI_Number_Of_Scales": 1,
        "NI_Scaling_Status": "unscaled",
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.5,
        "NI_Scale[0]_Linear_Y_Intercept": 2.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }
    counts = np.arange(-5, 5, dtype=np.int16)
    path = written(tmp_path / "a.tdms", [{("rig", "cell"): counts}], **properties)
    rec = io.read(path)
    assert (rec.rate, rec.unit, rec.channels) == (50_000.0, "V", ("rig/cell",))
    assert rec.samples.dtype == np.float64
    np.testing.assert_array_equal(rec.samples, counts * 0.5 + 2)


def test_times_of_the_waveform(tmp_path):
    path = written(
        tmp_path / "a.tdms",
        [{("g", "a"): A}],
        wf_increment=0.5,
        wf_start_offset=3.0,
        wf_start_time=np.datetime64("2024-02-29T12:00:00.250000"),
    )
    rec = io.read(path, start=4, stop=5)
    assert rec.recorded_at == datetime(2024, 2, 29, 12, 0, 0, 250_000, tzinfo=UTC)
    assert rec.start == 4.0
    np.testing.assert_array_equal(rec.samples, A[2:4])


def test_a_channel_by_full_name_by_short_name_and_by_index(tmp_path):
    path = written(
        tmp_path / "a.tdms",
        [{("left", "load"): A, ("right", "load"): B, ("right", "temperature"): A + 1}],
        wf_increment=0.1,
    )
    np.testing.assert_array_equal(io.read(path, channel="right/load").samples, B)
    np.testing.assert_array_equal(io.read(path, channel="temperature").samples, A + 1)
    np.testing.assert_array_equal(io.read(path, channel=1).samples, B)
    with pytest.raises(InvalidInput, match="'left/load', 'right/load'"):
        io.read(path, channel="load")
    with pytest.raises(InvalidInput, match="2: 'right/temperature'"):
        io.read(path, channel="pressure")


def test_groups_of_two_rates_load_the_larger(tmp_path):
    path = write(
        tmp_path,
        segment({"slow": A[:3]}, increment=0.1),
        segment({"a": A, "b": B}, increment=0.001),
    )
    with pytest.warns(ImpactsigWarning, match=r"'g/slow' \(3 samples at 10 Hz\)"):
        assert io.read(path).channels == ("g/a", "g/b")


def test_a_channel_of_times_gives_the_rate_of_its_group(tmp_path):
    path = written(tmp_path / "a.tdms", [{("g", "Time"): np.arange(12) / 8 + 1, ("g", "a"): A}])
    rec = io.read(path)
    assert (rec.rate, rec.start, rec.channels) == (8.0, 1.0, ("g/a",))
    path = written(tmp_path / "b.tdms", [{("g", "a"): A}])
    with pytest.raises(InvalidInput, match="no wf_increment"):
        io.read(path)
    assert io.read(path, rate=3).rate == 3.0


def test_a_spectrum_has_no_rate(tmp_path):
    path = written(tmp_path / "a.tdms", [{("g", "a"): A}], wf_increment=0.5, wf_xunit_string="Hz")
    with pytest.raises(InvalidInput, match="an axis in 'Hz'"):
        io.read(path)


def test_text_channels_are_left_out_and_told(tmp_path):
    path = written(
        tmp_path / "a.tdms",
        [{("g", "a"): A, ("g", "remarks"): np.array(["x", "y"])}],
        wf_increment=0.1,
    )
    with pytest.warns(ImpactsigWarning, match="'g/remarks' is left out"):
        assert io.read(path).channels == ("g/a",)


def test_a_file_cut_short_is_told_and_nothing_is_printed(tmp_path, capfd, caplog):
    content = segment({"a": A, "b": B}, interleaved=True, chunks=3)
    path = write(tmp_path, content[: -16 * 5])  # the last 5 of 12 rows of two numbers
    # Of three chunks of 4 rows one is whole, and one has 3.
    words = "cut short: its last chunk holds 3 of 4 samples of /'g'/'a'"
    with pytest.warns(ImpactsigWarning, match=words):
        rec = io.read(path)
    assert rec.truncated is True
    assert io.info(path).truncated is True
    np.testing.assert_array_equal(rec.samples, np.column_stack([A, B])[:7])
    assert capfd.readouterr().err == ""
    assert not [r for r in caplog.records if r.levelno >= logging.WARNING]


def test_a_last_chunk_with_a_part_of_each_channel(tmp_path):
    full = segment({"a": A[:8], "b": B[:8]}, chunks=2)
    # The second chunk keeps 2 of 4 samples of a channel, one channel after the other.
    end = len(full) - 64
    rest = full[end : end + 16] + full[end + 32 : end + 48]
    size = struct.unpack("<Q", full[12:20])[0] - 32
    short = full[:12] + struct.pack("<Q", size) + full[20:end] + rest
    path = write(tmp_path, short)
    with pytest.warns(ImpactsigWarning, match="holds 2 of 4 samples"):
        rec = io.read(path)
    np.testing.assert_array_equal(rec.samples, np.column_stack([A, B])[:6])
    rec = io.read(write(tmp_path, short, segment({"a": A, "b": B})))
    expected = np.column_stack([A, B])
    np.testing.assert_array_equal(rec.samples, np.vstack([expected[:6], expected]))


@pytest.mark.parametrize(
    "content",
    [b"TDSm", b"TDSm" + bytes(60), b"TDSm" + b"\xff" * 200, segment({"a": A})[:60]],
)
def test_corrupt_files_are_typed_errors(tmp_path, content):
    with pytest.raises(UnreadableFile):
        io.read(write(tmp_path, content))


def test_an_index_file_points_to_its_data(tmp_path):
    path = write(tmp_path, segment({"a": A}).replace(b"TDSm", b"TDSh"))
    with pytest.raises(UnreadableFile, match="index of a TDMS file"):
        io.read(path)


def test_a_header_that_claims_more_samples_than_bytes_is_not_believed(tmp_path):
    content = segment({"a": A})
    claimed = content.replace(struct.pack("<IIQ", 10, 1, 12), struct.pack("<IIQ", 10, 1, 1 << 50))
    assert claimed != content
    path = write(tmp_path, claimed)
    with pytest.warns(ImpactsigWarning, match="holds 12 of 1125899906842624 samples"):
        np.testing.assert_array_equal(io.read(path).samples, A)


def test_without_the_library_the_extra_is_named(tmp_path, monkeypatch):
    path = write(tmp_path, segment({"a": A}))
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(MissingExtra, match=r'pip install "impactsig\[daq\]"'):
        io.read(path)
