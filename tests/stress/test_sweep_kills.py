"""kill -9 at random instants: what is done stays done, and the store ends as if never killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from impactsig import open_study, sweep
from tests.cells import contents, logged, same, waves

pytest.importorskip("zarr")
pytest.importorskip("cloudpickle")
TILE = 5


def axes(rows):
    """Four tiles a row."""
    return {"a": np.arange(rows), "b": np.linspace(0, 1, 20)}


# A process that has loaded everything and starts the sweep in forked children, so that no time
# goes by on imports. It kills each after the time it reads, and says when the child had gone.
DRIVER = """
import os, signal, sys, time, warnings
import numpy as np, zarr
from impactsig import sweep
from tests.cells import logged
import cloudpickle, impactsig.studies.executors.processes
folder, log, executor, rows = sys.argv[1:]
axes = {"a": np.arange(int(rows)), "b": np.linspace(0, 1, 20)}
for line in sys.stdin:
    child = os.fork()
    if not child:
        sweep(logged(log), axes, directory=folder, tile=5, executor=executor,
              workers=None if executor == "serial" else 2)
        os._exit(0)
    time.sleep(float(line))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    print("killed", flush=True)
"""


def killed_often(kills, executor, rows, longest, tmp_path, seed):
    folder = tmp_path / "study"
    driver = subprocess.Popen(
        [sys.executable, "-c", DRIVER, str(folder), str(tmp_path), executor, str(rows)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    rng = np.random.default_rng(seed)
    log = tmp_path / "log"
    log.touch()
    tried = 0
    for _ in range(kills):
        done = finished(folder)
        before = log.stat().st_size
        driver.stdin.write(f"{rng.uniform(0, longest)}\n")
        driver.stdin.flush()
        assert driver.stdout.readline() == "killed\n"
        if executor == "processes":
            time.sleep(0.1)  # its workers leave when they see that it has gone
        # No cell of a tile that was done has been worked out again.
        again = {tile_of(line) for line in log.read_text()[before:].splitlines()}
        assert not again & done
        tried += len(again)
        assert done <= finished(folder)
        if done:
            assert open_study(folder).done.sum() == TILE * len(finished(folder))
    driver.stdin.close()
    assert driver.wait() == 0
    return folder, tried


def finished(folder):
    return {int(path.stem) for path in (folder / "done").glob("[0-9]*.json")}


def tile_of(line):
    a, b = line.split()
    return int(a) * 4 + round(float(b) * 19) // TILE


@pytest.mark.parametrize(
    ("kills", "executor", "rows", "longest"),
    [
        (10, "serial", 15, 0.25),
        pytest.param(50, "serial", 60, 0.25, marks=pytest.mark.slow),
        pytest.param(50, "processes", 150, 1.5, marks=pytest.mark.slow),
    ],
)
def test_killed_at_random_instants(kills, executor, rows, longest, tmp_path):
    seed = int.from_bytes(os.urandom(4))
    print("seed", seed)
    folder, tried = killed_often(kills, executor, rows, longest, tmp_path, seed)
    print(f"{len(finished(folder))} of {4 * rows} tiles after {kills} kills, {tried} begun")
    # One tile, or one for each worker and those on their way, was under way at each kill.
    assert tried - len(finished(folder)) <= kills * (1 if executor == "serial" else 4)
    study = sweep(logged(str(tmp_path)), axes(rows), directory=folder, tile=TILE)
    assert same(study, sweep(waves, axes(rows)))
    sweep(logged(str(tmp_path)), axes(rows), directory=tmp_path / "undisturbed", tile=TILE)
    assert contents(folder) == contents(tmp_path / "undisturbed")
    assert json.loads((folder / "study.json").read_text())["tile"] == [1, TILE]


def test_workers_leave_when_the_study_is_killed(tmp_path):
    """Even amid a cell that takes long."""
    program = (
        "import os, sys, time; from pathlib import Path; from impactsig import sweep\n"
        "def cell(a):\n"
        "    Path(sys.argv[1], str(os.getpid())).touch()\n"
        "    time.sleep(60)\n"
        "sweep(cell, {'a': [1, 2]}, tile=1, executor='processes', workers=2)"
    ).replace("sys.argv[1]", repr(str(tmp_path)))
    process = subprocess.Popen([sys.executable, "-c", program])
    try:
        until(lambda: len(list(tmp_path.iterdir())) == 2)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    for path in tmp_path.iterdir():
        until(lambda pid=int(path.name): not alive(pid))


def test_ctrl_c_at_a_terminal(tmp_path):
    """It reaches the worker processes too; the study ends at once and is kept."""
    folder = tmp_path / "study"
    program = (
        "import signal, sys, time; from impactsig import sweep\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's & ignores it
        "def cell(a):\n"
        "    time.sleep(0.05)\n"
        "    return a\n"
        "try:\n"
        "    sweep(cell, {'a': range(1000)}, tile=2, executor='processes', workers=2,\n"
        "          directory=sys.argv[1])\n"
        "except KeyboardInterrupt:\n"
        "    sys.exit('stopped')"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, str(folder)],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    until(lambda: len(finished(folder)) >= 2)
    os.killpg(process.pid, signal.SIGINT)
    _, told = process.communicate(timeout=30)
    assert told == "stopped\n"
    part = open_study(folder)
    assert 4 <= part.done.sum() < 1000
    np.testing.assert_array_equal(part["value"], np.where(part.done, np.arange(1000), np.nan))


def until(true, patience=30.0):
    end = time.monotonic() + patience
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def alive(pid):
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"
