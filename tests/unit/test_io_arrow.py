"""Parquet and Feather recordings, which are not the tables of impacts that are Parquet too."""

import numpy as np
import pytest

import impactsig
import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

pa = pytest.importorskip("pyarrow")
from pyarrow import feather, parquet  # noqa: E402

X = np.random.default_rng(10).standard_normal((1000, 2))
T = 5 + np.arange(1000) / 8000


def write_parquet(path, table, rows=300, **options):
    parquet.write_table(table, path, row_group_size=rows, **options)


def write_feather(path, table, rows=300, **options):
    feather.write_feather(table, path, chunksize=rows, **options)


WRITERS = {"a.parquet": write_parquet, "a.feather": write_feather}


@pytest.fixture(params=WRITERS)
def write(request, tmp_path):
    def write(table, **options):
        path = tmp_path / request.param
        WRITERS[request.param](path, pa.table(table), **options)
        return path

    return write


def test_columns_of_numbers_and_a_column_of_times(write):
    path = write({"time": T, "Force [N]": X[:, 0], "acc": X[:, 1], "note": ["x"] * 1000})
    with pytest.warns(ImpactsigWarning, match="column 'note' is left out: it holds string"):
        rec = io.read(path)
    assert (rec.rate, rec.start) == (8000.0, 5.0)
    assert (rec.channels, rec.units) == (("Force [N]", "acc"), ("N", ""))
    np.testing.assert_array_equal(rec.samples, X)
    with pytest.warns(ImpactsigWarning, match="note"):
        part = io.read(path, "Force", 5.03, 5.09)  # over three groups of rows
    np.testing.assert_array_equal(part.samples, X[240:720, 0])


def test_metadata_tells_rate_and_unit(write):
    schema = pa.schema(
        [pa.field("x", "float32", metadata={"unit": "mV"})], metadata={"sampling_rate": "2.5e3"}
    )
    path = write(pa.table({"x": X[:, 0].astype("f4")}, schema))
    rec = io.read(path)
    assert (rec.rate, rec.unit, rec.samples.dtype) == (2500.0, "mV", np.float32)


@pytest.mark.parametrize("dtype", ["int8", "uint16", "int32", "uint64", "float16", "bool"])
def test_any_real_type(write, dtype):
    values = (np.abs(X[:, 0]) * 50).astype(dtype)
    rec = io.read(write({"x": values}), rate=1)
    small = dtype in ("int8", "uint16", "float16", "bool")
    assert rec.samples.dtype == (np.float32 if small else np.float64)
    np.testing.assert_array_equal(rec.samples, values)


@pytest.mark.parametrize("kind", ["float64", "int32", "bool"])
def test_missing_values_are_gaps(write, kind):
    values = pa.array([1, None, 0] * 100).cast(kind)
    rec = io.read(write({"x": values}), rate=1)
    np.testing.assert_array_equal(rec.samples, [1, np.nan, 0] * 100)


def test_without_a_rate(write):
    with pytest.raises(InvalidInput, match="no column of times, and no rate or fs"):
        io.read(write({"x": X[:, 0]}))


def test_columns_without_numbers(write):
    with pytest.raises(UnreadableFile, match="holds string"):
        io.read(write({"x": ["a", "b"]}), rate=1)
    with pytest.raises(UnreadableFile, match="contains no array of samples"):
        io.read(write({"x": np.empty(0)}), rate=1)


def test_blocks_unpack_no_more_than_a_group(write):
    path = write({"a": X[:, 0], "b": X[:, 1]}, compression="zstd")
    blocks = io.read_blocks(path, 0.07, rate=1000)
    np.testing.assert_array_equal(np.concatenate([b.samples for b in blocks]), X)


def test_a_bomb_is_refused_before_it_is_unpacked(write):
    zeros = np.zeros(9 << 20)
    path = write({"x": zeros}, rows=1 << 30, compression="zstd")
    assert path.stat().st_size < 200_000
    for read in (io.read, lambda *a, **k: next(iter(io.read_blocks(*a, **k)))):
        with pytest.raises(UnreadableFile, match="limit 200 times its size"):
            read(path, rate=1)
    assert not io.read(path, rate=1, limits=io.Limits(expansion=1e5)).samples.any()


def test_cut_short_is_an_error(write):
    path = write({"x": X[:, 0]})
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(UnreadableFile, match="cannot be read as Parquet or Feather") as caught:
        io.read(path, rate=1)
    assert caught.value.__cause__ is not None


def test_feather_of_version_1_is_refused(tmp_path):
    path = tmp_path / "a.feather"
    path.write_bytes(b"FEA1" + bytes(100) + b"FEA1")
    with pytest.raises(UnreadableFile, match="first version of Feather"):
        io.read(path)


def test_a_table_of_impacts_is_no_recording(tmp_path):
    path = tmp_path / "a.parquet"
    impactsig.Impacts(time=np.array([1.0, 2.0])).to_parquet(path)
    with pytest.raises(UnreadableFile, match=r"table of impacts.*Impacts.read_parquet"):
        io.read(path)


def test_the_commands_tell_a_recording_from_impacts(tmp_path, capsys):
    from impactsig.cli import main

    recording, impacts = tmp_path / "rec.parquet", tmp_path / "imp.parquet"
    x = np.random.default_rng(1).standard_normal(40_000) * 0.01
    for start in (5000, 20_000, 30_000):
        x[start : start + 15] += np.sin(np.pi * np.arange(15) / 15)
    write_parquet(recording, pa.table({"t": np.arange(40_000) / 50_000, "x": x}))
    assert main(["detect", str(recording), "-o", str(impacts)]) in (0, None)
    assert len(impactsig.Impacts.read_parquet(impacts)) == 3
    assert main(["compare", str(recording), str(impacts)]) in (0, None)
    assert "3" in capsys.readouterr().out


@pytest.mark.parametrize(("unit", "rate"), [("ns", 44_100), ("us", 44_100), ("ms", 200), ("s", 1)])
@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_moments_are_times(write, unit, rate, zone):
    begin = np.datetime64("2024-05-06T07:08:09.25", unit)
    per = {"ns": 10**9, "us": 10**6, "ms": 1000, "s": 1}[unit]
    moments = begin + np.round(np.arange(1000) * per / rate).astype(f"m8[{unit}]")
    schema = pa.schema([("when", pa.timestamp(unit, zone)), ("x", "float64")])
    rec = io.read(write(pa.table({"when": moments, "x": X[:, 0]}, schema)))
    assert (rec.rate, rec.start, rec.channels) == (rate, 0.0, ("x",))
    assert rec.recorded_at.isoformat().startswith("2024-05-06T07:08:09")
    assert (rec.recorded_at.tzinfo is None) == (zone is None)
    np.testing.assert_array_equal(rec.samples, X[:, 0])


def test_durations_and_decimals(write):
    from decimal import Decimal

    times = pa.array((np.arange(1000) * 125_000).astype("m8[ns]"))
    places = pa.array([Decimal(k) / 8 for k in range(1000)], pa.decimal128(12, 3))
    rec = io.read(write({"t": times, "x": X[:, 0], "y": places, "rest": times}))
    assert (rec.rate, rec.channels, rec.units) == (8000.0, ("x", "y", "rest"), ("", "", "s"))
    np.testing.assert_array_equal(rec.samples[:, 1], np.arange(1000) / 8)
    np.testing.assert_allclose(rec.samples[:, 2], np.arange(1000) / 8000, rtol=1e-15)


def test_a_moment_that_is_missing_is_named(write):
    moments = np.datetime64("2024-05-06", "us") + np.arange(1000) * np.timedelta64(20, "us")
    moments[700] = np.datetime64("NaT")
    with pytest.raises(InvalidInput, match="no number in sample 700"):
        io.read(write({"time": moments, "x": X[:, 0]}))
