"""The same two channels of whole numbers in every format that is read."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactsig.io as io

Written = tuple[Path, dict[str, Any]]
"""A file, and what has to be said to read it."""


def _audio(container: str, codec: str, ending: str) -> Callable[..., Written]:
    def write(folder: Path, x: np.ndarray, rate: int) -> Written:
        import soundfile

        path = folder / f"a{ending}"
        soundfile.write(str(path), x, rate, format=container, subtype=codec)
        return path, {"sensor": "force"}

    return write


def _npy(folder: Path, x: np.ndarray, rate: int) -> Written:
    np.save(folder / "a.npy", x)
    return folder / "a.npy", {"rate": rate}


def _npz(folder: Path, x: np.ndarray, rate: int) -> Written:
    np.savez(folder / "a.npz", a=x[:, 0], b=x[:, 1], rate=rate)
    return folder / "a.npz", {}


def _rows(x: np.ndarray, rate: int, separator: str) -> str:
    return "\n".join(
        separator.join((f"{i / rate:.6f}", str(a), str(b))) for i, (a, b) in enumerate(x)
    )


def _csv(folder: Path, x: np.ndarray, rate: int) -> Written:
    (folder / "a.csv").write_text("time,a,b\n" + _rows(x, rate, ","))
    return folder / "a.csv", {}


def _lvm(folder: Path, x: np.ndarray, rate: int) -> Written:
    (folder / "a.lvm").write_text(_rows(x, rate, "\t") + "\n")
    return folder / "a.lvm", {}


def _tdms(folder: Path, x: np.ndarray, rate: int) -> Written:
    nptdms = pytest.importorskip("nptdms")
    properties = {"wf_increment": 1 / rate}
    with nptdms.TdmsWriter(str(folder / "a.tdms")) as file:
        for part in (x[:300], x[300:301], x[301:]):
            file.write_segment(
                [nptdms.ChannelObject("g", n, part[:, i], properties) for i, n in enumerate("ab")]
            )
    return folder / "a.tdms", {}


def _hdf5(**packing: Any) -> Callable[..., Written]:
    def write(folder: Path, x: np.ndarray, rate: int) -> Written:
        h5py = pytest.importorskip("h5py")
        with h5py.File(folder / "a.h5", "w") as file:
            file.create_dataset("x", data=x, **packing).attrs["fs"] = rate
        return folder / "a.h5", {}

    return write


def _mat73(folder: Path, x: np.ndarray, rate: int) -> Written:
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "a.mat", "w", userblock_size=512) as file:
        file.create_dataset("x", data=x.T, chunks=True)
        file["fs"] = [[float(rate)]]
    with (folder / "a.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return folder / "a.mat", {}


def _mat5(packed: bool) -> Callable[..., Written]:
    def write(folder: Path, x: np.ndarray, rate: int) -> Written:
        from scipy.io import savemat

        savemat(folder / "a.mat", {"x": x, "fs": float(rate)}, do_compression=packed)
        return folder / "a.mat", {}

    return write


def _uff(binary: bool) -> Callable[..., Written]:
    def write(folder: Path, x: np.ndarray, rate: int) -> Written:
        with (folder / "a.uff").open("wb") as file:
            for values in x.T:
                file.write(_function(values, rate, binary))
        return folder / "a.uff", {}

    return write


def _function(values: np.ndarray, rate: int, binary: bool) -> bytes:
    numbers = values.astype("<f4").tobytes()
    form = f"b{1:6}{2:6}{11:12}{len(numbers):12}" if binary else ""
    head = f"    -1\n    58{form}\n" + "NONE\n" * 5
    head += f"{1:5}{0:10}{0:5}{0:10} {'hammer':<10}{0:10}{0:4} {'NONE':<10}{0:10}{0:4}\n"
    head += f"{2:10}{len(values):10}{1:10}{0.0:13.5E}{1 / rate:13.5E}{0.0:13.5E}\n"
    head += f"{17:10}{0:5}{0:5}{0:5} {'Time':<20} {'s':<20}\n"
    head += f"{0:10}{0:5}{0:5}{0:5} {'NONE':<20} {'NONE':<20}\n" * 3
    cells = [f"{value:13.5E}" for value in values]
    text = "\n".join("".join(cells[i : i + 6]) for i in range(0, len(cells), 6))
    return head.encode() + (numbers if binary else text.encode()) + b"\n    -1\n"


def _parquet(folder: Path, x: np.ndarray, rate: int) -> Written:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    table = pyarrow.table({"t": np.arange(len(x)) / rate, "a": x[:, 0], "b": x[:, 1]})
    parquet.write_table(table, folder / "a.parquet", row_group_size=250)
    return folder / "a.parquet", {}


def _feather(folder: Path, x: np.ndarray, rate: int) -> Written:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import feather

    table = pyarrow.table({"a": x[:, 0], "b": x[:, 1]}).replace_schema_metadata({"fs": str(rate)})
    feather.write_feather(table, folder / "a.feather", chunksize=250)
    return folder / "a.feather", {}


def _mdf(version: str, packed: int = 0) -> Callable[..., Written]:
    def write(folder: Path, x: np.ndarray, rate: int) -> Written:
        asammdf = pytest.importorskip("asammdf")
        times = np.arange(len(x)) / rate
        path = folder / ("a.mf4" if version >= "4" else "a.mdf")
        with asammdf.MDF(version=version) as file:
            columns = [
                asammdf.Signal(np.ascontiguousarray(x[:, i]), times, name=name, unit="N")
                for i, name in enumerate("ab")
            ]
            file.append(columns, common_timebase=True)
            file.save(path, compression=packed)
        return path, {}

    return write


def _ide(folder: Path, x: np.ndarray, rate: int) -> Written:
    write_ide(folder / "a.ide", x, rate, 100)
    return folder / "a.ide", {}


def write_ide(path: Path, x: np.ndarray, rate: int, block: int, **changed: Any) -> None:
    """Write blocks of int16, scaled by 1, by the library of enDAQ's loggers.

    `changed` replaces properties of the channel; `stamps` are added to those of the blocks, in
    ticks of 1 us, and `lost` names blocks that are left out.
    """
    pytest.importorskip("idelib")
    import ebmlite

    stamps, lost = changed.pop("stamps", {}), changed.pop("lost", ())
    schema = ebmlite.loadSchema("mide_ide.xml")
    parts = [{"SubChannelID": i, "SubChannelName": n, "SubChannelLabel": n, "SubChannelUnits": "N",
              "SubChannelCalibrationIDRef": 1} for i, n in enumerate("ab")]  # fmt: skip
    channel = {"ChannelID": 8, "ChannelFormat": "<hh", "ChannelName": "force",
               "TimeCodeScale": "1/1000000", "TimeCodeModulus": 1 << 40,
               "SubChannel": parts} | changed  # fmt: skip
    gain = {"CalID": 1, "CalReferenceValue": 0.0, "PolynomialCoef": [1.0, 0.0]}
    with path.open("wb") as file:
        schema.encode(file, {"EBML": {"DocType": "mide", "DocTypeVersion": 2}}, headers=False)
        schema.encode(file, {"CalibrationList": {"UnivariatePolynomial": [gain]}})
        schema.encode(file, {"RecordingProperties": {"ChannelList": {"Channel": [channel]}}})
        schema.encode(file, {"TimeBaseUTC": 1_600_000_000})
        for number, first in enumerate(range(0, len(x), block)):
            if number in lost:
                continue
            part = x[first : first + block].astype("<i2")
            begins = round(1e6 * first / rate) + stamps.get(number, 0)
            ends = round(1e6 * (first + len(part) - 1) / rate) + stamps.get(number, 0)
            held = {"ChannelIDRef": 8, "StartTimeCodeAbs": begins, "EndTimeCodeAbs": ends,
                    "ChannelDataPayload": part.tobytes()}  # fmt: skip
            schema.encode(file, {"ChannelDataBlock": held})


def _tradb(packed: bool) -> Callable[..., Written]:
    def write(folder: Path, x: np.ndarray, rate: int) -> Written:
        path = folder / "a.tradb"
        cuts = (0, len(x) // 2, len(x))
        parts = [(c, a, x[a:b, c]) for a, b in pairwise(cuts) for c in (0, 1)]
        write_tradb(path, [(c, a / rate, 0, part) for c, a, part in parts], rate, packed=packed)
        return path, {}

    return write


def write_tradb(
    path: Path,
    records: list[tuple[int, float, int, np.ndarray]],
    rate: int,
    volts: float = 1.0,
    packed: bool = False,
) -> None:
    """Write records (channel, time, samples before it, counts) by Vallen's library."""
    vallenae = pytest.importorskip("vallenae")
    vallenae.io.TraDatabase.create(str(path))
    with vallenae.io.TraDatabase(str(path), mode="rw", compression=packed) as file:
        with file.connection() as database:
            database.execute("INSERT INTO tr_params VALUES (1, 1, 1, 1.0, ?)", (1e3 * volts,))
        for number, (channel, time, before, counts) in enumerate(records, start=1):
            samples = (counts * volts).astype(np.float32)
            file.write(
                vallenae.io.TraRecord(
                    time, channel, 1, before, 0.0, rate, len(counts), samples, number
                )
            )


def _raw(folder: Path, x: np.ndarray, rate: int) -> Written:
    (folder / "a.bin").write_bytes(bytes(16) + x.astype(">i2").tobytes())
    layout = io.RawLayout("int16", channels=2, byte_order="big", skip=16)
    return folder / "a.bin", {"rate": rate, "raw": layout}


WRITERS: dict[str, Callable[..., Written]] = {
    "wav": _audio("WAV", "PCM_16", ".wav"),
    "flac": _audio("FLAC", "PCM_16", ".flac"),
    "vorbis": _audio("OGG", "VORBIS", ".ogg"),
    "npy": _npy,
    "npz": _npz,
    "csv": _csv,
    "lvm": _lvm,
    "tdms": _tdms,
    "hdf5": _hdf5(),
    "hdf5 packed": _hdf5(chunks=(100, 2), compression="gzip"),
    "matlab 7.3": _mat73,
    "matlab 5": _mat5(False),
    "matlab 5 packed": _mat5(True),
    "uff text": _uff(False),
    "uff binary": _uff(True),
    "parquet": _parquet,
    "feather": _feather,
    "mdf 3": _mdf("3.30"),
    "mdf 4": _mdf("4.10"),
    "mdf 4 packed": _mdf("4.10", packed=2),
    "ide": _ide,
    "tradb": _tradb(False),
    "tradb packed": _tradb(True),
    "raw": _raw,
}
