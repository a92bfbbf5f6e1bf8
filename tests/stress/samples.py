"""A small file of every format, with what its readers look for: names, units, rates, times."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..files import WRITERS, write_ide, write_tradb

COUNT = 300
X = np.random.default_rng(11).integers(-9000, 9000, (COUNT, 2)).astype(np.int16)
T = np.arange(COUNT) / 1000


def audio(container: str, codec: str, ending: str):
    def write(folder: Path) -> Path:
        import soundfile

        path = folder / f"{codec}{ending}".lower()
        soundfile.write(str(path), X, 8000, format=container, subtype=codec)
        return path

    return write


def npy(folder: Path) -> Path:
    np.save(folder / "a.npy", X)
    return folder / "a.npy"


def npz(folder: Path) -> Path:
    np.savez(folder / "a.npz", a=X[:, 0], t=T, fs=1000.0)
    return folder / "a.npz"


def npz_packed(folder: Path) -> Path:
    np.savez_compressed(folder / "b.npz", pair=X * 1.0, rate=1000)
    return folder / "b.npz"


def csv(folder: Path) -> Path:
    rows = (f"{t:.3f},{a},{b / 7:.5f}" for t, (a, b) in zip(T, X, strict=True))
    (folder / "a.csv").write_text("time,a,b\ns,N,mV\n" + "\n".join(rows) + "\n")
    return folder / "a.csv"


def comma(folder: Path) -> Path:
    rows = (f"{t:.3f};{a / 3:.4f}".replace(".", ",") for t, a in zip(T, X[:, 0], strict=True))
    (folder / "b.txt").write_text("# written by hand\nZeit [s];Kraft (N)\n" + "\n".join(rows))
    return folder / "b.txt"


def lvm(folder: Path) -> Path:
    head = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nX_Columns\tOne\n"
    head += "***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t300\t300\t\nDate\t2013/08/30\t"
    head += "2013/08/30\t\nTime\t09:18:17\t09:18:17\t\nY_Unit_Label\tg\tg\t\nX_Dimension\tTime\t"
    head += "Time\t\nX0\t0.0E+0\t0.0E+0\t\nDelta_X\t0.001\t0.001\t\n***End_of_Header***\t\t\t\n"
    rows = (f"{t:.6f}\t{a}\t{b}\t" for t, (a, b) in zip(T, X, strict=True))
    (folder / "a.lvm").write_text(head + "X_Value\tF\tm_1\tComment\n" + "\n".join(rows) + "\n")
    return folder / "a.lvm"


def tdms(folder: Path) -> Path:
    import nptdms

    properties = {"wf_increment": 1e-3, "unit_string": "N"}
    with nptdms.TdmsWriter(str(folder / "a.tdms")) as file:
        for part in (X[:100], X[100:101], X[101:]):
            file.write_segment(
                [nptdms.ChannelObject("g", n, part[:, i], properties) for i, n in enumerate("ab")]
            )
    return folder / "a.tdms"


def hdf5(folder: Path) -> Path:
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file["run/t"], file["run/x"] = T, X
        file["run/x"].attrs.update({"unit": "N", "channels": ["left", "right"]})
        file["soft"] = h5py.SoftLink("/run/x")
        file.attrs["fs"] = 1000.0
    return folder / "a.h5"


def hdf5_packed(folder: Path) -> Path:
    import h5py

    table = np.zeros(COUNT, [("t", "f8"), ("x", "f4"), ("s", "S3")])
    with h5py.File(folder / "b.h5", "w", libver="latest") as file:
        for number, packing in enumerate([{"compression": "gzip"}, {"compression": "lzf"}]):
            file.create_dataset(f"x{number}", data=X, chunks=(100, 2), shuffle=True, **packing)
        file.create_dataset("log", data=table, chunks=(64,), fletcher32=True)
    return folder / "b.h5"


def hdf5_indexed(folder: Path) -> Path:
    import h5py

    with h5py.File(folder / "c.h5", "w", libver="latest") as file:
        file.create_dataset("x", data=X[:, 0], track_order=True).attrs["unit"] = "N"
        file["x"].attrs["fs"] = 1000.0
        for number in range(12):  # so many attributes are kept in a heap of another kind
            file.attrs[f"{number}"] = number
        file.attrs["channels"] = ["left", "right"]
        file["unit"] = "kN"
    return folder / "c.h5"


def mat73(folder: Path) -> Path:
    import h5py

    path = folder / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        kept = file.create_group("#refs#")
        kept["a"] = X[:, :1].T * 1.0
        file["c"] = np.array([[kept["a"].ref]], h5py.ref_dtype)
        file["run/x"] = X.T * 1.0
        file["run/fs"] = [[1000.0]]
        file["run/unit"] = np.array([[ord("N")]], np.uint16)
        for name, kind in [("c", "cell"), ("run", "struct"), ("run/unit", "char")]:
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def mat5(packed: bool):
    def write(folder: Path) -> Path:
        from scipy.io import savemat

        path = folder / f"packed_{packed}.mat"
        cells = np.empty(2, object)
        cells[:] = [X[:, 1], "text"]
        run = {"fs": 1000.0, "units": "N", "x": X, "deep": {"y": X[:, 0] * 0.5}}
        savemat(path, {"run": run, "c": cells, "t": T}, do_compression=packed)
        return path

    return write


def mat4(folder: Path) -> Path:
    from scipy.io import savemat

    path = folder / "old.mat"
    savemat(path, {"fs": 1000.0, "unit": "N", "x": X, "t": T}, format="4")
    return path


def uff(folder: Path) -> Path:
    def header(kind: int) -> str:
        return (
            "strike\nNONE\n18-Apr-16 13:49:58\nNONE\nNONE\n"
            f"{1:5}{0:10}{0:5}{0:10} {'hammer':<10}{4:10}{3:4} {'NONE':<10}{0:10}{0:4}\n"
            f"{kind:10}{COUNT:10}{1:10}{0.0:13.5E}{1e-3:13.5E}{0.0:13.5E}\n"
            f"{17:10}{0:5}{0:5}{0:5} {'Time':<20} {'s':<20}\n"
            f"{13:10}{0:5}{0:5}{0:5} {'Force':<20} {'N':<20}\n"
            + f"{0:10}{0:5}{0:5}{0:5} {'NONE':<20} {'NONE':<20}\n"
            * 2
        )

    cells = [f"{value:13.5E}" for value in X[:, 0]]
    rows = "\n".join("".join(cells[i : i + 6]) for i in range(0, COUNT, 6))
    numbers = X[:, 1].astype("<f4").tobytes()
    first = f"    58b{1:6}{2:6}{11:12}{len(numbers):12}\n"
    text = f"    -1\n    58\n{header(2)}{rows}\n    -1\n    -1\n{first}{header(2)}"
    (folder / "a.uff").write_bytes(text.encode() + numbers + b"\n    -1\n")
    return folder / "a.uff"


def table():
    import pyarrow

    fields = [("t", "float64"), ("x", "int16"), ("y", "float32")]
    columns = [T, X[:, 0], X[:, 1].astype(np.float32)]
    schema = pyarrow.schema(fields, metadata={"unit": "N"})
    return pyarrow.table(columns, schema=schema)


def parquet(folder: Path) -> Path:
    from pyarrow import parquet

    parquet.write_table(table(), folder / "a.parquet", row_group_size=100)
    return folder / "a.parquet"


def feather(packing: str):
    def write(folder: Path) -> Path:
        from pyarrow import feather

        path = folder / f"{packing}.feather"
        feather.write_feather(table(), path, compression=packing, chunksize=100)
        return path

    return write


def raw(folder: Path) -> Path:
    (folder / "a.raw").write_bytes(bytes(16) + X.tobytes())
    return folder / "a.raw"


def mdf(name: str):
    def write(folder: Path) -> Path:
        path, _ = WRITERS[name](folder, X, 1000)
        return path.rename(folder / f"{name}{path.suffix}")

    return write


def ide(folder: Path) -> Path:
    write_ide(folder / "a.ide", X, 1000, 50)
    return folder / "a.ide"


def tradb(packed: bool):
    def write(folder: Path) -> Path:
        path = folder / f"{'packed' if packed else 'counts'}.tradb"
        records = [(c, a / 1000, 0, X[a : a + 150, c]) for a in (0, 150) for c in (0, 1)]
        write_tradb(path, records, 1000, packed=packed)
        return path

    return write


SAMPLES = {
    "WAV": [audio("WAV", "PCM_16", ".wav"), audio("WAVEX", "FLOAT", ".wav")],
    "RF64": [audio("RF64", "PCM_24", ".rf64")],
    "W64": [audio("W64", "PCM_16", ".w64")],
    "AIFF": [audio("AIFF", "PCM_16", ".aiff")],
    "FLAC": [audio("FLAC", "PCM_16", ".flac")],
    "OGG": [audio("OGG", "VORBIS", ".ogg"), audio("OGG", "OPUS", ".ogg")],
    "TDMS": [tdms],
    "LVM": [lvm],
    "text": [csv, comma],
    "npy": [npy],
    "npz": [npz, npz_packed],
    "HDF5": [hdf5, hdf5_packed, hdf5_indexed],
    "MATLAB 7.3": [mat73],
    "MATLAB 4": [mat4],
    "MATLAB 5": [mat5(False), mat5(True)],
    "UFF 58": [uff],
    "Parquet": [parquet],
    "Feather": [feather("uncompressed"), feather("lz4"), feather("zstd")],
    "MDF": [mdf("mdf 3"), mdf("mdf 4"), mdf("mdf 4 packed")],
    "IDE": [ide],
    "tradb": [tradb(False), tradb(True)],
    "raw binary": [raw],
}
