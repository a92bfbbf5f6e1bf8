"""Worker process: reads a job and tasks on standard input, writes outcomes."""

from __future__ import annotations

import os
import pickle
import queue
import signal
import sys
import threading
from typing import Any, BinaryIO

from ...errors import InvalidInput
from .._cells import run_cells
from .._grid import Task
from .payload import unpack


def main() -> None:
    """Answer with None once ready, then with the outcome of each task, until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that has asked
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # What the function prints must not come among the answers, nor may it read the requests.
    os.dup2(2, 1)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    try:
        job = unpack(pickle.load(requests))
    except InvalidInput as error:
        _answer(answers, error)
        return
    tasks: queue.SimpleQueue[Task] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, tasks), daemon=True).start()
    answer: Any = None
    while True:
        _answer(answers, answer)
        try:
            answer = run_cells(job, tasks.get())
        except InvalidInput as error:
            answer = error
        except KeyboardInterrupt:  # from the function, as Ctrl-C is ignored here
            answer = KeyboardInterrupt()


def _listen(requests: BinaryIO, tasks: queue.SimpleQueue[Task]) -> None:
    """Queue incoming tasks; exit at once, even amid a task, when the parent has gone."""
    try:
        while True:
            tasks.put(pickle.load(requests))
    except Exception:
        sys.stderr.flush()
        os._exit(0)


def _answer(answers: BinaryIO, answer: Any) -> None:
    try:
        pickle.dump(answer, answers)
        answers.flush()
    except BrokenPipeError:
        os._exit(0)
