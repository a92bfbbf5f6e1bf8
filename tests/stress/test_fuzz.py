"""Files that were changed at random are read, or refused by name: no crash, no hang, no flood.

Of each format so many mutants are read as IMPACTSIG_MUTANTS says, 60 by default; `-m slow` reads
10 000. What once broke stands as a test of its own beside those of its format. The counts are
printed with ``-s``, or written to the file that IMPACTSIG_FUZZ_REPORT names.
"""

from __future__ import annotations

import os
import zlib
from pathlib import Path

import pytest

from .fuzzing import Child, Report
from .samples import SAMPLES

MUTANTS = int(os.environ.get("IMPACTSIG_MUTANTS", 60))
ENOUGH = {"HDF5": "h5py", "MATLAB 7.3": "h5py", "TDMS": "nptdms", "Parquet": "pyarrow"}
ENOUGH["Feather"] = "pyarrow"
ENOUGH |= {"IDE": "idelib", "MDF": "asammdf", "tradb": "vallenae"}
LONG = ("IDE", "MDF")  # libraries that take 10 ms and more for each file
SEALED = ("FLAC", "OGG")  # by checksums, so that few mutants are read at all


@pytest.fixture(scope="module")
def child():
    pytest.importorskip("resource", reason="limits of memory are set by POSIX calls")
    with Child() as child:
        yield child


def fuzzed(child: Child, name: str, folder: Path, count: int) -> Report:
    if name in ENOUGH:
        pytest.importorskip(ENOUGH[name])
    samples = [write(folder) for write in SAMPLES[name]]
    report = child.campaign(samples, count, zlib.crc32(name.encode()))
    outcomes = ", ".join(f"{what} {n}" for what, n in report.outcomes.most_common())
    line = f"{name}: {count} mutants; {outcomes}; wrong {len(report.wrong)}; {report.peak:.0f} MB"
    print(line)
    if "IMPACTSIG_FUZZ_REPORT" in os.environ:
        with Path(os.environ["IMPACTSIG_FUZZ_REPORT"]).open("a") as file:
            file.write(line + "\n" + "".join(f"  {wrong}\n" for wrong in report.wrong))
    assert report.wrong == []
    assert report.peak < 1000
    assert set(report.outcomes) <= {"read", "UnreadableFile", "InvalidInput"}
    assert sum(report.outcomes.values()) == count
    # Mutants that are all refused, or all read, would test no reader.
    assert report.outcomes["read"] > 0
    return report


@pytest.mark.parametrize("name", SAMPLES)
def test_mutants_are_read_or_refused(child, name, tmp_path):
    share = 5 if name in SEALED else 1 / 3 if name in LONG else 1
    fuzzed(child, name, tmp_path, round(MUTANTS * share))


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLES)
def test_ten_thousand_mutants_are_read_or_refused(child, name, tmp_path):
    fuzzed(child, name, tmp_path, 10_000)
