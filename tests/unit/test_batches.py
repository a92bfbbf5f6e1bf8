"""Many recordings at a time: as one by one, and one that is bad does not end the others."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import soundfile

from impactsig import (
    ImpactsigError,
    InvalidInput,
    UnreadableFile,
    UnwritableFile,
    cli,
    detect_impacts,
    detect_many,
    read,
    read_many,
    write_report,
    write_reports,
)
from impactsig.studies.each import each
from tests.cells import square

RATE = 20_000


def record(path, seed):
    """Half a second of pulses over noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(RATE // 2) / RATE
    samples = 1e-3 * rng.standard_normal(len(t))
    for touch in np.cumsum(rng.uniform(0.02, 0.04, 12)):
        u = (t - touch) / 5e-4
        samples += 0.5 * np.where((u > 0) & (u < 1), np.sin(np.pi * u), 0)
    soundfile.write(path, samples, RATE, subtype="PCM_24")
    return path


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """Seven recordings; the fourth is none, and two have one name."""
    folder = tmp_path_factory.mktemp("rig")
    (folder / "other").mkdir()
    names = ["a.wav", "b.wav", "c <b>.wav", "broken.wav", "d.wav", "other/c <b>.wav", "e.wav"]
    for seed, name in enumerate(names):
        record(folder / name, seed)
    (folder / "broken.wav").write_bytes(b"RIFF and no more")
    return [folder / name for name in names]


def good(rig):
    return [path for path in rig if path.name != "broken.wav"]


def test_recordings_come_in_order_with_the_reason_where_one_does_not(rig):
    found = list(read_many(rig, workers=3))
    assert [path for path, _ in found] == rig
    for path, recording in found:
        if path.name == "broken.wav":
            assert isinstance(recording, UnreadableFile)
            assert str(path) in str(recording)
        else:
            np.testing.assert_array_equal(recording.samples, read(path).samples)


def test_recordings_are_read_no_further_ahead_than_there_are_threads(rig, monkeypatch):
    from impactsig.io import many

    begun = []
    monkeypatch.setattr(many, "read", lambda path, **_: begun.append(path) or read(path))
    reading = read_many(good(rig), workers=2)
    assert begun == []
    next(reading)
    next(reading)
    reading.close()
    assert len(begun) <= 4


@pytest.mark.parametrize("workers", [1, 2])
def test_impacts_are_those_of_each_file(workers, rig):
    found = detect_many(rig, workers=workers, sensor="force", polarity="positive")
    assert list(found.impacts) == good(rig)
    assert list(found.errors) == [rig[3]]
    assert isinstance(found.errors[rig[3]], UnreadableFile)
    for path, impacts in found.impacts.items():
        alone = detect_impacts(read(path, sensor="force"), polarity="positive")
        pd.testing.assert_frame_equal(impacts.to_frame(), alone.to_frame(), check_exact=True)
        assert len(impacts) == 12


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.usefixtures("without_figures")
def test_reports_and_the_page_that_lists_them(workers, rig, tmp_path):
    folder = tmp_path / "new" / "out"
    few = [rig[2], rig[3], rig[5]]
    entries = write_reports(few, folder, workers=workers, sensor="force")
    assert [entry.page and entry.page.name for entry in entries] == [
        "c <b>.wav.html", None, "c <b>.wav-2.html",
    ]  # fmt: skip
    names = {entry.page.name for entry in entries if entry.page}
    assert {path.name for path in folder.iterdir()} == {*names, "index.html"}
    index = (folder / "index.html").read_text(encoding="utf-8")
    assert "<b>" not in index
    links = re.findall(r'href="\./([^"]*)"', index)
    assert links == ["c%20%3Cb%3E.wav.html", "c%20%3Cb%3E.wav-2.html"]
    assert "1 could not be analysed" in index
    assert entries[1].path == rig[3]
    with pytest.raises(UnreadableFile) as caught:
        read(rig[3])
    assert str(caught.value) == f"{rig[3]}: {entries[1].summary}"
    assert index.count("12 impacts in 0.5 s") == 2
    alone = write_report(rig[5], tmp_path / "alone.html", sensor="force").read_text()
    words = re.search(r'<p class="summary">(.*?)</p>', alone, re.DOTALL)
    assert words.group(0) in entries[2].page.read_text()


@pytest.mark.usefixtures("without_figures")
def test_the_command_tells_each_file_in_a_line(rig, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["report", str(rig[3]), str(rig[1]), "--workers=1"]) == 1
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith(f"{rig[1]}: ")
    assert lines[1] == f"reports: {Path('impactsig-reports', 'index.html')}"
    errors = said.err.splitlines()
    assert errors[0].startswith(f"error: {rig[3]}: ")
    assert errors[0].count("broken.wav") == 1
    assert errors[1] == "error: 1 of 2 files could not be analysed"


def test_what_cannot_be_is_refused_before_anything_is_done(rig, tmp_path):
    for call in (
        lambda files: write_reports(files, tmp_path / "out"),
        detect_many,
    ):
        for files in ([], [rig[0], rig[0]], rig[0], str(rig[0])):
            with pytest.raises(InvalidInput) as caught:
                call(files)
            assert caught.value.argument == "files"
    with pytest.raises(InvalidInput, match="files"):
        read_many(str(rig[0]))
    with pytest.raises(InvalidInput, match="workers"):
        detect_many(rig, workers=0)
    (tmp_path / "file").write_text("x")
    with pytest.raises(UnwritableFile):
        write_reports(good(rig), tmp_path / "file" / "out")
    assert not (tmp_path / "out").exists()


def test_what_kills_its_process_is_told_and_the_rest_is_done():
    found = each(square, range(7), workers=2)
    assert [one for one in found if isinstance(one, dict)] == [
        {"square": x * x} for x in (0, 1, 2, 6)
    ]
    assert [type(one) for one in found[3:6]] == [ImpactsigError, InvalidInput, ImpactsigError]
    assert "ZeroDivisionError: three" in str(found[3])
    assert "exit code 7" in str(found[5])
    assert each(square, []) == []
