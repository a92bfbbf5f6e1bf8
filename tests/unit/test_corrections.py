"""Trains corrected by hand, and corrections kept beside a recording."""

from __future__ import annotations

import numpy as np
import pytest
import soundfile

from impactsig import (
    Impacts,
    InvalidInput,
    LoadCell,
    Recording,
    UnreadableFile,
    cli,
    detect_impacts,
    detect_many,
    synthesize,
)
from impactsig._trains.correction_files import COLUMNS
from impactsig.impacts import EDITED
from impactsig.report import analyse
from impactsig.report.contents import notes

RATE = 50_000
TRUE = 0.05 * np.arange(1, 19)


def train():
    return Impacts(
        [1.0, 2.0, 3.0],
        start=0.0,
        duration=4.0,
        peak=[1.0, 2.0, 3.0],
        time_error=[1e-6] * 3,
        shared_time_error=[1e-7] * 3,
        peak_error=[0.1] * 3,
        shared_peak_error=[0.05] * 3,
        probability=[0.9, 0.6, 0.9],
        settings={"threshold": 0.1},
    )


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.wav"
    record = synthesize(Impacts(TRUE, start=0.0, duration=1.0), LoadCell(noise=0.003), seed=1)
    soundfile.write(path, record.samples / 4, RATE, subtype="FLOAT")
    return path


@pytest.fixture
def corrected(rig):
    """A recording with a table of corrections beside it, and its train."""
    found = detect_impacts(rig, sensor="force")
    moved = {float(found.time[10]): 0.5512}
    changed = found.edit(reject=[found.time[3]], add=[0.123456789], move=moved, by="Bo")
    changed.write_corrections(rig)
    return rig, changed


def test_impacts_are_put_in_moved_and_taken_out():
    done = train().edit(add=[2.5], move={1.0004: 1.1}, reject=[2.0], by="Ann", comment="by ear")
    assert done.time.tolist() == [1.1, 2.5, 3.0]
    assert done.peak.tolist() == [1.0, 2.0, 3.0]  # put in: the mean of 1 and 3
    assert done.flags.tolist() == [EDITED, EDITED, 0]
    assert done.time_error.tolist() == [np.inf, np.inf, 1e-6]
    assert done.shared_time_error.tolist() == [0.0, 0.0, 1e-7]
    assert done.shared_peak_error.tolist() == [0.05, 0.0, 0.05]
    assert done.probability.tolist() == [1.0, 1.0, 0.9]
    assert done.settings["threshold"] == 0.1
    lines = done.settings["corrections"]
    assert [line["action"] for line in lines] == ["reject", "move", "add"]
    assert {(line["by"], line["comment"]) for line in lines} == {("Ann", "by ear")}
    assert len(done.edit(reject=[3.0]).settings["corrections"]) == 4
    alone = train().edit(reject=[1, 2, 3]).edit(add=[0.5])
    assert alone.time.tolist() == [0.5]
    assert alone.time_error.tolist() == [np.inf]


def test_what_cannot_be_corrected_is_named():
    with pytest.raises(InvalidInput, match=r"reject: got 2\.5 s.*nearest is at 2 s"):
        train().edit(reject=[2.5])
    with pytest.raises(InvalidInput, match="inside the run"):
        train().edit(add=[4.5])
    for wanted in ({"add": [2.0]}, {"move": {1.0: 2.0}}):
        with pytest.raises(InvalidInput, match="got 2 s; required: an instant at which"):
            train().edit(**wanted)
    assert train().edit(reject=[2.0], move={1.0: 2.0}).time.tolist() == [2.0, 3.0]
    with pytest.raises(InvalidInput, match="instant of an impact"):
        Impacts([], duration=1.0, start=0.0).edit(move={0.5: 0.6})
    with pytest.raises(InvalidInput, match=r"add: got 1\.5; required: several instants"):
        train().edit(add=1.5)
    with pytest.raises(InvalidInput, match="several instants"):
        train().edit(reject="2.0")
    with pytest.raises(InvalidInput, match="mapping of instants"):
        train().edit(move=[(1.0, 1.1)])
    with pytest.raises(InvalidInput, match="by: got 7; required: text"):
        train().edit(by=7)


def test_corrections_beside_a_recording_are_made_again(corrected):
    rig, changed = corrected
    again = detect_impacts(rig, sensor="force")
    np.testing.assert_array_equal(again.time, changed.time)
    assert again.settings["corrections"] == changed.settings["corrections"]
    np.testing.assert_array_equal(detect_impacts(rig, sensor="force", channel=0).time, changed.time)
    np.testing.assert_array_equal(again.apply_corrections(rig).time, changed.time)  # not twice
    changed.write_corrections(rig)
    table = rig.with_name("rig.wav.corrections.csv").read_text().splitlines()
    assert table[0].split(",") == list(COLUMNS)
    assert len(table) == 4


def test_a_renamed_recording_says_that_its_corrections_stayed_behind(corrected, capsys):
    rig, changed = corrected
    renamed = rig.rename(rig.with_name("shaker.wav"))
    found = detect_impacts(renamed, sensor="force")
    assert len(found) == len(TRUE)
    (note,) = found.notes
    assert "rig.wav.corrections.csv has 3 corrections of this recording" in note
    assert found.apply_corrections(renamed).notes == (note,)
    assert cli.main(["detect", str(renamed), "--sensor", "force"]) == 0
    assert note in capsys.readouterr().err
    (rig.parent / "rig.wav.corrections.csv").rename(rig.parent / "shaker.wav.corrections.csv")
    found = detect_impacts(renamed, sensor="force")
    np.testing.assert_array_equal(found.time, changed.time)
    assert not found.notes


def test_tables_of_other_recordings_are_no_ones_corrections(corrected):
    """Those of a recording of other content, of one that is there, and damaged ones."""
    rig, _ = corrected
    copy = rig.with_name("copy.wav")
    copy.write_bytes(rig.read_bytes())
    assert not detect_impacts(copy, sensor="force").notes
    rig.unlink()
    rig.with_name("broken.wav.corrections.csv").write_text("no table")
    samples, rate = soundfile.read(copy)
    soundfile.write(rig.with_name("other.wav"), 0.5 * samples, rate, subtype="FLOAT")
    assert not detect_impacts(rig.with_name("other.wav"), sensor="force").notes


def test_two_people_who_correct_one_train_keep_both_their_corrections(rig):
    found = detect_impacts(rig, sensor="force")
    for by, wrong in (("Ann", 3), ("Bo", 7)):  # Bo has not read what Ann wrote
        found.edit(reject=[found.time[wrong]], by=by).write_corrections(rig)
    again = detect_impacts(rig, sensor="force")
    np.testing.assert_array_equal(again.time, np.delete(found.time, [3, 7]))
    assert [line["by"] for line in again.settings["corrections"]] == ["Ann", "Bo"]
    # Both took out the same one: the second cannot, and says so once.
    found.edit(reject=[found.time[3]], by="Cy").write_corrections(rig)
    again = detect_impacts(rig, sensor="force")
    assert len(again) == len(found) - 2
    assert len(again.apply_corrections(rig).notes) == len(again.notes) == 1


def test_corrections_are_not_put_beside_those_of_another_recording(corrected):
    rig, changed = corrected
    soundfile.write(rig, np.zeros(RATE), RATE)
    with pytest.raises(UnreadableFile, match="another recording"):
        changed.write_corrections(rig)


def test_reports_and_commands_make_them_and_say_so(corrected, tmp_path, capsys):
    rig, changed = corrected
    analysis = analyse(rig, sensor="force")
    np.testing.assert_array_equal(analysis.impacts.time, changed.time)
    day = changed.settings["corrections"][0]["at"][:10]
    said = f"1 added, 1 moved, 1 rejected by Bo, {day}"
    assert f"Corrected by hand: {said}." in analysis.summary()
    assert any("2 of 18 impacts flagged: edited" in note for note in notes(analysis))
    many = detect_many([rig], sensor="force", workers=1)
    np.testing.assert_array_equal(many.impacts[rig].time, changed.time)
    table = tmp_path / "table.csv"
    assert cli.main(["detect", str(rig), "--sensor=force", "-o", str(table)]) == 0
    assert f"corrections: {said}" in capsys.readouterr().err
    np.testing.assert_array_equal(Impacts.read_csv(table).time, changed.time)


def test_what_lies_outside_of_the_span_read_stays_in_the_table(corrected):
    rig, changed = corrected
    part = analyse(rig, sensor="force", start=0.3).impacts
    made = [line["made"] for line in part.settings["corrections"]]
    assert made == [False, True, False]
    assert not part.notes
    part.write_corrections(rig)
    np.testing.assert_array_equal(detect_impacts(rig, sensor="force").time, changed.time)


def test_corrections_that_name_no_impact_are_told(corrected):
    rig, _ = corrected
    found = detect_impacts(rig, sensor="force", threshold=100.0)  # finds none
    assert found.time.tolist() == [0.123456789]
    assert any("2 of 3 corrections in rig.wav.corrections.csv name no" in n for n in found.notes)


def test_corrections_of_another_recording_are_refused(corrected):
    rig, _ = corrected
    soundfile.write(rig, np.zeros(RATE), RATE, subtype="FLOAT")
    with pytest.raises(UnreadableFile, match=r"another recording: rig.wav has changed.*Move"):
        detect_impacts(rig, sensor="force")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("action,time\nmove,nowhere\n", "it has no column 'channel'"),
        ("channel;action;time;to\n;add;1;\n", "it has no column 'channel'"),
        ("", "it has no column 'channel'"),
        ("channel,action,time,to\n,delete,1,\n", "line 2: action 'delete' is none of add, move"),
        ("channel,action,time,to\n,move,1,\n", "line 2: move needs an instant in the column 'to'"),
        ("channel,action,time,to\n,add,1,2\n", "line 2: add takes no instant"),
        ("channel,action,time,to\n,add,,\n", "line 2: the column 'time' is empty"),
        ("channel,action,time,to\n,add,1,\n,add,0.7", "line 3 has another number of cells"),
        ("channel,action,time,to\n,add,nan,\n", "line 2: time 'nan' is not a finite number"),
        ("channel,action,time,to\n,add,\"0,25\",\n", "time '0,25' is not a finite number"),
        (b"\xff\xfe\x00", "not a table of corrections"),
    ],
)  # fmt: skip
def test_a_table_that_is_damaged_says_where(tmp_path, text, told):
    path = tmp_path / "a.wav"
    table = tmp_path / "a.wav.corrections.csv"
    table.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(UnreadableFile, match="move it away") as raised:
        train().apply_corrections(path)
    assert told in str(raised.value)


def test_a_table_written_by_hand(tmp_path):
    path = tmp_path / "a.wav"
    table = tmp_path / "a.wav.corrections.csv"
    table.write_text(
        "\ufeffchannel,action,time,to\n,add,0.5,\n\n,move,1.0,1.2\nb,add,3.5,\n", "utf-8"
    )
    done = train().apply_corrections(path)
    assert done.time.tolist() == [0.5, 1.2, 2.0, 3.0]
    with pytest.raises(UnreadableFile, match="cannot be read"):
        done.write_corrections(path)  # there is no such recording


def test_corrections_of_a_channel_hold_for_the_train_of_several(tmp_path):
    path = tmp_path / "two.wav"
    truth = Impacts(np.cumsum(0.04 + 0.02 * np.sin(np.arange(20.0) ** 2)), start=0.0, duration=1.0)
    cells = [synthesize(truth, LoadCell(noise=0.003), seed=own).samples / 4 for own in (0, 1)]
    soundfile.write(path, np.column_stack(cells), RATE, subtype="FLOAT")
    options = {"sensor": "force", "channel": [0, 1]}
    left = detect_impacts(path, sensor="force", channel=0)
    left.edit(add=[0.0123], by="Bo").write_corrections(path)
    both = detect_impacts(path, **options)
    assert both.time[0] == 0.0123
    both.edit(reject=[both.time[4]], by="Cy").write_corrections(path)
    again = detect_impacts(path, **options)
    assert len(again) == len(both) - 1
    assert again.time[0] == 0.0123
    record = Recording(np.column_stack(cells), RATE, channels=("channel 1", "channel 2"))
    assert len(detect_impacts(record, channel=[0, 1])) == len(truth)
