"""ASAM's measurement data, written by asammdf."""

import sys

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, MissingExtra, UnreadableFile

asammdf = pytest.importorskip("asammdf")

T = np.arange(500) / 2000
A = np.random.default_rng(32).integers(-30_000, 30_000, 500).astype(np.int16)
VERSIONS = pytest.mark.parametrize("version", ["2.14", "3.30", "4.10", "4.20"])


def write(path, *groups, version="4.10"):
    """Write groups of (name, samples, times, options)."""
    with asammdf.MDF(version=version) as file:
        for group in groups:
            columns = [asammdf.Signal(x, t, name=name, **more) for name, x, t, more in group]
            file.append(columns, common_timebase=True)
        return file.save(path, overwrite=True)


@VERSIONS
def test_scaled_integers_and_floats_side_by_side(tmp_path, version):
    scale = {"conversion": {"a": 0.25, "b": -3.0}, "unit": "N"}
    b = np.cos(T)
    path = write(
        tmp_path / "a.mf4", [("a", A, T, scale), ("b", b, T, {"unit": "V"})], version=version
    )
    rec = io.read(path)
    assert (rec.rate, rec.channels, rec.units) == (2000.0, ("a", "b"), ("N", "V"))
    np.testing.assert_array_equal(rec.samples, np.column_stack([0.25 * A - 3.0, b]))
    part = io.read(path, "b", start=0.1, stop=0.2)
    np.testing.assert_array_equal(part.samples, b[200:400])


@VERSIONS
def test_groups_of_different_rates(tmp_path, version):
    slow = np.arange(50) / 100 + 1.5
    path = write(tmp_path / "a.mf4", [("a", A, T, {})], [("a", A[:50], slow, {})], version=version)
    with pytest.warns(ImpactsigWarning, match="left out: 'group 1/a' .50 samples at 100 Hz"):
        assert io.read(path).channels == ("group 0/a",)
    rec = io.read(path, "group 1/a")
    assert (rec.rate, rec.start, rec.samples.dtype) == (pytest.approx(100), 1.5, np.float32)
    np.testing.assert_array_equal(rec.samples, A[:50])


def test_uneven_times_leave_no_rate(tmp_path):
    uneven = T + np.where(np.arange(500) > 300, 0.01, 0.0)
    path = write(tmp_path / "a.mf4", [("a", A, uneven, {})])
    with pytest.raises(InvalidInput, match="time column is not uniform"):
        io.read(path)
    assert len(io.read(path, rate=2000)) == 500


def test_samples_that_are_not_valid_are_missing(tmp_path):
    bad = np.zeros(500, bool)
    bad[100:110] = True
    path = write(tmp_path / "a.mf4", [("a", A, T, {"invalidation_bits": bad})])
    np.testing.assert_array_equal(io.read(path).samples, np.where(bad, np.nan, A))


def test_formulas_and_words_are_not_followed(tmp_path):
    formula = {"conversion": {"formula": "X1 ** 2"}}
    words = {"conversion": {"val_0": 0, "text_0": b"off", "val_1": 1, "text_1": b"on"}}
    group = [("a", A, T, {}), ("squared", A, T, formula), ("state", A % 2, T, words)]
    with pytest.warns(ImpactsigWarning, match="conversion by a formula, or to words") as told:
        rec = io.read(write(tmp_path / "a.mf4", group))
    assert rec.channels == ("a",)
    assert [w for w in told if "'squared'" in str(w.message)]
    with pytest.raises(UnreadableFile, match="'squared' is left out"):
        io.read(write(tmp_path / "b.mf4", group[1:]))


def test_a_file_over_the_limit_is_refused(tmp_path):
    path = write(tmp_path / "a.mf4", [("a", A, T, {})])
    with pytest.raises(UnreadableFile, match="would grow to"):
        io.read(path, limits=io.Limits(size=1000))


def test_what_asammdf_leaves_half_made_is_silent(tmp_path, capsys):
    path = write(tmp_path / "a.mf4", [("a", A, T, {})])
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(UnreadableFile, match="cannot be read as MDF"):
        io.read(path)
    assert capsys.readouterr() == ("", "")


def test_a_missing_library_names_the_extra(tmp_path, monkeypatch):
    path = write(tmp_path / "a.mf4", [("a", A, T, {})])
    monkeypatch.setitem(sys.modules, "asammdf", None)
    with pytest.raises(MissingExtra, match=r"impactsig\[mdf\]"):
        io.read(path)
