"""NumPy files: mapped, never unpickled, sizes checked before they are believed."""

import zipfile

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

X = np.random.default_rng(2).standard_normal((400, 3))


def saved(path, array):
    np.save(path, array)
    return path


@pytest.mark.parametrize(
    ("dtype", "kept"),
    [
        (np.float64, np.float64),
        (np.float32, np.float32),
        (np.int16, np.float32),
        (np.uint8, np.float32),
        (np.int32, np.float64),
        (np.int64, np.float64),
        (">f8", np.float64),
        (bool, np.float32),
    ],
)
def test_npy_of_any_real_type(tmp_path, dtype, kept):
    array = (X[:, 0] * 100).astype(dtype)
    rec = io.read(saved(tmp_path / "a.npy", array), rate=1000)
    assert (rec.samples.dtype, rec.rate, rec.sensor) == (kept, 1000.0, "force")
    np.testing.assert_array_equal(rec.samples, array)


@pytest.mark.parametrize("array", [X, X.T, np.asfortranarray(X)])
def test_time_runs_along_the_longer_axis(tmp_path, array):
    path = saved(tmp_path / "a.npy", array)
    rec = io.read(path, rate=10)
    np.testing.assert_array_equal(rec.samples, X)
    assert rec.channels == ("channel 0", "channel 1", "channel 2")
    np.testing.assert_array_equal(io.read(path, "channel 2", 5, 6, rate=10).samples, X[50:60, 2])


def test_npy_needs_a_rate(tmp_path):
    path = saved(tmp_path / "a.npy", X)
    with pytest.raises(InvalidInput, match="carries no sampling rate; give rate="):
        io.read(path)
    assert [c.rate for c in io.info(path).channels] == [None] * 3
    assert "rate unknown" in repr(io.info(path))


class Trap:
    """Marks its class when unpickled."""

    sprung = False

    def __setstate__(self, state):
        Trap.sprung = True

    def __getstate__(self):
        return {"x": 1}


def test_objects_are_refused_and_never_unpickled(tmp_path):
    array = np.array([Trap(), Trap()], dtype=object)
    path = saved(tmp_path / "a.npy", array)
    np.load(path, allow_pickle=True)
    assert Trap.sprung  # the trap works
    Trap.sprung = False
    with pytest.raises(UnreadableFile, match="Python objects, which are never unpickled"):
        io.read(path, rate=1)
    np.savez(tmp_path / "a.npz", force=array, rate=5.0)
    with pytest.raises(UnreadableFile, match="'force' is left out: it holds Python objects"):
        io.read(tmp_path / "a.npz")
    assert not Trap.sprung


@pytest.mark.parametrize(
    ("array", "reason"),
    [
        (np.zeros(4, complex), "complex"),
        (np.zeros((2, 2, 2)), "3 dimensions"),
        (np.array(1.0), "0 dimensions"),
        (np.array(["a", "b"]), "not real numbers"),
        (np.zeros(4, [("t", float), ("x", float)]), "not real numbers"),
        (np.zeros(0), "no samples"),
    ],
)
def test_arrays_that_are_no_recording(tmp_path, array, reason):
    with pytest.raises(UnreadableFile, match=reason):
        io.read(saved(tmp_path / "a.npy", array), rate=1)


def test_npy_cut_short(tmp_path):
    path = saved(tmp_path / "a.npy", X)
    path.write_bytes(path.read_bytes()[:-100])  # 100 bytes are 4 rows of 24 and a part of a fifth
    with pytest.warns(ImpactsigWarning, match="cut short: 5 of its 400 rows are missing"):
        rec = io.read(path, rate=1)
    assert rec.truncated is True
    np.testing.assert_array_equal(rec.samples, X[:395])


def test_npy_that_claims_terabytes_is_read_as_far_as_it_goes(tmp_path):
    path = saved(tmp_path / "a.npy", X[:, 0])
    content = path.read_bytes().replace(b"(400,), }" + b" " * 16, b"(400000000000000,), }    ")
    assert b"400000000000000" in content
    path.write_bytes(content)
    with pytest.warns(ImpactsigWarning, match="399999999999600 of its 400000000000000 rows"):
        np.testing.assert_array_equal(io.read(path, rate=1).samples, X[:, 0])


def test_npz_channels_rate_and_time(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, force=X[:, 0], acceleration=X[:, 1], fs=2500, comment="warm")
    rec = io.read(path)
    assert (rec.rate, rec.channels) == (2500.0, ("force", "acceleration"))
    np.testing.assert_array_equal(rec.samples, X[:, :2])
    np.savez_compressed(path, pair=X, t=2.0 + np.arange(400) / 50_000)
    rec = io.read(path)
    assert (rec.rate, rec.start, rec.channels) == (50_000.0, 2.0, ("pair 0", "pair 1", "pair 2"))
    np.testing.assert_array_equal(rec.samples, X)


def test_npz_of_arrays_of_two_lengths_loads_the_larger_set(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, slow=X[:10, 0], a=X[:, 0], b=X[:, 1], rate=100.0)
    with pytest.warns(ImpactsigWarning, match=r"'slow' \(10 samples at 100 Hz\)"):
        rec = io.read(path)
    assert rec.channels == ("a", "b")
    np.testing.assert_array_equal(io.read(path, channel="slow").samples, X[:10, 0])


def test_npz_without_a_rate_or_with_an_impossible_one(tmp_path):
    np.savez(tmp_path / "a.npz", x=X[:, 0])
    with pytest.raises(InvalidInput, match="no scalar named fs or rate"):
        io.read(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", x=X[:, 0], rate=0.0)
    with pytest.raises(UnreadableFile, match="its rate is 0"):
        io.read(tmp_path / "b.npz")


def test_npz_that_would_grow_beyond_the_limits(tmp_path):
    path = tmp_path / "a.npz"
    np.savez_compressed(path, x=np.zeros(9 << 20), rate=1.0)  # 72 MiB, packed a thousandfold
    with pytest.raises(UnreadableFile, match=r"limit 200 times its size.*expansion="):
        io.read(path)
    assert not io.read(path, limits=io.Limits(expansion=2000)).samples.any()
    with pytest.raises(UnreadableFile, match=r"would grow to 0\.0755 GB.*limit 0\.07 GB.*size="):
        io.read(path, limits=io.Limits(size=70_000_000, expansion=2000))


def test_npz_whose_array_header_lies_is_refused_before_it_is_allocated(tmp_path):
    np.save(tmp_path / "x.npy", X[:, 0])
    content = (tmp_path / "x.npy").read_bytes()
    content = content.replace(b"(400,), }" + b" " * 16, b"(400000000000000,), }    ")
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("x.npy", content)
    with pytest.raises(UnreadableFile, match="announces 3200000000000000 bytes"):
        io.read(tmp_path / "a.npz", rate=1)


def test_npz_cut_short_is_an_error(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, x=X, rate=1.0)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(UnreadableFile, match="cannot be read as NumPy npz") as caught:
        io.read(path)
    assert isinstance(caught.value.__cause__, zipfile.BadZipFile)


def test_npz_packed_otherwise_than_numpy_packs_is_refused(tmp_path):
    np.save(tmp_path / "x.npy", X)
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_LZMA) as archive:
        archive.write(tmp_path / "x.npy", "x.npy")
    with pytest.raises(UnreadableFile, match=r"x\.npy is packed in a way .* \(number 14\)"):
        io.read(tmp_path / "a.npz", rate=1)
