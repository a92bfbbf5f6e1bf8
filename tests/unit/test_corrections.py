"""Trains corrected by hand, and corrections kept beside a recording."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import Impacts, InvalidInput, LoadCell, UnreadableFile, detect_impacts, synthesize
from impactsig.impacts import EDITED


def train():
    return Impacts(
        [1.0, 2.0, 3.0],
        start=0.0,
        duration=4.0,
        peak=[1.0, 2.0, 3.0],
        time_error=[1e-6] * 3,
        probability=[0.9, 0.6, 0.9],
        settings={"threshold": 0.1},
    )


def test_impacts_are_put_in_moved_and_taken_out():
    done = train().edit(add=[2.5], move={1.0004: 1.1}, reject=[2.0], by="Ann", comment="by ear")
    assert done.time.tolist() == [1.1, 2.5, 3.0]
    assert done.peak.tolist() == [1.0, 2.0, 3.0]  # put in: the mean of 1 and 3
    assert done.flags.tolist() == [EDITED, EDITED, 0]
    assert done.time_error.tolist() == [np.inf, np.inf, 1e-6]
    assert done.probability.tolist() == [1.0, 1.0, 0.9]
    assert done.settings["threshold"] == 0.1
    lines = done.settings["corrections"]
    assert [line["action"] for line in lines] == ["reject", "move", "add"]
    assert {(line["by"], line["comment"]) for line in lines} == {("Ann", "by ear")}
    assert len(done.edit(reject=[3.0]).settings["corrections"]) == 4
    assert train().edit(reject=[1, 2, 3]).edit(add=[0.5]).time.tolist() == [0.5]


def test_what_cannot_be_corrected_is_named():
    with pytest.raises(InvalidInput, match=r"reject: got 2\.5 s"):
        train().edit(reject=[2.5])
    with pytest.raises(InvalidInput, match="inside the run"):
        train().edit(add=[4.5])
    with pytest.raises(InvalidInput, match="instant of an impact"):
        Impacts([], duration=1.0, start=0.0).edit(move={0.5: 0.6})


def test_corrections_beside_a_recording_are_made_again(tmp_path):
    import soundfile

    path = tmp_path / "rig.wav"
    truth = Impacts(0.05 * np.arange(1, 19), start=0.0, duration=1.0)
    record = synthesize(truth, LoadCell(noise=0.003), seed=1)
    soundfile.write(path, record.samples / 4, 50_000, subtype="FLOAT")
    found = detect_impacts(path, sensor="force")
    assert len(found) == 18
    changed = found.edit(reject=[found.time[3]], add=[0.123456789], by="Bo")
    table = changed.write_corrections(path)
    assert table.name == "rig.wav.corrections.csv"
    again = detect_impacts(path, sensor="force")
    np.testing.assert_array_equal(again.time, changed.time)
    assert again.settings["corrections"] == changed.settings["corrections"]
    other = detect_impacts(path, sensor="force", channel=0)
    np.testing.assert_array_equal(other.time, changed.time)
    changed.write_corrections(path)  # not twice
    assert len(table.read_text().splitlines()) == 3
    table.write_text("action,time\nmove,nowhere\n")
    with pytest.raises(UnreadableFile, match="table of corrections"):
        detect_impacts(path, sensor="force")
