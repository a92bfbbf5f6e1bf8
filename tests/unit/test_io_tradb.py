"""Vallen's waveforms, written by Vallen's own library."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, UnreadableFile

from ..files import write_tradb

VOLTS = 1e-3 * 0.5
"""Of one count."""

X = np.random.default_rng(30).integers(-32_000, 32_000, (400, 2)).astype(np.int16)


def write(path, records, packed=False):
    """Write records (channel, ticks of 0.1 us, samples before, counts), at 1 MHz."""
    records = [(channel, ticks / 1e7, *rest) for channel, ticks, *rest in records]
    write_tradb(path, records, 1_000_000, VOLTS, packed)
    return path


def altered(path, *commands):
    with closing(sqlite3.connect(path)) as database:
        for command in commands:
            database.execute(command)
        database.commit()
    return path


@pytest.fixture(params=[False, True], ids=["counts", "flac"])
def packed(request):
    return request.param


def test_records_that_continue_each_other_are_one_signal(tmp_path, packed):
    records = [
        (channel, 10 * first, 0, X[first : first + 100, channel - 1])
        for first in range(0, 400, 100)
        for channel in (1, 2)
    ]
    path = write(tmp_path / "a.tradb", records, packed)
    rec = io.read(path)
    assert (rec.channels, rec.units, rec.rate) == (("channel 1", "channel 2"), ("V", "V"), 1e6)
    np.testing.assert_array_equal(rec.samples, X * VOLTS)
    part = io.read(path, "channel 2", start=150e-6, stop=250e-6)
    np.testing.assert_array_equal(part.samples, X[150:250, 1] * VOLTS)


def test_records_with_gaps_between_are_signals_of_their_own(tmp_path, packed):
    path = write(tmp_path / "a.tradb", [(3, 500, 20, X[:100, 0]), (3, 1510, 0, X[100:150, 0])])
    found = io.info(path).channels
    assert [(c.name, c.length) for c in found] == [
        ("channel 3/record 1", 100),
        ("channel 3/record 2", 50),
    ]
    rec = io.read(path, "channel 3/record 1")
    assert rec.start == pytest.approx(50e-6 - 20e-6, abs=1e-12)
    np.testing.assert_array_equal(rec.samples, X[:100, 0] * VOLTS)
    second = io.read(path, 1)
    assert second.start == pytest.approx(151e-6)
    np.testing.assert_array_equal(second.samples, X[100:150, 0] * VOLTS)


def test_vallens_own_recording_reads_as_their_library_reads_it(shared_data):
    vallenae = pytest.importorskip("vallenae")
    path = shared_data("impact/vallen_ae/sample.tradb")
    with vallenae.io.TraDatabase(str(path)) as file:
        for number in range(1, 5):
            volts, times = file.read_wave(number)
            record = file.read(trai=number, show_progress=False).iloc[0]
            rec = io.read(path, f"channel {record['channel']}")
            assert rec.rate == 5e6
            assert rec.start == pytest.approx(record["time"] + times[0], abs=1e-10)
            np.testing.assert_allclose(rec.samples, volts, rtol=1e-6)


def test_counts_without_a_scale_are_counts(tmp_path):
    path = write(tmp_path / "a.tradb", [(1, 0, 0, X[:, 0])])
    altered(path, "DELETE FROM tr_params")
    with pytest.warns(ImpactsigWarning, match="count of channel 1 is in volts"):
        rec = io.read(path)
    assert rec.units == ("",)
    np.testing.assert_array_equal(rec.samples, X[:, 0])


def test_a_record_that_is_cut_is_read_as_far_as_it_goes(tmp_path):
    path = write(tmp_path / "a.tradb", [(1, 0, 0, X[:, 0])])
    altered(path, "UPDATE tr_data SET Data = substr(Data, 1, 601)")
    with pytest.warns(ImpactsigWarning, match="record 1 holds 300 of 400 samples"):
        rec = io.read(path)
    assert rec.truncated
    np.testing.assert_array_equal(rec.samples, X[:300, 0] * VOLTS)


def test_hits_are_not_samples(shared_data):
    path = shared_data("impact/vallen_ae/sample.pridb")
    with pytest.raises(UnreadableFile, match=r"contains hits, not samples. Give the .tradb beside"):
        io.read(path)


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("UPDATE tr_data SET SampleRate = 0", "400 samples at 0 Hz"),
        ("UPDATE tr_data SET Samples = -1", "of -1 samples"),
        ("UPDATE tr_data SET Time = 'soon'", "not integers"),
        ("UPDATE tr_data SET DataFormat = 7", "packed in a way 7"),
        ("DELETE FROM tr_data", "contains no record"),
        ("UPDATE tr_globalinfo SET Value = 0 WHERE Key = 'TimeBase'", "time base is 0 ticks"),
        ("ALTER TABLE tr_data RENAME TO other", "no Vallen waveforms"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, command, told):
    path = altered(write(tmp_path / "a.tradb", [(1, 0, 0, X[:, 0])]), command)
    with pytest.raises(UnreadableFile, match=told):
        io.read(path)


def test_a_packed_record_may_not_claim_more_than_it_holds(tmp_path):
    path = write(tmp_path / "a.tradb", [(1, 0, 0, X[:, 0])], packed=True)
    altered(path, "UPDATE tr_data SET Samples = 401")
    with pytest.raises(UnreadableFile, match="packed with 400 samples of 1 channels"):
        io.read(path)
    altered(path, "UPDATE tr_data SET Samples = 1000000000000")
    with pytest.raises(UnreadableFile, match=r"would grow to 8e\+03 GB in memory"):
        io.read(path)


@pytest.mark.parametrize(
    "table",
    [
        "CREATE VIEW tr_data AS WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c) "
        "SELECT n AS SetID, 1 AS Chan FROM c",
        "CREATE TABLE tr_data (SetID INTEGER PRIMARY KEY, Chan INT, Time INT, SampleRate INT, "
        "Samples INT, Pretrigger INT, DataFormat INT, TRAI INT, ParamID INT, "
        "Data AS (zeroblob(100000000)))",
    ],
)
def test_a_schema_that_computes_is_not_followed(tmp_path, table):
    path = write(tmp_path / "a.tradb", [(1, 0, 0, X[:, 0])])
    altered(path, "DROP VIEW view_tr_data", "DROP TABLE tr_data", table)
    if table.startswith("CREATE TABLE"):
        altered(
            path,
            "INSERT INTO tr_data (Chan, Time, SampleRate, Samples, Pretrigger, DataFormat, TRAI) "
            "VALUES (1, 0, 1000, 50000000, 0, 0, 1)",
        )
    with pytest.raises(UnreadableFile):
        io.read(path)


def test_the_name_of_the_file_may_hold_what_an_address_uses(tmp_path):
    path = write(tmp_path / "a.tradb", [(1, 0, 0, X[:, 0])])
    odd = path.rename(tmp_path / "a?mode=rwc&x=%41 #1.tradb")
    assert len(io.read(odd)) == 400
