"""MATLAB files of both kinds: what scipy and MATLAB's layout say, and what would end a process."""

import re
import struct
import zlib

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.sparse import coo_array

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, InvalidInput, UnreadableFile

X = np.random.default_rng(8).standard_normal((400, 3))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.mat"


# -- version 5 ---------------------------------------------------------------------------------


@pytest.mark.parametrize("packed", [False, True])
def test_variables_rate_and_time(path, packed):
    savemat(path, {"force": X[:, :1], "acc": X[:, 1], "Fs": 2500}, do_compression=packed)
    rec = io.read(path)
    assert (rec.rate, rec.channels) == (2500.0, ("force", "acc"))
    np.testing.assert_array_equal(rec.samples, X[:, :2])
    part = io.read(path, "acc", 0.1, 0.104)
    assert part.start == 0.1
    np.testing.assert_array_equal(part.samples, X[250:260, 1])
    t = 2 + np.arange(400) / 50_000
    savemat(path, {"t": t, "x": X, "unit": "m/s^2"}, do_compression=packed)
    rec = io.read(path)
    assert (rec.rate, rec.start, rec.units) == (50_000.0, 2.0, ("m/s^2",) * 3)
    assert rec.channels == ("x 0", "x 1", "x 2")


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(
    "dtype", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8", "bool"]
)
def test_every_type_of_numbers_as_scipy_reads_it(path, dtype, packed):
    values = (np.abs(X) * 50).astype(dtype)
    savemat(path, {"x": values, "turned": values.T}, do_compression=packed)
    expected = loadmat(path)["x"]
    rec = io.read(path, rate=1)
    small = dtype in ("i1", "u1", "i2", "u2", "f4", "bool")
    assert rec.samples.dtype == (np.float32 if small else np.float64)
    np.testing.assert_array_equal(rec.samples[:, :3], expected)
    np.testing.assert_array_equal(rec.samples[:, 3:], expected)


@pytest.mark.parametrize("packed", [False, True])
def test_structs_and_cells(path, packed):
    run = {"fs": 100.0, "units": "N", "force": X[:, 0], "note": "warm"}
    cells = np.empty(2, object)
    cells[:] = [X[:, 1], {"x": X[:, 2]}]
    savemat(path, {"run": run, "c": cells}, do_compression=packed)
    found = {c.name: (c.unit, c.rate, c.length) for c in io.info(path).channels}
    assert found == {
        "run.force": ("N", 100.0, 400),
        "c{1}": ("", None, 400),
        "c{2}.x": ("", None, 400),
    }
    np.testing.assert_array_equal(io.read(path, "c{2}.x", rate=1).samples, X[:, 2])
    np.testing.assert_array_equal(io.read(path, "force").samples, X[:, 0])


def test_struct_arrays_are_numbered(path):
    runs = np.array([(X[:, 0],), (X[:, 1],)], [("x", object)])
    savemat(path, {"s": runs})
    assert [c.name for c in io.info(path).channels] == ["s(1).x", "s(2).x"]


def test_what_holds_no_real_numbers_is_named(path):
    from scipy.sparse import eye_array

    others = {"z": X * 1j, "s": eye_array(5), "cube": np.zeros((2, 2, 2)), "a": "text"}
    savemat(path, {"x": X, **others})
    with pytest.warns(ImpactsigWarning) as told:
        io.read(path, rate=1)
    told = " ".join(str(w.message) for w in told)
    for reason in ("'z' is left out: it holds comp", "'s' .* is sparse", "'cube' .* 3 dimensions"):
        assert re.search(reason, told)
    with pytest.warns(ImpactsigWarning), pytest.raises(InvalidInput, match="no number named fs"):
        io.read(path)


def element(kind, data, order="<"):
    return (
        struct.pack(order + "II", kind, len(data))
        + data
        + bytes(0 if kind == 15 else -len(data) % 8)
    )


def variable(values, *, order="<", name=b"x", shape=None, kind=9, flags=6):
    """An array as MATLAB writes it, or not quite."""
    shape = values.shape if shape is None else shape
    numbers = np.asfortranarray(values).astype(order + "f8").tobytes(order="F")
    return element(
        14,
        element(6, struct.pack(order + "II", flags, 0), order)
        + element(5, struct.pack(f"{order}{len(shape)}i", *shape), order)
        + element(1, name, order)
        + element(kind, numbers, order),
        order,
    )


def mat5(path, *elements, order="<"):
    mark = b"\x00\x01IM" if order == "<" else b"\x01\x00MI"
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + mark + b"".join(elements))
    return path


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("packed", [False, True])
def test_either_byte_order(path, order, packed):
    content = variable(X, order=order)
    if packed:
        raw = zlib.compress(content)
        content = struct.pack(order + "II", 15, len(raw)) + raw
    mat5(path, content, order=order)
    np.testing.assert_array_equal(io.read(path, rate=1).samples, X)


@pytest.mark.parametrize("kind", [0, 8, 10, 15, 200, 100_000])
@pytest.mark.parametrize("packed", [False, True])
def test_types_that_are_not_defined_are_errors(path, kind, packed):
    # scipy 1.17 ends the process at 8, 200 and 100 000.
    content = variable(X, kind=kind)
    mat5(path, element(15, zlib.compress(content)) if packed else content)
    with pytest.raises(UnreadableFile, match=r"where numbers belong|small element"):
        io.read(path, rate=1)


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        ((2**31 - 1, 2**31 - 1), "has 9600 bytes of float64"),
        ((-400, -3), r"an array of shape \(-400, -3\)"),
        ((1200,), r"an array of shape \(1200,\)"),
        ((2,) * 40, "an array of shape"),
    ],
)
def test_shapes_that_lie(path, shape, reason):
    with pytest.raises(UnreadableFile, match=reason):
        io.read(mat5(path, variable(X, shape=shape)), rate=1)


def test_sizes_beyond_the_array_they_stand_in(path):
    content = bytearray(variable(X))
    content[4:8] = struct.pack("<I", 100)
    with pytest.raises(UnreadableFile, match="announces 9600 bytes where"):
        io.read(mat5(path, bytes(content)), rate=1)


def test_a_bomb_is_refused_before_it_is_unpacked(path):
    savemat(path, {"x": np.zeros(9 << 20), "fs": 1.0}, do_compression=True)
    assert path.stat().st_size < 100_000
    assert io.info(path).channels[0].length == 9 << 20
    with pytest.raises(UnreadableFile, match="limit 200 times its size"):
        io.read(path)
    assert not io.read(path, limits=io.Limits(expansion=2000)).samples.any()


@pytest.mark.parametrize("announced", [-64, 640_000])
def test_a_variable_that_unpacks_to_another_size(path, announced):
    content = variable(X)
    lying = content[:4] + struct.pack("<I", len(content) - 8 + announced) + content[8:]
    mat5(path, element(15, zlib.compress(lying)))
    with pytest.raises(UnreadableFile, match=r"unpacks to|announces"):
        io.read(path, rate=1)


def test_nesting_without_end_and_endless_empty_structs(path):
    def cell(inside, count=1):
        return element(
            14,
            element(6, struct.pack("<II", 1, 0))
            + element(5, struct.pack("<ii", 1, count))
            + element(1, b"c")
            + inside,
        )

    content = variable(X)
    for _ in range(40):
        content = cell(content)
    with pytest.raises(UnreadableFile, match="deep"):
        io.read(mat5(path, content), rate=1)
    with pytest.raises(UnreadableFile, match=r"cut off|are left"):
        io.read(mat5(path, cell(b"", 2**31 - 1)), rate=1)
    struct_without_fields = element(
        14,
        element(6, struct.pack("<II", 2, 0))
        + element(5, struct.pack("<ii", 2**31 - 1, 2**31 - 1))
        + element(1, b"s")
        + element(5, struct.pack("<i", 8))
        + element(1, b""),
    )
    with pytest.raises(UnreadableFile, match="contains no array"):
        io.read(mat5(path, struct_without_fields), rate=1)


def test_cut_short_the_variables_before_are_read(path):
    mat5(path, variable(X), variable(X, name=b"y"))
    whole = path.read_bytes()
    path.write_bytes(whole[:-100])
    # A header of 128 bytes, then two elements of one size, each with a tag of 8.
    second = (128 + len(whole)) // 2
    size = len(whole) - second - 8
    words = f"cut short: the element at byte {second} announces {size} bytes where {size - 100} are"
    with pytest.warns(ImpactsigWarning, match=words):
        rec = io.read(path, rate=1)
    assert (rec.truncated, rec.channels) == (True, ("x 0", "x 1", "x 2"))
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(UnreadableFile, match="holds no whole variable"):
        io.read(path, rate=1)


def test_a_packed_variable_cut_inside_is_an_error(path):
    raw = zlib.compress(variable(X))[:-300]
    mat5(path, struct.pack("<II", 15, len(raw)) + raw)
    with pytest.raises(UnreadableFile, match="unpacks to"):
        io.read(path, rate=1)


def test_the_matrix_of_the_drop_tower_as_scipy_reads_it(shared_data):
    path = shared_data("formats/Unit105_Series1_1.mat")
    rec = io.read(path, rate=1e6)
    np.testing.assert_array_equal(rec.samples, loadmat(path)["Unit105_Series1_1"])
    assert rec.channels == tuple(f"Unit105_Series1_1 {i}" for i in range(7))
    with pytest.raises(InvalidInput, match="no number named fs or dt"):
        io.read(path)


# -- version 7.3 -------------------------------------------------------------------------------


@pytest.fixture
def file(path):
    """An HDF5 file behind the block of 512 bytes that MATLAB puts before it."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        yield file


def finish(path, file):
    """Write that block, which HDF5 leaves to others."""
    file.close()
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def put(place, name, values, kind="double"):
    """A variable as MATLAB keeps it: at least two dimensions, in reverse."""
    values = np.atleast_2d(values)
    data = place.create_dataset(name, data=values.T, chunks=values.size > 100 or None)
    data.attrs["MATLAB_class"] = np.bytes_(kind)
    return data


def text(place, name, words):
    return put(place, name, np.array([[ord(c) for c in words]], np.uint16), "char")


def test_structs_chars_and_transposed_matrices_of_7_3(path, file):
    run = file.create_group("run")
    run.attrs["MATLAB_class"] = np.bytes_("struct")
    put(run, "force", X[:, :2])
    put(run, "fs", 400.0)
    text(run, "units", "N")
    text(file, "note", "no signal at all")
    put(file, "logical", (X[:, 0] > 0).astype("u1"), "logical")
    finish(path, file)
    found = {c.name: (c.unit, c.rate, c.length) for c in io.info(path).channels}
    assert found == {
        "run.force 0": ("N", 400.0, 400),
        "run.force 1": ("N", 400.0, 400),
        "logical": ("", None, 400),
    }
    with pytest.warns(ImpactsigWarning, match="'logical' .400 samples at unknown rate"):
        rec = io.read(path)
    np.testing.assert_array_equal(rec.samples, X[:, :2])
    assert io.info(path).format == "MATLAB 7.3"


def test_cells_of_7_3_are_references_followed_inside_the_file(path, file):
    import h5py

    kept = file.create_group("#refs#")
    put(kept, "a", X[:, 0])
    put(kept.create_group("b"), "x", X[:, 1])
    put(kept, "unused", X[:, 2])
    refs = np.array([[kept["a"].ref], [kept["b"].ref], [h5py.Reference()]], h5py.ref_dtype)
    data = file.create_dataset("c", data=refs)
    data.attrs["MATLAB_class"] = np.bytes_("cell")
    file.create_dataset("self", data=np.array([data.ref], h5py.ref_dtype))
    file["elsewhere"] = h5py.ExternalLink("other.h5", "/x")
    finish(path, file)
    with pytest.warns(ImpactsigWarning, match="'elsewhere' is left out: it is an external link"):
        rec = io.read(path, rate=1)
    assert rec.channels == ("c{1}", "c{2}.x")
    np.testing.assert_array_equal(rec.samples, X[:, :2])


@pytest.mark.parametrize("kind", ["f8", "f4", "i4", "i2", "u2", "u1"])
def test_matlab_4(tmp_path, kind):
    path = tmp_path / "a.mat"
    samples = np.round(100 * np.abs(X)).astype(kind)
    savemat(path, {"x": samples, "fs": 2000.0, "unit": "N", "y": samples[:, :1]}, format="4")
    rec = io.read(path)
    assert (rec.rate, rec.units) == (2000.0, ("N",) * 4)
    assert rec.channels == ("x 0", "x 1", "x 2", "y")
    np.testing.assert_array_equal(rec.samples[:, :3], loadmat(path)["x"])
    part = io.read(path, "y", 0.01, 0.02)
    np.testing.assert_array_equal(part.samples, samples[20:40, 0])
    assert io.info(path).format == "MATLAB 4"


def test_matlab_4_of_the_other_byte_order_and_what_it_cannot_give(tmp_path):
    path = tmp_path / "a.mat"
    numbers = struct.pack(">5i", 1000, 3, 1, 0, 2) + b"x\0" + struct.pack(">3d", 1, 2, 3)
    path.write_bytes(numbers)
    np.testing.assert_array_equal(io.read(path, rate=1).samples, [1, 2, 3])
    path.write_bytes(numbers + numbers[:40])
    with pytest.warns(ImpactsigWarning, match="cut short: 'x' is not complete"):
        assert len(io.read(path, rate=1)) == 3
    path.write_bytes(numbers + b"rest")
    with pytest.warns(ImpactsigWarning, match="cut short: a variable is not complete"):
        io.read(path, rate=1)
    savemat(path, {"x": X[:, 0], "z": X[:, 0] + 1j, "s": coo_array(np.eye(5))}, format="4")
    with pytest.warns(ImpactsigWarning, match="left out: it is sparse|complex") as told:
        assert io.read(path, rate=1).channels == ("x",)
    assert ["'z' is left out: it holds complex numbers" in str(w.message) for w in told] == [
        True,
        False,
    ]


def test_what_is_no_matlab_file_is_not_called_one(tmp_path):
    path = tmp_path / "a.mat"
    for content in (b"\0" * 15, b"\xff" * 500, b"\0\0\0\0" + b"\1" * 100):
        path.write_bytes(content)
        with pytest.raises(UnreadableFile, match="named as MATLAB 5, but its content is not"):
            io.read(path, rate=1)
