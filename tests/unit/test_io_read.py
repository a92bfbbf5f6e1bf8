"""What all formats have in common: choosing, calibrating, blocks, errors, the table of formats."""

import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
import soundfile

import impactsig.io as io
from impactsig.errors import ImpactsigError, ImpactsigWarning, InvalidInput, UnreadableFile
from impactsig.io import formats

from ..files import WRITERS

X = np.random.default_rng(3).integers(-1000, 1000, (300, 2)).astype(np.int16)


@pytest.fixture
def stereo(tmp_path):
    path = tmp_path / "a.wav"
    soundfile.write(str(path), X, 100)
    return path


def test_channel_by_name_index_and_digits(stereo):
    for which in (1, "channel 1", "1"):
        rec = io.read(stereo, channel=which)
        assert rec.channels == ("channel 1",)
        np.testing.assert_array_equal(rec.samples, X[:, 1] / 32768)
    assert io.read(stereo).samples.shape == (300, 2)


@pytest.mark.parametrize("which", ["channel 7", 2, -1, 0.5, True])
def test_no_such_channel_lists_those_there_are(stereo, which):
    with pytest.raises(InvalidInput, match="channel") as caught:
        io.read(stereo, channel=which)
    if isinstance(which, (str, int)) and not isinstance(which, bool):
        assert "0: 'channel 0', 1: 'channel 1'" in str(caught.value)


def test_calibration(stereo):
    rec = io.read(stereo, scale=32768 * 0.5, offset=3, unit="N")
    np.testing.assert_array_equal(rec.samples, X * 0.5 + 3)
    assert rec.units == ("N", "N")
    blocks = io.read_blocks(stereo, 0.7, scale=32768 * 0.5, offset=3, unit="N")
    assert blocks.units == ("N", "N")
    np.testing.assert_array_equal(np.concatenate([b.samples for b in blocks]), rec.samples)


@pytest.mark.parametrize(
    "options",
    [
        {"scale": 0},
        {"scale": float("nan")},
        {"offset": float("inf")},
        {"rate": 0},
        {"rate": -5.0},
        {"start": 2.0, "stop": 1.0},
        {"start": 3.0},
        {"stop": float("nan")},
        {"sensor": "light"},
    ],
)
def test_unusable_arguments(stereo, options):
    for function in (io.read, io.read_blocks):
        with pytest.raises(InvalidInput, match="|".join(options)):
            function(stereo, **options)


@pytest.mark.parametrize("seconds", [0, -1, float("nan"), float("inf")])
def test_unusable_block_lengths(stereo, seconds):
    with pytest.raises(InvalidInput, match="seconds"):
        io.read_blocks(stereo, seconds)


def test_blocks_know_what_they_hold_and_can_be_gone_through_twice(stereo):
    blocks = io.read_blocks(stereo, 0.7, start=0.5, stop=2.5, rate=100)
    assert (blocks.samples, blocks.block_size, blocks.rate) == (200, 70, 100.0)
    assert (blocks.start, blocks.stop, blocks.duration) == (0.5, 2.5, 2.0)
    assert (blocks.channels, blocks.sensor) == (("channel 0", "channel 1"), "force")
    assert str(stereo) in repr(blocks)
    for _ in range(2):
        parts = list(blocks)
        assert [len(part) for part in parts] == [70, 70, 60]
        assert [part.start for part in parts] == pytest.approx([0.5, 1.2, 1.9])
        np.testing.assert_array_equal(
            np.concatenate([part.samples for part in parts]), X[50:250] / 32768
        )


def test_two_passes_at_the_same_time_do_not_disturb_each_other(stereo):
    blocks = io.read_blocks(stereo, 0.5)
    for one, other in zip(blocks, blocks, strict=True):
        np.testing.assert_array_equal(one.samples, other.samples)


def test_blocks_shorter_than_a_sample_hold_one_sample(stereo):
    assert [len(b) for b in io.read_blocks(stereo, 1e-6, stop=0.03)] == [1, 1, 1]


def test_a_file_that_shrinks_between_opening_and_reading_is_no_crash(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, X)
    blocks = io.read_blocks(path, 1.0, rate=100)
    path.unlink()
    with pytest.raises(UnreadableFile, match="no such file"):
        list(blocks)


def test_info(stereo):
    found = io.info(stereo)
    assert (found.format, found.bytes, found.truncated) == ("WAV", stereo.stat().st_size, False)
    assert found.channels[1] == io.ChannelInfo("channel 1", "", 100.0, 300)
    assert "1: channel 1; 300 samples; 100 Hz; 3 s" in repr(found)


@pytest.mark.parametrize("function", [io.read, io.read_blocks, io.info])
def test_files_that_cannot_be_opened(tmp_path, function):
    empty = tmp_path / "empty.wav"
    empty.touch()
    for path, reason in [
        (tmp_path / "none.wav", "no such file"),
        (tmp_path, "is a folder"),
        (empty, "is empty"),
        ("a\0b", "cannot be opened"),
        ("/dev/null", "not a regular file"),
    ]:
        with pytest.raises(UnreadableFile, match=reason):
            function(path)
    for nothing in (None, 5):
        with pytest.raises(InvalidInput, match="path"):
            function(nothing)


def test_a_file_without_permission(stereo, monkeypatch):
    def refuse(self, *rest, **options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refuse)
    with pytest.raises(UnreadableFile, match="Permission denied") as caught:
        io.read(stereo)
    assert isinstance(caught.value.__cause__, PermissionError)


def test_content_wins_over_the_name(tmp_path):
    np.save(tmp_path / "a.npy", X)
    path = (tmp_path / "a.npy").rename(tmp_path / "a.wav")
    assert io.info(path).format == "NumPy npy"
    (tmp_path / "b.npy").write_text("time,x\n0.0,1\n0.5,2\n")
    assert io.read(tmp_path / "b.npy").rate == 2.0


def test_a_name_that_the_content_belies(tmp_path):
    path = tmp_path / "a.wav"
    path.write_bytes(b"\x00\x01\x02\x03" * 50)
    with pytest.raises(UnreadableFile, match=r"named as audio .*, but its content is not"):
        io.read(path)
    path = path.rename(tmp_path / "a.xyz")
    with pytest.raises(UnreadableFile, match=r"no known format .*NI TDMS: \.tdms"):
        io.read(path)


def test_every_exception_of_a_reader_becomes_one_type_and_stays_chained(stereo, monkeypatch):
    for error in (MemoryError(), ZeroDivisionError("x"), KeyError("k"), RecursionError()):

        def fail(path, limits, error=error):
            raise error

        monkeypatch.setattr("impactsig.io.instruments.audio.open_source", fail)
        with pytest.raises(UnreadableFile, match=type(error).__name__) as caught:
            io.read(stereo)
        assert caught.value.__cause__ is error
        assert isinstance(caught.value, ImpactsigError)


def test_the_table_of_formats_is_consistent():
    extensions = [e for entry in formats.FORMATS for e in entry.extensions]
    assert len(extensions) == len(set(extensions))
    assert all(e == e.lower() and e.startswith(".") for e in extensions)
    assert all(bool(entry.library) == bool(entry.extra) for entry in formats.FORMATS)


def test_importing_the_readers_costs_nothing():
    heavy = "pandas soundfile scipy nptdms numba matplotlib zipfile"
    code = f"import sys, impactsig.io; print([m for m in {heavy.split()!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_rate_that_is_text_is_refused(stereo):
    with pytest.raises(InvalidInput, match="rate"):
        io.read(stereo, rate="100")


@pytest.mark.parametrize("read", [io.read, io.read_blocks])
def test_a_rate_that_contradicts_the_file_is_taken_with_a_warning(tmp_path, read):
    path = tmp_path / "a.wav"
    soundfile.write(str(path), X, 50_000)
    words = "a rate of 50000 Hz for 'channel 0'; rate=10 Hz is taken"
    with pytest.warns(ImpactsigWarning, match=words):
        assert read(path, rate=10).rate == 10.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read(path, rate=50_001).rate == 50_001.0
    soundfile.write(str(path), X[:, 0], 50_000)
    with pytest.warns(ImpactsigWarning, match="a rate of 50000 Hz; rate=10 Hz is taken instead"):
        read(path, rate=10)


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="names are Unicode there")
@pytest.mark.parametrize("name", WRITERS)
def test_a_name_that_is_no_utf8(tmp_path, name):
    path, options = WRITERS[name](tmp_path, X, 100)
    expected = io.read(path, **options)
    strange = path.rename(tmp_path / os.fsdecode(b"b\xff" + path.suffix.encode()))
    found = io.read(strange, **options)
    np.testing.assert_array_equal(found.samples, expected.samples)
