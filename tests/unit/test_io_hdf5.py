"""HDF5: parts read as parts, rates found beside the samples, nothing outside the file touched."""

import os
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile
from impactsig.io.hdf5 import _chunks as _hdf5_chunks
from impactsig.io.hdf5 import _heaps as _hdf5_heaps
from impactsig.io.hdf5 import _texts as _hdf5_texts

h5py = pytest.importorskip("h5py")

X = np.random.default_rng(7).standard_normal((500, 3))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.h5"


def test_datasets_in_groups_with_attributes(path):
    with h5py.File(path, "w") as file:
        data = file.create_dataset("run 1/force", data=X[:, 0].astype(np.float32))
        data.attrs.update({"unit": "N", "sampling_rate": 2500.0})
        data = file.create_dataset("run 1/acc [mm]", data=X[:, 1].astype(">f8"))
        data.attrs["dt"] = 0.0004
    rec = io.read(path)
    assert (rec.rate, sorted(rec.channels)) == (2500.0, ["run 1/acc [mm]", "run 1/force"])
    assert (rec.channel("run 1/acc [mm]").unit, rec.channel("run 1/force").unit) == (
        "mm",
        "N",
    )
    np.testing.assert_array_equal(rec.channel("run 1/acc [mm]").samples, X[:, 1])
    force = io.read(path, "force", 0.1, 0.12)
    assert (force.samples.dtype, force.start) == (np.float32, 0.1)
    np.testing.assert_array_equal(force.samples, X[250:300, 0].astype("f4"))


@pytest.mark.parametrize("told", ["group attribute", "file attribute", "number beside"])
def test_the_rate_may_stand_at_any_folder_above(path, told):
    with h5py.File(path, "w") as file:
        file["a/b/x"] = X[:, 0]
        if told == "number beside":
            file["a/Fs"] = np.array([[250]])
        else:
            (file if told.startswith("file") else file["a"]).attrs["sample rate"] = 250
    assert io.read(path).rate == 250.0


def test_the_nearest_rate_counts_and_an_impossible_one_is_an_error(path):
    with h5py.File(path, "w") as file:
        file["a/x"] = X[:, 0]
        file.attrs["fs"] = 10.0
        file["a"].attrs["fs"] = 20.0
    assert io.read(path).rate == 20.0
    with h5py.File(path, "a") as file:
        file["a"].attrs["fs"] = np.nan
    with pytest.raises(UnreadableFile, match=r"its fs is nan, not a positive number \[Hz\]"):
        io.read(path)


def test_a_dataset_of_times_gives_rate_and_start(path):
    with h5py.File(path, "w") as file:
        file["run/time"] = 3 + np.arange(500) / 8000
        file["run/time"].attrs["unit"] = "s"
        file["run/x"] = X
        file["run/x"].attrs["channels"] = ["left", "right", "top"]
        file["other/x"] = X[:100, 0]
    with pytest.warns(ImpactsigWarning, match=r"'other/x' \(100 samples at unknown rate\)"):
        rec = io.read(path)
    assert (rec.rate, rec.start) == (8000.0, 3.0)
    assert rec.channels == ("run/x/left", "run/x/right", "run/x/top")
    assert io.read(path, "right").channels == ("run/x/right",)
    with pytest.raises(InvalidInput, match="no attribute or number named rate, fs or dt"):
        io.read(path, "other/x")


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("packing", [{}, {"chunks": True, "compression": "gzip", "shuffle": True}])
def test_time_runs_along_the_longer_axis(path, across, packing):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=X.T if across else X, **packing)
    np.testing.assert_array_equal(io.read(path, rate=10).samples, X)
    np.testing.assert_array_equal(io.read(path, 2, 5, 7, rate=10).samples, X[50:70, 2])
    np.testing.assert_array_equal(io.read(path, 0, 5, 7, rate=10).samples, X[50:70, 0])


def test_tables_give_a_channel_a_field(path):
    table = np.zeros(500, [("t", "f8"), ("force [N]", "f4"), ("note", "S5"), ("n", "i2", 2)])
    table["t"], table["force [N]"] = np.arange(500) / 100, X[:, 0]
    with h5py.File(path, "w") as file:
        file["log"] = table
    rec = io.read(path)
    assert (rec.rate, rec.channels, rec.unit) == (100.0, ("log/force [N]",), "N")
    np.testing.assert_array_equal(rec.samples, table["force [N]"])


@pytest.mark.parametrize("dtype", ["i1", "u2", "i4", "f2", "f4", ">f8", "bool"])
def test_any_real_type(path, dtype):
    values = (X[:, 0] * 50).astype(dtype)
    with h5py.File(path, "w") as file:
        file["x"] = values
    rec = io.read(path, rate=1)
    assert rec.samples.dtype == (np.float64 if dtype in ("i4", ">f8") else np.float32)
    np.testing.assert_array_equal(rec.samples, values)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (np.zeros(9, complex), "complex128"),
        (np.zeros((3, 3, 3)), "3 dimensions"),
        ([b"a", b"bb"], "holds text"),
        (np.zeros((0, 2)), "is empty"),
    ],
)
def test_datasets_that_are_no_recording(path, data, reason):
    with h5py.File(path, "w") as file:
        file["x"] = data
    with pytest.raises(UnreadableFile, match=f"'x' is left out: it .*{reason}"):
        io.read(path, rate=1)


# -- guards ------------------------------------------------------------------------------------


def linked(path, kind):
    """A file of which the dataset or group of that name is somewhere else."""
    secret = path.with_name("secret.bin")
    secret.write_bytes(X.tobytes())
    with h5py.File(path.with_name("other.h5"), "w") as other:
        other["g/x"] = X[:, 0]
    with h5py.File(path, "w") as file:
        file["own/y"] = X[:, 0]
        if kind == "soft link":
            file["x"] = h5py.SoftLink("/own/y")
        elif kind == "soft link to a group":
            file["x"] = h5py.SoftLink("/own")
        elif kind == "external link":
            file["x"] = h5py.ExternalLink("other.h5", "/g/x")
        elif kind == "external link to a group":
            file["x"] = h5py.ExternalLink("other.h5", "/g")
        elif kind == "external storage":
            file.create_dataset("x", (1500,), "f8", external=[(str(secret), 0, 12_000)])
        elif kind == "virtual dataset":
            layout = h5py.VirtualLayout((500,), "f8")
            layout[:] = h5py.VirtualSource("other.h5", "g/x", (500,))
            file.create_virtual_dataset("x", layout)


LINKS = ["soft link", "soft link to a group", "external link", "external link to a group"]
LINKS += ["external storage", "virtual dataset"]


@pytest.mark.parametrize("kind", LINKS)
def test_what_is_elsewhere_is_refused_and_the_rest_read(path, kind):
    linked(path, kind)
    with h5py.File(path) as file:  # what a reader that trusts it would return
        there = file[
            "x/y" if kind == "soft link to a group" else "x/x" if "to a group" in kind else "x"
        ][:500]
        np.testing.assert_array_equal(there, X.ravel()[:500] if "storage" in kind else X[:, 0])
    with pytest.warns(ImpactsigWarning, match=f"'x' is left out: it .*{kind.split(' to ')[0]}"):
        rec = io.read(path, rate=1)
    assert rec.channels == ("own/y",)
    with (
        pytest.warns(ImpactsigWarning),
        pytest.raises(InvalidInput, match="got x; required: one of 0: 'own/y'"),
    ):
        io.read(path, "x", rate=1)


def test_a_group_that_holds_itself_is_gone_through_once(path):
    with h5py.File(path, "w") as file:
        file["a/x"] = X[:, 0]
        file["a/self"] = file["a"]
        file["a/root"] = file["/"]
        file["a/again"] = file["a/x"]
    assert len(io.info(path).channels) == 1


def test_groups_nested_without_end_are_refused(path):
    with h5py.File(path, "w") as file:
        file["/".join("abcdefgh" * 5) + "/x"] = X[:, 0]
    with pytest.raises(UnreadableFile, match="nests groups more than 32 deep"):
        io.read(path, rate=1)


def test_a_bomb_is_refused_before_it_is_unpacked(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (1 << 31,), "f8", chunks=(1 << 16,), compression="gzip")
        file["x"][: 1 << 16] = 0
        file.create_dataset("never", (1 << 40,), "f8", chunks=(1 << 16,))
    assert path.stat().st_size < 20_000
    with (
        pytest.warns(ImpactsigWarning, match="'never' is left out: .*never written"),
        pytest.raises(UnreadableFile, match=r"would grow to 17.2 GB in memory \(limit 2.15 GB\)"),
    ):
        io.read(path, rate=1)
    with (
        pytest.warns(ImpactsigWarning),
        pytest.raises(UnreadableFile, match="limit 200 times its size"),
    ):
        io.read(path, rate=1, stop=2e7)
    with pytest.warns(ImpactsigWarning):
        assert not io.read(path, rate=1, stop=1000).samples.any()


def test_one_chunk_too_large_to_unpack_is_refused_in_blocks_too(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (1 << 25,), "f8", chunks=(1 << 25,), compression="gzip")
        file["x"][:10] = 1
    with pytest.raises(UnreadableFile, match="limit 200 times its size"):
        io.read_blocks(path, 1, rate=1)


def test_a_filter_that_would_be_loaded_from_elsewhere_is_refused(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=X, chunks=(100, 3), shuffle=True)
    # The number of the shuffle filter, in the message that describes the pipeline.
    content = path.read_bytes()
    mark = content.index(b"\x01\x01" + bytes(6) + b"\x02\x00")
    path.write_bytes(content[: mark + 8] + b"\x05\x7d" + content[mark + 10 :])  # 32005, blosc2's
    with pytest.raises(UnreadableFile, match=r"filter that is not HDF5's own \(number 32005\)"):
        io.read(path, rate=1)


# Filters, whether a chunk is stored as skipping the last of them, and the fewest bytes it may take.
STORED = [
    ({"fletcher32": True}, False, 516),
    ({"fletcher32": True}, True, 512),
    ({"shuffle": True}, False, 512),
    ({"shuffle": True, "fletcher32": True}, False, 516),
    ({"compression": "gzip", "fletcher32": True}, False, 5),
    ({"compression": "gzip", "fletcher32": True}, True, 1),
    ({"compression": "gzip"}, False, 1),
    ({"compression": "lzf"}, True, 512),
    ({}, False, 512),
]


def with_a_chunk_of(path, size, skipped, **packing):
    """A file whose fourth of 8 chunks of 512 bytes is announced with this size."""
    with h5py.File(path, "w") as file:
        values = np.round(X[:, :2]).astype("f4")  # which every filter can pack
        file.create_dataset("c", data=values, chunks=(64, 2), **packing)
        file.attrs["fs"] = 100.0
    with h5py.File(path) as file:
        chunk = file["c"].id.get_chunk_info(3)
        last = file["c"].id.get_create_plist().get_nfilters() - 1
    place = struct.pack("<3Q", *chunk.chunk_offset, 0)
    content = path.read_bytes()
    at = content.index(struct.pack("<2I", chunk.size, 0) + place)
    mask = 1 << last if skipped else 0
    path.write_bytes(content[:at] + struct.pack("<2I", size, mask) + content[at + 8 :])


def printed_in_a_child(*paths, **options):
    """What reading each file says, from a process of its own: HDF5 2.0 ends it."""
    code = (
        "import sys, impactsig.io as io\nfrom impactsig.errors import UnreadableFile\n"
        "for path in sys.argv[1:]:\n"
        f"    try: io.read(path, **{options!r})\n"
        "    except UnreadableFile as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, *paths], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_chunks_stored_in_too_few_bytes_are_refused(path):
    paths, expected = [], []
    for number, (packing, skipped, least) in enumerate(STORED):
        for size in sorted({0, 1, 3, 4, least - 1} & set(range(least))):
            one = path.with_name(f"{number} {size}.h5")
            with_a_chunk_of(one, size, skipped, **packing)
            paths.append(one)
            expected.append(f"the chunk at (192, 0) in {size} bytes, and it takes {least} at least")
            before = io.read(one, stop=1.9).samples
            np.testing.assert_array_equal(before, np.round(X[:190, :2]))
    lines = printed_in_a_child(*paths, start=1.9, stop=2.0)
    for line, words in zip(lines, expected, strict=True):
        assert words in line


@pytest.mark.parametrize(("packing", "skipped", "least"), STORED)
def test_chunks_stored_in_what_they_need_are_read(path, packing, skipped, least):
    with h5py.File(path, "w") as file:
        data = file.create_dataset("c", (500, 2), "f4", chunks=(64, 2), **packing)
        data[128:300] = X[128:300, :2]  # other chunks are never written
        file.attrs["fs"] = 100.0
        if skipped:
            raw = X[192:256, :2].astype("f4").tobytes()
            for bit in range(data.id.get_create_plist().get_nfilters() - 1):
                raw = zlib.compress(raw) if bit == 0 else raw
            last = data.id.get_create_plist().get_nfilters() - 1
            data.id.write_direct_chunk((192, 0), raw, 1 << last)
    expected = np.zeros((500, 2), "f4")
    expected[128:300] = X[128:300, :2]
    np.testing.assert_array_equal(io.read(path).samples, expected)


def test_many_chunks_without_a_filter_are_checked_in_one_go(path, monkeypatch):
    with_a_chunk_of(path, 300, False)
    monkeypatch.setattr(_hdf5_chunks, "_FEW", 3)
    blocks = iter(io.read_blocks(path, 0.32))
    for first in range(0, 192, 32):
        np.testing.assert_array_equal(next(blocks).samples, np.round(X[first : first + 32, :2]))
    with pytest.raises(UnreadableFile, match=r"the chunk at \(192, 0\) in 300 bytes"):
        next(blocks)
    np.testing.assert_array_equal(io.read(path, start=2.56).samples, np.round(X[256:, :2]))


@pytest.mark.parametrize("kind", ["number", "text", "cells", "across", "table"])
def test_every_way_to_a_chunk_is_checked(path, kind):
    packing = {"chunks": True, "fletcher32": True}
    with h5py.File(path, "w", userblock_size=512) as file:
        file["x"] = X
        if kind == "number":
            file.create_dataset("fs", data=[[100.0]], **packing)
        elif kind == "text":
            file.create_dataset(
                "unit", data=np.array([[78, 109]], "u2"), chunks=(1, 1), fletcher32=True
            )
            file["unit"].attrs["MATLAB_class"] = np.bytes_("char")
        elif kind == "cells":
            file.create_dataset(
                "c",
                data=[[file["x"].ref] * 2],
                dtype=h5py.ref_dtype,
                chunks=(1, 1),
                fletcher32=True,
            )
        elif kind == "across":
            file.create_dataset("x2", data=X.T, chunks=(3, 100), fletcher32=True)
        else:
            table = np.zeros(500, [("a", "f4"), ("b", "f4")])
            file.create_dataset("log", data=table, chunks=(100,), fletcher32=True)
    if kind in ("text", "cells"):
        with path.open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    names = {"number": "fs", "text": "unit", "cells": "c", "across": "x2", "table": "log"}
    with h5py.File(path) as file:
        data = file[names[kind]].id
        chunk = data.get_chunk_info(data.get_num_chunks() - 1)
    place = struct.pack(f"<{len(chunk.chunk_offset) + 1}Q", *chunk.chunk_offset, 0)
    content = path.read_bytes()
    key = struct.pack("<2I", chunk.size, 0) + place
    at = content.index(key)
    path.write_bytes(content[:at] + bytes(4) + content[at + 4 :])
    channel = {"across": "x2 0", "table": "log/a"}.get(kind)
    (line,) = printed_in_a_child(path, channel=channel, rate=100.0)
    assert f"dataset '/{names[kind]}' keeps the chunk at" in line


def test_cut_short_is_an_error_with_its_cause(path):
    with h5py.File(path, "w") as file:
        file["x"] = X
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(UnreadableFile, match="truncated file") as caught:
        io.read(path, rate=1)
    assert isinstance(caught.value.__cause__, OSError)


def test_hdf5_needs_its_extra(path, monkeypatch):
    with h5py.File(path, "w") as file:
        file["x"] = X

    def absent(name):
        raise ImportError(name)

    from impactsig.errors import MissingExtra

    monkeypatch.setattr("impactsig._extras.import_module", absent)
    with pytest.raises(MissingExtra, match=r"HDF5.* needs h5py.*impactsig\[hdf5\]"):
        io.read(path)


# -- texts of any length -------------------------------------------------------------------

TEXTS = {"unit": "kN", "label": "Kraft über Zeit", "empty": "", "long": "x" * 5000}
NAMES = ["links", "rechts", "mitte"]
VERSIONS = {"earliest": {}, "latest": {"libver": "latest"}, "v110": {"libver": ("v110", "v110")}}


def texts_of(path):
    """What is read of the attributes of x and of the dataset text, and the doubts."""
    with h5py.File(path) as file:
        texts = _hdf5_texts.Texts(path)
        found = {name: texts.attribute(file["x"], name) for name in file["x"].attrs}
        return found, texts.dataset(file["text"]), texts.doubts


def never_asked(monkeypatch):
    def asked(self):
        raise AssertionError("the whole file would be gone through")

    monkeypatch.setattr(_hdf5_texts.Heaps, "doubt", property(asked))


@pytest.mark.parametrize("ordered", [False, True])
@pytest.mark.parametrize("before", [0, 512, 2048])
@pytest.mark.parametrize("version", VERSIONS)
def test_texts_of_any_length_are_found_without_hdf5(path, monkeypatch, version, before, ordered):
    with h5py.File(path, "w", userblock_size=before, **VERSIONS[version]) as file:
        file.create_dataset("x", data=X, track_times=ordered, track_order=ordered)
        for name, text in TEXTS.items():
            file["x"].attrs[name] = text
            file["x"].attrs[name + " again"] = 1.0  # headers are continued elsewhere
            del file["x"].attrs[name + " again"]
        file["x"].attrs["names"] = np.array(NAMES, object)
        file["text"] = "Newton"
    never_asked(monkeypatch)
    found, text, doubts = texts_of(path)
    assert found.pop("names").tolist() == NAMES
    assert (found, text, doubts) == (TEXTS, "Newton", [])


def test_what_hdf5_keeps_otherwise_is_left_to_it(path, monkeypatch):
    with h5py.File(path, "w", libver="latest") as file:
        file["x"] = X
        for number in range(20):  # from the ninth on they are kept in an index
            file["x"].attrs[f"{number}"] = f"text {number}"
        file.create_dataset("text", data=["Newton"], chunks=(1,), dtype=h5py.string_dtype())
    found, text, doubts = texts_of(path)
    assert found == {f"{number}": f"text {number}" for number in range(20)}
    assert (text.tolist(), doubts) == ([b"Newton"], [])
    never_asked(monkeypatch)
    with pytest.raises(AssertionError, match="gone through"):
        texts_of(path)


def test_a_text_costs_what_it_takes_and_not_the_whole_file(path, monkeypatch):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (1 << 31,), "f8", chunks=(1 << 12,))  # of which one is stored
        file["x"][5000:5010] = 1.0
        file["x"].attrs.update({"unit": "N", "fs": 1000.0})
    never_asked(monkeypatch)
    rec = io.read(path, start=5.0, stop=5.01)
    assert (rec.unit, rec.samples.tolist()) == ("N", [1.0] * 10)


def test_headers_without_number_are_given_up(path, monkeypatch):
    with h5py.File(path, "w") as file:
        file["x"] = X
        file["x"].attrs.update(TEXTS)
        file["text"] = "Newton"
    monkeypatch.setattr(_hdf5_texts, "_MOST", 3)
    monkeypatch.setattr(_hdf5_texts.Heaps, "doubt", "are not trusted")
    found, text, doubts = texts_of(path)
    assert {*found.values(), text} == {None}
    assert doubts == ["are not trusted"]


def with_a_text_told_of(path, times):
    """A file of 0.2 MB whose names are one text of 60 kB, many times."""
    with h5py.File(path, "w") as file:
        file["x"] = X[:, 0]
        file["x"].attrs["fs"] = 100.0
        file["x"].attrs["unit"] = "N" * 60_000
        file["x"].attrs["channels"] = np.array(["a"] * times, object)
    content = bytearray(path.read_bytes())
    unit = content.index((60_000).to_bytes(4, "little"), content.index(b"unit"))
    names = content.index((1).to_bytes(4, "little"), content.index(b"channels") + 64)
    content[names : names + 16 * times] = content[unit : unit + 16] * times
    path.write_bytes(content)


@pytest.mark.parametrize("by_hdf5", [False, True])
def test_one_text_told_of_many_times_is_no_bomb(path, monkeypatch, by_hdf5):
    if by_hdf5:
        monkeypatch.setattr(_hdf5_texts, "_MOST", 0)
    with_a_text_told_of(path, 200)
    with h5py.File(path) as file:
        texts = _hdf5_texts.Texts(path)
        assert texts.attribute(file["x"], "channels").tolist() == ["N" * 60_000] * 200
        assert texts.doubts == []
    with_a_text_told_of(path, 2000)
    with pytest.warns(ImpactsigWarning, match="not read: these hold more than 16 MiB of texts"):
        assert io.read(path).rate == 100.0


def with_a_heap_changed(path, at, value, indexed=True):
    """A file whose unit is a text in a heap, of which 8 bytes at `at` are overwritten."""
    with h5py.File(path, "w", libver="latest" if indexed else "earliest") as file:
        file["x"] = X[:, 0]
        file["x"].attrs.update({"unit": "N", "fs": 100.0})
        for number in range(20 if indexed else 0):  # an index of them HDF5 alone can read
            file["x"].attrs[f"{number}"] = number
    content = bytearray(path.read_bytes())
    heap = content.index(b"GCOL")
    place = heap + 16  # its first object; the next is what is free of it
    if at == "free":
        place += 16 + 8
    content[place + 8 : place + 16] = value.to_bytes(8, "little")
    path.write_bytes(content)


@pytest.mark.parametrize(("at", "size"), [("free", 0), ("first", 2**64 - 16), ("first", 2**63)])
def test_a_heap_without_end_would_hang_hdf5_and_is_not_read(path, at, size):
    # HDF5 2.0 does not come back from the free object of size 0.
    with_a_heap_changed(path, at, size)
    with pytest.warns(ImpactsigWarning, match="units and names .* not read: these have no end"):
        rec = io.read(path)
    assert (rec.rate, rec.unit) == (100.0, "")
    np.testing.assert_array_equal(rec.samples, X[:, 0])


@pytest.mark.parametrize("size", [0, 2**64 - 16, 2**63])
def test_of_a_heap_without_end_the_texts_before_it_are_read(path, size):
    with_a_heap_changed(path, "free", size, indexed=False)
    assert io.read(path).unit == "N"
    with_a_heap_changed(path, "first", size, indexed=False)
    with pytest.warns(ImpactsigWarning, match="units and names .* not read: these hold no text 1"):
        rec = io.read(path)
    assert (rec.rate, rec.unit) == (100.0, "")
    np.testing.assert_array_equal(rec.samples, X[:, 0])


@pytest.mark.parametrize("indexed", [False, True])
def test_a_heap_in_order_is_read(path, indexed):
    with_a_heap_changed(path, "first", 1, indexed)
    assert io.read(path).unit == "N"


def test_heaps_without_number_are_given_up(path, monkeypatch):
    with_a_heap_changed(path, "first", 1)
    path.write_bytes(path.read_bytes() + b"GCOL\x01\0\0\0" * 100)
    assert io.read(path).unit == "N"
    monkeypatch.setattr(_hdf5_heaps, "_MOST", 50)
    with pytest.warns(ImpactsigWarning, match="these have no end"):
        assert io.read(path).rate == 100.0


def test_heaps_are_not_looked_for_in_what_is_too_large(path, monkeypatch):
    with_a_heap_changed(path, "first", 1)
    monkeypatch.setattr(_hdf5_heaps, "_LARGEST", 1000)
    with pytest.warns(ImpactsigWarning, match="not looked for in more than"):
        assert io.read(path).unit == ""


def test_what_is_known_of_heaps_is_forgotten_when_the_file_changes(path):
    with_a_heap_changed(path, "first", 1)
    long_ago = path.stat().st_mtime - 1000
    os.utime(path, (long_ago, long_ago))
    assert io.read(path).unit == io.read(path).unit == "N"
    with_a_heap_changed(path, "free", 0)
    os.utime(path, (long_ago + 1, long_ago + 1))
    with pytest.warns(ImpactsigWarning, match="these have no end"):
        assert io.read(path).unit == ""
