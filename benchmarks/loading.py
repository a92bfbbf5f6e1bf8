"""Loading beside the bare library and beside pandas or NumPy: samples a second, and memory.

The readers of a format take turns in one process, over one file that the system has in memory, so
that a busy machine slows them alike: told are the medians, and of the ratio to the bare library its
standard error too. Memory is what a process of a reader's own grew by since it had imported what it
needs. Partial and block-wise reads are of two hours at 20 kS/s, and of HDF5 with its unit as a text
of any length too. Writes results/loading.json and loading.md.

    python -m benchmarks.loading              # needs: pip install -e ".[benchmarks]"
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .saving import save, versions

RATE = 50_000
COUNT = {"CSV": 3_000_000, "LVM": 3_000_000}
BINARY = 20_000_000  # so many that opening the file is no part of it
LONG_RATE = 20_000
LONG = 2 * 3600 * LONG_RATE
REPEATS, ROUNDS = 5, 15


# -- files -------------------------------------------------------------------------------------


def _audio(container: str, codec: str) -> Callable[[Path, np.ndarray, int], None]:
    def write(path: Path, x: np.ndarray, rate: int) -> None:
        import soundfile

        with soundfile.SoundFile(path, "w", rate, 1, codec, format=container) as file:
            for at in range(0, len(x), 1 << 22):
                file.write(x[at : at + (1 << 22)])

    return write


def _tdms(path: Path, x: np.ndarray, rate: int) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(path)) as file:
        file.write_segment([ChannelObject("g", "x", x, {"wf_increment": 1 / rate})])


def _hdf5(unit: str = "", **packing: Any) -> Callable[[Path, np.ndarray, int], None]:
    def write(path: Path, x: np.ndarray, rate: int) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            chunks = (min(1 << 16, len(x)),) if packing else None
            file.create_dataset("x", data=x, chunks=chunks, **packing).attrs["fs"] = float(rate)
            if unit:
                file["x"].attrs["unit"] = unit

    return write


def _mat5(packed: bool) -> Callable[[Path, np.ndarray, int], None]:
    def write(path: Path, x: np.ndarray, rate: int) -> None:
        from scipy.io import savemat

        savemat(path, {"x": x * 1.0, "fs": float(rate)}, do_compression=packed)

    return write


def _csv(path: Path, x: np.ndarray, rate: int) -> None:
    # Half as many rows: the times are numbers too.
    rows = (f"{i / rate:.6f},{value / 3276.8:.6f}\n" for i, value in enumerate(x[: len(x) // 2]))
    with path.open("w") as file:
        file.write("time,force [N]\n")
        file.writelines(rows)


def _lvm(path: Path, x: np.ndarray, rate: int) -> None:
    rows = (f"{i / rate:.6f}\t{value / 3276.8:.6f}\n" for i, value in enumerate(x[: len(x) // 2]))
    with path.open("w") as file:
        file.writelines(rows)


def _parquet(path: Path, x: np.ndarray, rate: int) -> None:
    import pyarrow
    from pyarrow import parquet

    table = pyarrow.table({"x": x.astype("f4")})
    parquet.write_table(table.replace_schema_metadata({"fs": str(rate)}), path)


def _feather(path: Path, x: np.ndarray, rate: int) -> None:
    import pyarrow
    from pyarrow import feather

    table = pyarrow.table({"x": x.astype("f4")})
    feather.write_feather(table.replace_schema_metadata({"fs": str(rate)}), path)


def _uff(path: Path, x: np.ndarray, rate: int) -> None:
    numbers = x.astype("<f4").tobytes()
    head = f"    -1\n    58b{1:6}{2:6}{11:12}{len(numbers):12}\n" + "NONE\n" * 5
    head += f"{1:5}{0:10}{0:5}{0:10} {'x':<10}{0:10}{0:4} {'NONE':<10}{0:10}{0:4}\n"
    head += f"{2:10}{len(x):10}{1:10}{0.0:13.5E}{1 / rate:13.5E}{0.0:13.5E}\n"
    head += f"{17:10}{0:5}{0:5}{0:5} {'Time':<20} {'s':<20}\n"
    head += f"{0:10}{0:5}{0:5}{0:5} {'NONE':<20} {'NONE':<20}\n" * 3
    path.write_bytes(head.encode() + numbers + b"\n    -1\n")


def _npy(path: Path, x: np.ndarray, rate: int) -> None:
    np.save(path, x)


def _npz(path: Path, x: np.ndarray, rate: int) -> None:
    np.savez_compressed(path, x=x, fs=rate)


def _raw(path: Path, x: np.ndarray, rate: int) -> None:
    x.tofile(path)


FILES = {
    "WAV": ("a.wav", _audio("WAV", "PCM_16")),
    "FLAC": ("a.flac", _audio("FLAC", "PCM_16")),
    "TDMS": ("a.tdms", _tdms),
    "HDF5": ("a.h5", _hdf5()),
    "HDF5 packed": ("b.h5", _hdf5(compression="gzip")),
    "MATLAB 5": ("a.mat", _mat5(False)),
    "MATLAB 5 packed": ("b.mat", _mat5(True)),
    "UFF 58b": ("a.uff", _uff),
    "Parquet": ("a.parquet", _parquet),
    "Feather": ("a.feather", _feather),
    "npy": ("a.npy", _npy),
    "npz packed": ("a.npz", _npz),
    "raw": ("a.raw", _raw),
    "CSV": ("a.csv", _csv),
    "LVM": ("a.lvm", _lvm),
}
LONG_FILES = {name: FILES[name] for name in ("WAV", "TDMS", "HDF5", "HDF5 packed", "npy")}
LONG_FILES["HDF5 with a unit"] = "c.h5", _hdf5(unit="N")


# -- readers: path -> samples ------------------------------------------------------------------


def options(path: Path) -> dict[str, Any]:
    """What impactsig has to be told of a file."""
    import impactsig

    if path.suffix == ".raw":
        return {"rate": RATE, "raw": impactsig.RawLayout("int16")}
    return {"rate": RATE} if path.suffix == ".npy" else {}


def whole(path: Path) -> int:
    import impactsig

    return impactsig.read(path, **options(path)).samples.size


def second(path: Path) -> int:
    import impactsig

    return impactsig.read(path, start=5400.0, stop=5401.0, rate=LONG_RATE).samples.size


def blocks(path: Path) -> int:
    import impactsig

    found = impactsig.read_blocks(path, 10.0, rate=LONG_RATE)
    return sum(block.samples.size for block in found)


def bare(path: Path) -> int:
    """What the library under the reader does, to the same floating-point numbers."""
    ending = path.suffix
    if ending in (".wav", ".flac"):
        import soundfile

        return soundfile.read(path, dtype="float32")[0].size
    if ending == ".tdms":
        from nptdms import TdmsFile

        with TdmsFile.open(path) as file:
            return file["g"]["x"][:].astype("f4").size
    if ending == ".h5":
        import h5py

        with h5py.File(path) as file:
            return file["x"][:].astype("f4").size
    if ending == ".mat":
        from scipy.io import loadmat

        return loadmat(path)["x"].size
    if ending == ".parquet":
        from pyarrow import parquet

        return parquet.read_table(path).column("x").to_numpy().size
    if ending == ".feather":
        from pyarrow import feather

        return feather.read_table(path, memory_map=False).column("x").to_numpy().size
    if ending == ".csv":
        from pyarrow import csv

        return sum(column.to_numpy().size for column in csv.read_csv(path).columns)
    raise LookupError(ending)


def peer(path: Path) -> int:
    """What pandas, NumPy or SciPy do."""
    ending = path.suffix
    if ending == ".wav":
        from scipy.io import wavfile

        return wavfile.read(path)[1].astype("f4").size
    if ending in (".csv", ".lvm"):
        import pandas

        heading = 0 if ending == ".csv" else None
        separator = "," if ending == ".csv" else "\t"
        return pandas.read_csv(path, sep=separator, header=heading).to_numpy().size
    if ending == ".parquet":
        import pandas

        return pandas.read_parquet(path)["x"].to_numpy().size
    if ending == ".feather":
        import pandas

        return pandas.read_feather(path)["x"].to_numpy().size
    if ending == ".npy":
        return np.load(path).astype("f4").size
    if ending == ".npz":
        return np.load(path)["x"].astype("f4").size
    if ending == ".raw":
        return np.fromfile(path, "i2").astype("f4").size
    raise LookupError(ending)


READERS = {f.__name__: f for f in (whole, second, blocks, bare, peer)}


def one(reader: str, path: Path) -> dict[str, float]:
    """Time [s] and memory [MB] of a reader; run in a process of its own."""
    read = READERS[reader]
    small = path.with_name("small" + path.suffix)
    try:
        read(small if small.exists() else path)  # imports what it needs
    except LookupError:
        return {}
    except Exception:
        if reader != "second":  # the small file has no second there
            raise
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak
    before = memory("VmRSS")
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        count = read(path)
        seconds.append(time.perf_counter() - start)
    grown = memory("VmHWM") - before
    return {"s": min(seconds), "MS/s": count / min(seconds) / 1e6, "MB": grown}


def turns(path: Path) -> dict[str, dict[str, float]]:
    """Speed of whole, bare and peer over one file, one after the other in one process."""
    small = path.with_name("small" + path.suffix)
    taken: dict[str, list[float]] = {}
    counts = {}
    for name in ("whole", "bare", "peer"):
        try:
            READERS[name](small)  # imports what it needs
            taken[name] = []
        except LookupError:
            continue
    for _ in range(ROUNDS):
        for name, seconds in taken.items():
            start = time.perf_counter()
            counts[name] = READERS[name](path)
            seconds.append(time.perf_counter() - start)
    # A row of text is a time and a sample, for every reader.
    counts["whole"] *= 2 if path.suffix in (".csv", ".lvm") else 1
    found = {n: {"MS/s": counts[n] / statistics.median(s) / 1e6} for n, s in taken.items()}
    for name in set(taken) - {"whole"}:
        ratios = [b / a for a, b in zip(taken["whole"], taken[name], strict=True)]
        error = 1.25 * statistics.stdev(ratios) / len(ratios) ** 0.5
        found[name] |= {"ratio": statistics.median(ratios), "error": error}
    return found


def memory(kind: str) -> float:
    """Memory of this process [MB]: now (VmRSS), or at most so far (VmHWM)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(kind)) / 1024


def alone(reader: str, path: Path) -> Any:
    """`one`, or `turns`, in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.loading", reader, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


# -- tables ------------------------------------------------------------------------------------


def whole_table(folder: Path) -> list[dict]:
    lines = []
    for name, (file, write) in FILES.items():
        x = np.random.default_rng(0).integers(-3000, 3000, COUNT.get(name, BINARY))
        x = x.astype(np.int16)
        write(folder / file, x, RATE)
        write(folder / f"small{Path(file).suffix}", x[:2000], RATE)
        line: dict[str, Any] = {"format": name}
        shown = {"whole": "impactsig", "bare": "library", "peer": "pandas/NumPy"}
        for reader, result in alone("turns", folder / file).items():
            line[f"{shown[reader]} MS/s"] = result["MS/s"]
            line[f"{shown[reader]} MB"] = alone(reader, folder / file)["MB"]
            if reader == "bare":
                line["ours to library"], line["±"] = result["ratio"], result["error"]
        lines.append(line)
        print(line, file=sys.stderr)
        (folder / file).unlink()
        (folder / f"small{Path(file).suffix}").unlink()
    return lines


def long_table(folder: Path) -> list[dict]:
    x = np.tile(np.random.default_rng(1).integers(-3000, 3000, LONG // 8).astype(np.int16), 8)
    lines = []
    for name, (file, write) in LONG_FILES.items():
        write(folder / file, x, LONG_RATE)
        write(folder / f"small{Path(file).suffix}", x[:2000], LONG_RATE)
        part, through = alone("second", folder / file), alone("blocks", folder / file)
        lines.append(
            {
                "two hours of": name,
                "one second ms": part["s"] * 1e3,
                "one second MB": part["MB"],
                "blocks of 10 s MS/s": through["MS/s"],
                "blocks MB": through["MB"],
            }
        )
        print(lines[-1], file=sys.stderr)
        (folder / file).unlink()
        (folder / f"small{Path(file).suffix}").unlink()
    return lines


def main() -> None:
    from .detection import markdown

    with tempfile.TemporaryDirectory() as folder:
        tables = {"whole files": whole_table(Path(folder)), "long files": long_table(Path(folder))}
    libraries = ("numpy", "pandas", "scipy", "soundfile", "npTDMS", "h5py", "pyarrow")
    text = "".join(f"## {name}\n\n{markdown(lines)}\n" for name, lines in tables.items())
    save("loading", {"about": versions(*libraries), **tables}, text)
    print(text)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        reader, path = sys.argv[1], Path(sys.argv[2])
        print(json.dumps(turns(path) if reader == "turns" else one(reader, path)))
    else:
        main()
