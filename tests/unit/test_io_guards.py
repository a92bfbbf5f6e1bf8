"""What a file from a stranger must not do, beside what the tests of its format hold it to."""

import os
import pickle
import struct

import numpy as np
import pytest
import soundfile

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

X = np.random.default_rng(16).integers(-9000, 9000, 400).astype(np.int16)


@pytest.mark.parametrize("ending", [".pkl", ".joblib", ".npy", ".mat", ".h5", ".csv"])
@pytest.mark.parametrize("protocol", [0, 2, 5])
def test_pickles_are_never_loaded_under_any_name(tmp_path, ending, protocol):
    sprung = tmp_path / "sprung"

    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(sprung),)

    path = tmp_path / f"a{ending}"
    path.write_bytes(pickle.dumps([Trap(), 1.0, 2.0], protocol))
    with pytest.raises((UnreadableFile, InvalidInput)):
        io.read(path)
    assert not sprung.exists()
    pickle.loads(path.read_bytes())
    assert sprung.exists()  # the trap works


def test_a_flac_header_that_claims_half_a_terabyte(tmp_path):
    path = tmp_path / "a.flac"
    soundfile.write(str(path), X, 8000)
    content = bytearray(path.read_bytes())
    (packed,) = struct.unpack_from(">Q", content, 18)
    struct.pack_into(">Q", content, 18, packed | ((1 << 36) - 1))  # of its samples
    path.write_bytes(content)
    assert io.info(path).channels[0].length == (1 << 36) - 1
    with pytest.raises(UnreadableFile, match=r"would grow to 275 GB in memory \(limit"):
        io.read(path)


def test_a_wav_header_that_claims_gigabytes_is_read_as_far_as_it_goes(tmp_path):
    path = tmp_path / "a.wav"
    soundfile.write(str(path), X, 8000)
    content = bytearray(path.read_bytes())
    struct.pack_into("<I", content, 40, 0xFFFF_FF00)
    path.write_bytes(content)
    missing = 0xFFFF_FF00 - X.nbytes
    with pytest.warns(ImpactsigWarning, match=f"{missing} of the 4294967040 bytes of samples in"):
        rec = io.read(path)
    assert rec.truncated is True
    np.testing.assert_array_equal(rec.samples * 32768, X)


def test_a_silence_that_packs_well_is_no_bomb(tmp_path):
    path = tmp_path / "a.flac"
    soundfile.write(str(path), np.zeros(4_000_000, np.int16), 8000)
    assert 200 * path.stat().st_size < 16_000_000
    assert not io.read(path).samples.any()


def test_a_long_silence_needs_a_word_or_goes_through_in_blocks(tmp_path):
    path = tmp_path / "a.flac"
    with soundfile.SoundFile(path, "w", 48_000, 1) as file:
        for _ in range(20):
            file.write(np.zeros(1_000_000, np.int16))
    with pytest.raises(UnreadableFile, match=r"limit 200 times its size.*Limits\(expansion="):
        io.read(path)
    assert len(io.read(path, limits=io.Limits(expansion=1e5))) == 20_000_000
    assert sum(len(block) for block in io.read_blocks(path, 100.0)) == 20_000_000


@pytest.mark.parametrize("options", [{"size": 0}, {"expansion": -1}, {"size": float("nan")}])
def test_limits_that_are_none(options):
    with pytest.raises(InvalidInput, match=r"limits\.(size|expansion)"):
        io.Limits(**options)


# -- raw binary --------------------------------------------------------------------------------


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("dtype", ["int16", "uint8", "float32", "float64", "int32"])
def test_raw_numbers(tmp_path, dtype, order):
    path = tmp_path / "a.bin"
    values = np.abs(X.reshape(-1, 2) // 100)
    stored = values.astype(np.dtype(dtype).newbyteorder(order))
    path.write_bytes(b"header!" + stored.tobytes())
    layout = io.RawLayout(dtype, channels=2, byte_order=order, skip=7)
    np.testing.assert_array_equal(io.read(path, rate=100, raw=layout).samples, values)
    part = io.read(path, 1, 0.5, 0.7, rate=100, raw=layout)
    np.testing.assert_array_equal(part.samples, values[50:70, 1])
    assert io.info(path, raw=layout).channels[1].length == 200
    with pytest.raises(InvalidInput, match="Raw numbers carry no sampling rate; give rate="):
        io.read(path, raw=layout)


def test_a_raw_row_that_is_cut_is_told(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(X.tobytes()[:-1])
    with pytest.warns(ImpactsigWarning, match="its last row has 3 of 4 bytes"):
        rec = io.read(path, rate=1, raw=io.RawLayout("int16", 2))
    assert rec.truncated is True
    np.testing.assert_array_equal(rec.samples, X.reshape(-1, 2)[:-1])
    with pytest.raises(UnreadableFile, match="contains no row of 2 x int16 in the 0 bytes after"):
        io.read(path, rate=1, raw=io.RawLayout("int16", 2, skip=5000))


@pytest.mark.parametrize(
    ("given", "argument"),
    [
        ({"dtype": "nonsense"}, "dtype"),
        ({"dtype": "complex64"}, "dtype"),
        ({"dtype": "i2,i2"}, "dtype"),
        ({"dtype": object}, "dtype"),
        ({"dtype": None}, "dtype"),
        ({"dtype": "int16", "channels": 0}, "channels"),
        ({"dtype": "int16", "channels": 1.5}, "channels"),
        ({"dtype": "int16", "skip": -1}, "skip"),
        ({"dtype": "int16", "byte_order": "middle"}, "byte_order"),
    ],
)
def test_layouts_that_are_none(given, argument):
    with pytest.raises(InvalidInput, match=rf"raw\.{argument}"):
        io.RawLayout(**given)


def test_a_layout_that_is_a_text_is_told_what_it_should_be(tmp_path):
    (tmp_path / "a.bin").write_bytes(X.tobytes())
    with pytest.raises(InvalidInput, match=r'raw=impactsig\.RawLayout\("int16"\)'):
        io.read(tmp_path / "a.bin", rate=1, raw="int16")


@pytest.mark.parametrize("start", [1e200, -1e200, 1e308])
def test_times_too_far_for_their_steps_are_the_files_fault(tmp_path, start):
    np.savez(tmp_path / "a.npz", x=np.ones(100), fs=1000.0, t_start=start)
    with pytest.raises(UnreadableFile, match=r"begin at .* no clock tells them apart"):
        io.read(tmp_path / "a.npz")


def test_steps_of_no_length_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", x=np.ones(100), fs=1e-308)
    with pytest.raises(UnreadableFile, match="no clock tells them apart"):
        io.read(tmp_path / "a.npz")
