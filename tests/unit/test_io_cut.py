"""Files cut short at random: an error, or a warning, `truncated`, and the samples before."""

import warnings

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, UnreadableFile

from ..files import WRITERS

X = np.random.default_rng(14).integers(-30_000, 30_000, (700, 2)).astype(np.int16)

# Nothing in these files says how many rows there should be; a row that is cut is told.
OPEN_ENDED = ("csv", "lvm", "raw")

# What is cut of these is not read at all.
ALL_OR_NOTHING = (
    "flac",
    "vorbis",
    "npz",
    "hdf5",
    "hdf5 packed",
    "matlab 7.3",
    "parquet",
    "feather",
    "mdf 4",
    "mdf 4 packed",
    "tradb",
    "tradb packed",
)


@pytest.mark.parametrize("name", WRITERS)
def test_cut_short(name, tmp_path):
    path, options = WRITERS[name](tmp_path, X, 1000)
    content, whole = path.read_bytes(), io.read(path, **options)
    options = {**options, "rate": 1000}  # it may stand behind the cut
    rng = np.random.default_rng(15)
    # The first lines of a text are needed to tell what it is.
    least = len(content) // 8 if name in OPEN_ENDED else 1
    read = 0
    for kept in [len(content) - 1, *rng.integers(least, len(content), 40)]:
        path.write_bytes(content[:kept])
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            try:
                rec = io.read(path, **options)
            except UnreadableFile:
                continue
        read += 1
        found, expected = rec.samples.reshape(len(rec), -1), whole.samples
        assert rec.channels == whole.channels[: found.shape[1]]
        complete = found.shape == expected.shape
        assert complete or name in OPEN_ENDED or rec.truncated
        if rec.truncated:
            assert any(issubclass(w.category, ImpactsigWarning) for w in told)
        # The last line of a text may end in a number that lacks its last digits.
        certain = len(rec) - (name in OPEN_ENDED)
        np.testing.assert_array_equal(found[:certain], expected[:certain, : found.shape[1]])
    assert (read == 0) == (name in ALL_OR_NOTHING)
