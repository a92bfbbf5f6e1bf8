"""The same bits on every executor; workers that die; what cannot be sent to other processes."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import stat
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from impactsig import (
    ImpactsigError,
    ImpactsigWarning,
    InvalidInput,
    MissingExtra,
    open_study,
    sweep,
)
from impactsig.studies._cells import Job
from impactsig.studies._grid import grid_of
from impactsig.studies.executors import payload
from impactsig.studies.executors.payload import pack, unpack
from impactsig.studies.fingerprint import code_of
from tests.cells import (
    Unprintable,
    killer,
    of_seed,
    poisoned,
    raising,
    raising_vectorized,
    same,
    slow_waves,
    waves,
)
from tests.cells_compiled import logistic

AXES = {"a": np.arange(4), "b": np.linspace(0.1, 0.9, 7)}
WHOLE = {"a": np.arange(4), "b": np.arange(7)}


@pytest.fixture(scope="module")
def cluster():
    """A dask cluster of two worker processes, which are replaced when they die."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        dashboard_address=None,
        silence_logs=logging.CRITICAL + 1,
    ) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def client(cluster):
    from distributed import Client

    with Client(cluster, set_as_default=False) as client:
        yield client


@pytest.mark.parametrize("workers", [1, 2, 4, 8])
def test_threads_give_the_same_bits(workers):
    axes = {"growth": np.linspace(3.5, 4, 40), "start": np.array([0.1, 0.2, 0.3])}
    for options in ({"tile": 7}, {}):
        study = sweep(
            logistic, axes, vectorized=True, executor="threads", workers=workers, **options
        )
        assert same(study, sweep(logistic, axes, vectorized=True))


@pytest.mark.parametrize("workers", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_processes_give_the_same_bits(workers):
    run = {"executor": "processes", "workers": workers}
    assert same(sweep(waves, AXES, tile=3, **run), sweep(waves, AXES))
    assert same(
        sweep(of_seed, {"a": range(30)}, seed=5, **run), sweep(of_seed, {"a": range(30)}, seed=5)
    )


@pytest.mark.slow
def test_a_compiled_kernel_is_sent_to_processes():
    axes = {"growth": np.linspace(3.5, 4, 40), "start": np.array([0.1, 0.2, 0.3])}
    options = {"vectorized": True, "tile": 20}
    study = sweep(logistic, axes, executor="processes", workers=2, **options)
    assert same(study, sweep(logistic, axes, **options))


def test_a_cluster_gives_the_same_bits(client, cluster):
    assert same(sweep(waves, AXES, tile=3, client=client), sweep(waves, AXES))
    axes = {"a": range(30)}
    study = sweep(of_seed, axes, seed=5, client=cluster.scheduler_address)
    assert same(study, sweep(of_seed, axes, seed=5))


@pytest.mark.parametrize("run", [{"executor": "threads"}, {"executor": "processes", "workers": 2}])
def test_a_poisoned_cell_is_the_same_everywhere(run):
    with pytest.warns(ImpactsigWarning):
        study, wanted = sweep(poisoned, WHOLE, tile=3, **run), sweep(poisoned, WHOLE)
    assert same(study, wanted)


RUNS = [{}, {"executor": "threads", "workers": 2}, {"executor": "processes", "workers": 1}]


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    ("raised", "text"),
    [
        ([Unprintable], "Unprintable"),
        ([SystemExit, 3], "SystemExit: 3"),
        ([asyncio.CancelledError], "CancelledError"),
    ],
)
@pytest.mark.parametrize("vectorized", [False, True])
def test_whatever_a_cell_raises_is_its_error(vectorized, raised, text, run):
    function = (raising_vectorized if vectorized else raising)(*raised)
    with pytest.warns(ImpactsigWarning, match=f"1 of 5 cells failed.*: {text}$"):
        study = sweep(function, {"a": range(5)}, tile=2, vectorized=vectorized, **run)
    assert study.errors == {(2,): text}
    np.testing.assert_array_equal(study["value"], [0, 1, np.nan, 3, 4])


@pytest.mark.parametrize("run", RUNS)
def test_a_keyboard_interrupt_in_a_cell_stops_the_sweep(run, tmp_path):
    """In a worker process, which ignores Ctrl-C, too; what is done is kept."""
    pytest.importorskip("zarr")
    axes = {"a": range(20, 1, -1)}
    run = run | {"workers": 1} if run else run  # or the second may be done before the first begins
    with pytest.raises(KeyboardInterrupt):
        sweep(raising(KeyboardInterrupt), axes, tile=1, directory=tmp_path, **run)
    done = open_study(tmp_path).done
    assert done[:10].all()
    assert not done[-1]


def test_on_a_cluster_cells_raise_as_elsewhere(client):
    with pytest.warns(ImpactsigWarning):
        study = sweep(raising(SystemExit), {"a": range(5)}, tile=2, client=client)
    assert study.errors == {(2,): "SystemExit"}
    before = set(client.nthreads())
    with pytest.raises(KeyboardInterrupt):
        sweep(raising(KeyboardInterrupt), {"a": range(5)}, tile=2, client=client)
    assert set(client.nthreads()) == before


# -- workers that die ------------------------------------------------------------------------------


def test_a_cell_that_kills_its_process_is_found():
    axes = {"a": range(2), "b": range(6)}
    with pytest.warns(ImpactsigWarning, match="1 of 12 cells failed"):
        study = sweep(killer, axes, tile=3, executor="processes", workers=2)
    assert study.errors == {(1, 3): "its worker process died (exit code 7)"}
    wanted = np.add.outer(np.arange(2.0), np.arange(6.0))
    wanted[1, 3] = np.nan
    np.testing.assert_array_equal(study["value"], wanted)


def test_a_process_that_takes_time_to_end_is_not_killed_first():
    """Its exit code says more than the signal that would end it."""

    def cell(a):
        import fcntl

        for descriptor in range(
            3, 64
        ):  # the pipe on which it answers, as at the end of any process
            with contextlib.suppress(OSError):
                access = fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE
                if access == os.O_WRONLY and stat.S_ISFIFO(os.fstat(descriptor).st_mode):
                    os.close(descriptor)
        time.sleep(0.3)
        os._exit(7)

    with pytest.warns(ImpactsigWarning):
        study = sweep(cell, {"a": [1]}, tile=1, executor="processes", workers=1)
    assert study.errors == {(0,): "its worker process died (exit code 7)"}


def test_a_cell_that_kills_leaves_the_cluster_alive(client):
    before = set(client.nthreads())
    with pytest.warns(ImpactsigWarning):
        study = sweep(killer, {"a": range(2), "b": range(4)}, tile=2, client=client)
    assert study.errors == {(1, 3): "its worker process died (exit code 7)"}
    assert set(client.nthreads()) == before


def test_processes_that_are_killed_are_replaced(tmp_path):
    """Each of the two, at random instants, while tiles are under way."""
    axes = {"a": np.arange(6), "b": np.linspace(0, 1, 8)}

    def noted(a, b):
        (tmp_path / str(os.getpid())).touch()
        return slow_waves(a, b)

    def kill():
        killed = set()
        while len(killed) < 2:
            time.sleep(0.05)
            for path in set(tmp_path.iterdir()) - killed:
                os.kill(int(path.name), signal.SIGKILL)
                killed.add(path)
                break

    murderer = threading.Thread(target=kill)
    murderer.start()
    study = sweep(noted, axes, tile=8, executor="processes", workers=2)
    murderer.join()
    assert len(list(tmp_path.iterdir())) > 2
    assert same(study, sweep(waves, axes))


def test_a_dask_worker_killed_twice(client, cluster):
    """What its tiles had is worked out by others, with the same bits."""
    axes = {"a": np.arange(6), "b": np.linspace(0, 1, 40)}
    killed = []

    def kill():
        for _ in range(2):
            time.sleep(0.7)
            pid = next(worker.pid for worker in cluster.workers.values() if worker.pid)
            os.kill(pid, signal.SIGKILL)
            killed.append(pid)

    murderer = threading.Thread(target=kill)
    murderer.start()
    study = sweep(slow_waves, axes, tile=10, client=client)
    murderer.join()
    assert len(set(killed)) == 2
    assert same(study, sweep(waves, axes))


def test_a_task_that_comes_after_its_sweep_starts_no_process(monkeypatch):
    """Word that a sweep is over may overtake the word that its tasks are not wanted."""
    pytest.importorskip("distributed")
    from impactsig.studies.executors import cluster as _cluster

    _cluster.release("a sweep")
    monkeypatch.setattr(subprocess, "Popen", None)
    with pytest.raises(ImpactsigError, match="stopped"):
        _cluster.work(
            "a sweep", pack(Job(waves, False, None), {}), grid_of(AXES).task(np.arange(3))
        )
    assert not _cluster._children


def test_a_pool_that_cannot_start_says_so(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(ImpactsigError, match=r"die before they are ready \(exit code 1\)"):
        sweep(waves, AXES, executor="processes", workers=1)


def test_no_process_is_left_behind():
    """Neither after the end, nor when a task fails amid others."""

    def wrong(a):
        time.sleep(0.05)
        return a.sum()

    for _ in range(2):
        with pytest.raises(InvalidInput, match="shape"):
            sweep(wrong, {"a": range(40)}, vectorized=True, tile=4, executor="processes", workers=2)
    children = subprocess.run(
        ["ps", "-o", "args=", "--ppid", str(os.getpid())], capture_output=True, text=True
    ).stdout
    assert "executors._worker" not in children


# -- what cannot be sent ---------------------------------------------------------------------------


def test_a_function_that_cannot_be_pickled_is_refused(monkeypatch):
    lock = threading.Lock()

    def held(a):
        with lock:
            return a

    with pytest.raises(InvalidInput, match=r"^function: .*held.*required: one that can be pickled"):
        sweep(held, {"a": [1]}, executor="processes")
    assert sweep(held, {"a": [1]}, executor="threads")["value"] == [1.0]
    monkeypatch.setattr(payload.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InvalidInput, match=r"install impactsig\[studies\]"):
        sweep(lambda a: a, {"a": [1]}, executor="processes")


def test_a_function_that_is_not_there_for_the_workers_is_refused(tmp_path, monkeypatch):
    (tmp_path / "gone_module.py").write_text("def f(a):\n    return a\n")
    monkeypatch.syspath_prepend(tmp_path)
    import gone_module

    (tmp_path / "gone_module.py").unlink()
    with pytest.raises(InvalidInput, match=r"required: one that can be imported where workers run"):
        sweep(gone_module.f, {"a": [1]}, executor="processes")


def test_workers_with_other_code_are_refused(tmp_path, monkeypatch):
    """A file that was edited after it was imported here."""
    path = tmp_path / "edited_module.py"
    path.write_text("def f(a):\n    return a\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    import edited_module

    path.write_text("def f(a):\n    return a + 1\n")
    with pytest.raises(InvalidInput, match=r"Other there: edited_module\.f"):
        sweep(edited_module.f, {"a": [1]}, executor="processes", workers=1)


def test_a_payload_arrives_as_it_left():
    job = Job(waves, False, 3)
    assert unpack(pack(job, code_of(waves))) == job
    with pytest.raises(InvalidInput, match="Other there: numpy"):
        unpack(pack(job, code_of(waves) | {"numpy": "0.1"}))


def test_packages_that_are_called_travel_with_a_function():
    # As in a notebook that has simulated before: cloudpickle takes along the packages named.
    lines = """
import impactsig
impactsig.simulate
def ratio(frequency):
    beam = impactsig.scenes.karpodinis(frequency)
    return impactsig.simulate(beam, periods=2).system.forces[0].angular_frequency
study = impactsig.sweep(ratio, {"frequency": [11.1, 22.2]}, executor="processes", workers=1)
assert study["value"].tolist() == [0.5, 1.0], study["value"]
"""
    subprocess.run([sys.executable, "-c", lines], check=True)


def test_what_a_function_prints_is_no_answer():
    def loud(a):
        print("loud", flush=True)
        os.write(1, b"louder")
        return a

    study = sweep(loud, {"a": range(4)}, executor="processes", workers=1)
    assert study["value"].tolist() == [0, 1, 2, 3]


# -- clusters that are not there -------------------------------------------------------------------


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "here"])
def test_a_cluster_that_is_not_there(address, monkeypatch):
    pytest.importorskip("distributed")
    from impactsig.studies.executors import cluster as _cluster

    monkeypatch.setattr(_cluster, "PATIENCE", "1s")
    with pytest.raises(InvalidInput, match=r"^client: got .* a dask scheduler that answers"):
        sweep(waves, AXES, client=address)


def test_a_client_that_is_closed(cluster):
    from distributed import Client

    client = Client(cluster, set_as_default=False)
    client.close()
    with pytest.raises(InvalidInput, match="a client that is connected"):
        sweep(waves, AXES, client=client)


def test_without_dask_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match=r"impactsig\[studies\]"):
        sweep(waves, AXES, client="tcp://127.0.0.1:9")
