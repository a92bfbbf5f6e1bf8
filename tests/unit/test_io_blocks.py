"""Detection in blocks gives what it gives of the whole, from a file of every format."""

import numpy as np
import pytest

import impactsig

from ..files import WRITERS

RATE = 10_000
LOSSY = ("vorbis",)  # its samples are nearly those that were written


@pytest.fixture(scope="module")
def strikes():
    rng = np.random.default_rng(12)
    x = 30 * rng.standard_normal((4 * RATE, 2))
    for at in rng.integers(100, 4 * RATE - 100, 25):
        x[at : at + 20, 0] += rng.uniform(2000, 20_000) * np.sin(np.pi * np.arange(20) / 20)
    return np.clip(np.round(x), -32_000, 32_000).astype(np.int16)


@pytest.fixture(scope="module")
def expected(strikes):
    found = impactsig.detect_impacts(impactsig.Recording(strikes[:, 0] * 1.0, RATE))
    assert 20 < len(found) <= 25
    return found


@pytest.mark.parametrize("name", WRITERS)
def test_blocks_and_whole_give_the_same_impacts(name, strikes, expected, tmp_path):
    path, options = WRITERS[name](tmp_path, strikes, RATE)
    whole = impactsig.detect_impacts(impactsig.read(path, channel=0, **options))
    blocks = impactsig.detect_impacts(impactsig.read_blocks(path, 0.37, channel=0, **options))
    for field in ("time", "contact_time", "peak", "impulse"):
        np.testing.assert_array_equal(getattr(whole, field), getattr(blocks, field))
    if name not in LOSSY:
        assert len(whole) == len(expected)
        np.testing.assert_allclose(whole.time, expected.time, atol=2e-6)
