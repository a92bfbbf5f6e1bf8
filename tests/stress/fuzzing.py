"""Mutants of small files, read one after the other in a child that may die of them.

Run as a module it is the child: it reads jobs from its standard input, makes each mutant from its
number, and writes what became of it. The parent (`campaign`) limits its time and memory, notes by
what mutant it died, and goes on with a new one.
"""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

HANG = 10.0
"""Time that one mutant may take [s]."""

ADDRESSES = 6 << 30
"""Address space of the child; what it really uses is measured."""

INTEGERS = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 10**6, 2**31 - 1, 2**31, 2**32 - 1, 2**40)
INTEGERS += (2**62, 2**63 - 1, 2**63, 2**64 - 1)


def mutant(content: bytes, seed: Iterable[int]) -> bytes:
    """A file with one to four things changed; half of them near its beginning or end."""
    rng = np.random.default_rng(list(seed))
    changed = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        size = len(changed)
        if size < 16:
            break
        near = int(rng.integers(0, min(size, 600)))
        places = (int(rng.integers(0, size)), int(rng.integers(0, size)), near, size - 1 - near)
        at = places[rng.integers(0, 4)]
        length = int(rng.integers(1, 1 << rng.integers(1, 8)))
        way = rng.integers(0, 6)
        if way == 0:
            changed[at] ^= 1 << rng.integers(0, 8)
        elif way == 1:
            changed[at : at + length] = rng.bytes(min(length, size - at))
        elif way == 2:
            del changed[max(16, at) :]
        elif way == 3:
            width = int(rng.choice([1, 2, 4, 8]))
            value = INTEGERS[rng.integers(0, len(INTEGERS))] % (1 << 8 * width)
            order = ("little", "big")[rng.integers(0, 2)]
            changed[at : at + width] = value.to_bytes(width, order)[: size - at]
        elif way == 4:
            del changed[at : at + length]
        else:
            changed[at:at] = rng.bytes(length)
    return bytes(changed)


# -- the child ---------------------------------------------------------------------------------


def attempt(path: Path, number: int, raw: bool) -> str:
    """Read a file, whole or in blocks; "read", or the name of what was raised."""
    import impactsig.io as io
    from impactsig.errors import ImpactsigError

    layout = {"raw": io.RawLayout("int16", channels=3, skip=16)} if raw else {}
    try:
        io.info(path, **layout)
        if number % 2:
            for _, block in zip(
                range(5), io.read_blocks(path, 0.1, rate=1000, **layout), strict=False
            ):
                block.samples.sum()
        else:
            io.read(path, rate=1000, **layout).samples.sum()
    except ImpactsigError as error:
        return type(error).__name__
    except Exception as error:
        return f"! {type(error).__name__}: {error}"[:200]
    return "read"


def serve() -> None:
    """Go through the jobs: mutants first to last of a sample."""
    import resource

    from tests.memory import forget, peak

    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    for line in sys.stdin:
        job = json.loads(line)
        forget()  # what another format took
        samples = [Path(path) for path in job["samples"]]
        held = [path.read_bytes() for path in samples]
        for number in range(job["first"], job["last"]):
            sample = samples[number % len(samples)]
            path = sample.with_name("mutant" + sample.suffix)
            path.write_bytes(mutant(held[number % len(samples)], (job["seed"], number)))
            print(json.dumps(["begins", number]), flush=True)
            became = attempt(path, number, sample.suffix == ".raw")
            print(json.dumps(["ends", number, became, peak()]), flush=True)
        print(json.dumps(["done"]), flush=True)


# -- the parent --------------------------------------------------------------------------------


@dataclass
class Report:
    """What became of the mutants of one format.

    Parameters
    ----------
    outcomes : Counter
        Number of mutants by "read" or by the error raised.
    wrong : list of str
        What must not happen: other exceptions, signals, hangs; each with its mutant.
    peak : float
        Greatest memory of the child [MB].
    """

    outcomes: Counter = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    peak: float = 0.0


class Child:
    """A reader of mutants that is started anew when it dies."""

    def __init__(self) -> None:
        self._process: subprocess.Popen | None = None

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _end(self) -> int:
        if self._process is None:
            return 0
        self._process.kill()
        code = self._process.wait()
        self._process.stdin.close()
        self._process.stdout.close()
        self._process = None
        return code

    def _start(self) -> subprocess.Popen:
        if self._process is None or self._process.poll() is not None:
            self._end()
            root = Path(__file__).resolve().parents[2]
            self._process = subprocess.Popen(
                [sys.executable, "-m", "tests.stress.fuzzing"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                cwd=root,
                env={**os.environ, "OMP_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2"},
            )
        return self._process

    def campaign(self, samples: list[Path], count: int, seed: int) -> Report:
        """Read `count` mutants of some samples."""
        report = Report()
        first = 0
        while first < count:
            process = self._start()
            job = {
                "samples": [str(s) for s in samples],
                "first": first,
                "last": count,
                "seed": seed,
            }
            process.stdin.write(json.dumps(job).encode() + b"\n")
            process.stdin.flush()
            first = self._follow(process, first, report)
        return report

    def _follow(self, process: subprocess.Popen, number: int, report: Report) -> int:
        """Note what the child writes, until it is done or dead; the mutant to go on with."""
        started = time.monotonic()
        # The first answer waits for the imports.
        allowed = HANG + 60
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            os.set_blocking(process.stdout.fileno(), False)
            rest = b""
            while True:
                if not selector.select(max(0.0, started + allowed - time.monotonic())):
                    self._end()
                    report.wrong.append(f"mutant {number} hangs")
                    return number + 1
                piece = os.read(process.stdout.fileno(), 1 << 16)
                if not piece:
                    code = process.wait()
                    self._end()
                    name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
                    report.wrong.append(f"mutant {number} ends the process: {name}")
                    return number + 1
                *lines, rest = (rest + piece).split(b"\n")
                for line in lines:
                    what, *told = json.loads(line)
                    if what == "done":
                        return sys.maxsize
                    number, started, allowed = told[0], time.monotonic(), HANG
                    if what == "ends":
                        _, became, peak = told
                        report.outcomes[became.split(":")[0]] += 1
                        report.peak = max(report.peak, peak)
                        if became.startswith("!"):
                            report.wrong.append(f"mutant {number} raises {became[2:]}")


if __name__ == "__main__":
    serve()
