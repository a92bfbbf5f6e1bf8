"""Recordings of enDAQ's loggers, written by the library that their maker keeps."""

import logging
import subprocess
import sys
from datetime import UTC, datetime

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, MissingExtra, UnreadableFile

from ..files import write_ide

pytest.importorskip("idelib")

X = np.random.default_rng(31).integers(-32_000, 32_000, (730, 2)).astype(np.int16)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.ide"


def test_samples_rate_units_and_time(path):
    write_ide(path, X, 5000, 100)
    rec = io.read(path)
    assert (rec.rate, rec.start, rec.units) == (5000.0, 0.0, ("N", "N"))
    assert rec.channels == ("force/a", "force/b")
    assert rec.recorded_at == datetime.fromtimestamp(1_600_000_000, UTC)
    np.testing.assert_array_equal(rec.samples, X)
    part = io.read(path, "b", start=0.02, stop=0.08)
    np.testing.assert_array_equal(part.samples, X[100:400, 1])


@pytest.mark.parametrize("form", ["<hh", ">hh"])
def test_a_polynomial_and_the_order_of_bytes(path, form):
    write_ide(path, X if form == "<hh" else X.byteswap(), 1000, 64, ChannelFormat=form)
    np.testing.assert_array_equal(io.read(path).samples, X)


def test_the_makers_own_file(shared_data):
    rec = io.read(shared_data("ide/test.ide"), "Main Acceleration/Acceleration: X")
    assert (rec.rate, len(rec), rec.units) == (1000.0, 1000, ("g",))
    np.testing.assert_array_equal(rec.samples, np.arange(1000))  # as the maker's tests have it


def test_a_rate_that_is_no_whole_number_is_that_of_the_stamps(path):
    write_ide(path, X, 3013.7, 100)
    assert io.read(path).rate == pytest.approx(3013.7, rel=1e-5)


def test_stamps_that_jitter_are_told(path):
    write_ide(path, X, 1000, 100, stamps={3: 400})
    with pytest.warns(ImpactsigWarning, match=r"up to 0.4 samples from a uniform grid .*t = 0.30"):
        rec = io.read(path)
    assert rec.rate == 1000.0


def test_a_lost_block_leaves_no_rate(path):
    write_ide(path, X, 1000, 100, lost=(2,))
    with pytest.raises(InvalidInput, match="Samples are missing, or the clock wanders"):
        io.read(path)
    assert len(io.read(path, rate=1000)) == 630


@pytest.mark.parametrize("scale", ["9**9**9", "1/(1", "sin(1)", "(().__class__)", "1,1"])
def test_scales_are_not_evaluated(path, scale):
    write_ide(path, X, 1000, 100, TimeCodeScale=scale)
    with pytest.raises(UnreadableFile, match=r"TimeCodeScale is .*, not a number or a ratio"):
        io.read(path)


def test_scales_as_recorders_write_them(path):
    for scale in ("1.0/1000000", "0.000001", "1 / 1000000"):
        write_ide(path, X, 1000, 100, TimeCodeScale=scale)
        assert io.read(path).rate == 1000.0


def test_the_logging_of_the_program_is_left_alone(path):
    write_ide(path, X, 1000, 100)
    words = f"import impactsig, logging; impactsig.read({str(path)!r}); "
    words += "print(logging.getLogger().handlers, logging.root.manager.disable)"
    told = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["[]", str(logging.NOTSET)]


def test_a_missing_library_names_the_extra(path, monkeypatch):
    write_ide(path, X, 1000, 100)
    monkeypatch.setitem(sys.modules, "idelib", None)
    with pytest.raises(MissingExtra, match=r"impactsig\[endaq\]"):
        io.read(path)
