"""Blocks joined are the whole, and numbers come back from any style of text, whatever they are."""

import numpy as np
import pytest
import soundfile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import impactsig.io as io

RATE = 1000
COUNT = 777
X = np.random.default_rng(4).integers(-30_000, 30_000, (COUNT, 2)).astype(np.int16)

quick = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def _audio(container, codec, ending):
    def write(folder):
        path = folder / f"a{ending}"
        soundfile.write(str(path), X, RATE, format=container, subtype=codec)
        return path, {}

    return write


def _npy(folder):
    np.save(folder / "a.npy", X)
    return folder / "a.npy", {"rate": RATE}


def _npz(folder):
    np.savez(folder / "a.npz", a=X[:, 0], b=X[:, 1], rate=RATE)
    return folder / "a.npz", {}


def _csv(folder):
    rows = (f"{i / RATE:.3f},{a},{b}" for i, (a, b) in enumerate(X))
    (folder / "a.csv").write_text("time,a,b\n" + "\n".join(rows))
    return folder / "a.csv", {}


def _lvm(folder):
    rows = (f"{i / RATE:.6f}\t{a}\t{b}" for i, (a, b) in enumerate(X))
    (folder / "a.lvm").write_text("\n".join(rows) + "\n")
    return folder / "a.lvm", {}


def _tdms(folder):
    nptdms = pytest.importorskip("nptdms")
    properties = {"wf_increment": 1 / RATE}
    with nptdms.TdmsWriter(str(folder / "a.tdms")) as file:
        for part in (X[:300], X[300:301], X[301:]):
            file.write_segment(
                [nptdms.ChannelObject("g", n, part[:, i], properties) for i, n in enumerate("ab")]
            )
    return folder / "a.tdms", {}


WRITERS = {
    "wav": _audio("WAV", "PCM_16", ".wav"),
    "flac": _audio("FLAC", "PCM_16", ".flac"),
    "vorbis": _audio("OGG", "VORBIS", ".ogg"),
    "npy": _npy,
    "npz": _npz,
    "csv": _csv,
    "lvm": _lvm,
    "tdms": _tdms,
}


@pytest.fixture(scope="module", params=WRITERS)
def file(request, tmp_path_factory):
    return WRITERS[request.param](tmp_path_factory.mktemp(request.param))


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
