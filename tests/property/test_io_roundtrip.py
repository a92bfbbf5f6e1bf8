"""Blocks joined are the whole, and numbers come back from any style of text, whatever they are."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import impactsig.io as io

from ..files import WRITERS

RATE = 1000
COUNT = 777
X = np.random.default_rng(4).integers(-30_000, 30_000, (COUNT, 2)).astype(np.int16)

quick = settings(
    max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.fixture(scope="module", params=WRITERS)
def file(request, tmp_path_factory):
    return WRITERS[request.param](tmp_path_factory.mktemp("file"), X, RATE)


@quick
@given(data=st.data())
def test_blocks_joined_are_the_whole(file, data):
    path, options = file
    first = data.draw(st.integers(0, COUNT - 1))
    last = data.draw(st.integers(first + 1, COUNT))
    size = data.draw(st.integers(1, COUNT + 5))
    channel = data.draw(st.sampled_from([None, 0, 1]))
    options = {**options, "channel": channel, "start": first / RATE, "stop": last / RATE}
    whole = io.read(path, **options)
    assert len(whole) == last - first
    blocks = io.read_blocks(path, size / RATE, **options)
    parts = list(blocks)
    assert all(len(part) == size for part in parts[:-1])
    assert blocks.samples == len(whole)
    joined = np.concatenate([part.samples for part in parts])
    assert joined.dtype == whole.samples.dtype
    np.testing.assert_array_equal(joined, whole.samples)
    np.testing.assert_allclose(
        [part.start for part in parts],
        whole.start + np.arange(len(parts)) * size / RATE,
        atol=1e-12,
    )


numbers = st.floats(allow_nan=False, allow_infinity=False, width=64)


@quick
@given(
    rows=st.lists(st.tuples(numbers, numbers), min_size=3, max_size=30),
    style=st.sampled_from(
        [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", ".")]
    ),
    heading=st.booleans(),
    ending=st.sampled_from(["\n", "\r\n"]),
)
def test_numbers_come_back_from_any_style_of_text(tmp_path, rows, style, heading, ending):
    delimiter, decimal = style
    lines = [delimiter.join(["time", "a", "b"])] if heading else []
    for index, row in enumerate(rows):
        cells = [f"{index / 64:.6f}"] + [repr(x) for x in row]
        lines.append(delimiter.join(cells).replace(".", decimal))
    path = tmp_path / "a.txt"
    path.write_bytes(ending.join(lines).encode())
    rec = io.read(path)
    assert rec.rate == 64.0
    np.testing.assert_allclose(rec.samples, np.array(rows), rtol=4e-16, atol=0)
