"""The same two channels of whole numbers in every format that is read."""

from __future__ import annotations

from collections.abc import Callable
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
    "raw": _raw,
}
