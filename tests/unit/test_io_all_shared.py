"""Every real recording is read, or refused for the reason that its manifest gives."""

import re
import warnings
from pathlib import Path

import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

from ..conftest import SHARED

# What `test_io_shared`, `test_io_uff` and `test_io_matlab` look at in full. Here: each is tried.
NO_RATE = {
    # one column of forces, whose rate stands in its name
    "force/treadmill_vGRF_300Hz.csv": 300.0,
    # a matrix without names; its seventh column counts milliseconds
    "formats/Unit105_Series1_1.mat": 1e6,
    # samples alone; the rate stands in a file beside it
    "scope_text/rohde_schwarz_rtp_01.Wfm.csv": 1e9,
    # uneven times
    "scope_text/phone_accelerometer1.csv": 100.0,
}
REFUSED = {
    "formats/faulty_tdms_01.tdms": "cannot be read as NI TDMS",
    "formats/sample_dataset58_psd.uff": "complex numbers",
    "impact/vallen_ae/sample.pridb": "contains hits, not samples",
}
ANNOTATIONS = re.compile(r"audio_onsets/.*(_class\.txt|\.onsets)")
# Begin, end and number of each tap: a table of numbers, and its first column may pass for times.
LABELS = "audio_counts/taps/nail.txt"

FILES = sorted(str(p.relative_to(SHARED)) for p in SHARED.rglob("*.*") if p.suffix != ".md")


def test_the_real_recordings_are_here(shared_data):
    rows = re.findall(r"^\| (.*?) \|", shared_data("MANIFEST.md").read_text(), re.M)
    listed = []
    for row in rows:
        first, *others = row.split(", ")  # several in one folder may share a row
        listed += [first, *(str(Path(first).with_name(name)) for name in others)]
    assert sorted(name for name in listed if name != "file") == FILES


@pytest.mark.parametrize("name", FILES)
def test_each_is_read_or_refused(name):
    path = SHARED / name
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImpactsigWarning)
        if name in REFUSED:
            with pytest.raises(UnreadableFile, match=REFUSED[name]):
                io.read(path)
            return
        if ANNOTATIONS.match(name) or name == LABELS:
            with pytest.raises(InvalidInput, match="give rate="):
                io.read(path)
            return
        if name in NO_RATE:
            with pytest.raises(InvalidInput, match="give rate="):
                io.read(path)
        rate = NO_RATE.get(name)
        rec = io.read(path, rate=rate)
        listed = {c.name: c for c in io.info(path).channels}
        for channel, unit in zip(rec.channels, rec.units, strict=True):
            told = listed[channel]
            assert (told.unit, told.rate or rate, told.length) == (unit, rec.rate, len(rec))
        label = rec.channels[0]
        first = label if label and rec.channels.count(label) == 1 else 0
        second = io.read(path, first, rec.start, rec.start + 10 / rec.rate, rate=rate)
        assert (second.samples == rec.samples.reshape(len(rec), -1)[:10, 0]).all()
