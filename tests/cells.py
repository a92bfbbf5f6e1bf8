"""Functions to sweep, where other processes can import them."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from impactsig import InvalidInput


def waves(a, b):
    """A number, an array and a count, none of them round."""
    return {
        "sine": np.sin(a * b) / 3,
        "powers": np.array([a, a * b, np.exp(-b)]),
        "count": np.int64(a + b),
    }


def slow_waves(a, b):
    time.sleep(0.01)
    return waves(a, b)


def poisoned(a, b):
    if (a, b) == (1, 3):
        raise ValueError("no solution\nhere")
    return a + b


class Unprintable(Exception):
    def __str__(self):
        raise RuntimeError("no text")


def raising(kind, *arguments):
    """A function that raises in cell 2."""

    def cell(a):
        if a == 2:
            raise kind(*arguments)
        return a

    return cell


def raising_vectorized(kind, *arguments):
    def cells(a):
        if 2 in a:
            raise kind(*arguments)
        return 1.0 * a

    return cells


def killer(a, b):
    if (a, b) == (1, 3):
        os._exit(7)
    return a + b


def of_seed(a, seed):
    return np.random.default_rng(seed).standard_normal(2) + a


def of_seeds(a, seed):
    return np.array([of_seed(*pair) for pair in zip(a, seed, strict=True)])


def logged(folder):
    """A function that leaves a line for each cell it works out."""

    def noted(a, b):
        with Path(folder, "log").open("a") as log:
            log.write(f"{a} {b}\n")
        time.sleep(0.001)
        return waves(a, b)

    return noted


def contents(directory):
    """Every file of a directory, by its relative path."""
    files = (path for path in sorted(Path(directory).rglob("*")) if path.is_file())
    return {path.relative_to(directory).as_posix(): path.read_bytes() for path in files}


def same(one, other):
    """Whether two studies hold the same bits."""
    return (
        one.observables == other.observables
        and one.errors == other.errors
        and all(one[name].dtype == other[name].dtype for name in one.observables)
        and all(one[name].tobytes() == other[name].tobytes() for name in one.observables)
    )


def square(x):
    """A function of things, of which three end badly."""
    if x == 3:
        raise ZeroDivisionError("three")
    if x == 4:
        raise InvalidInput("x", x, "another")
    if x == 5:
        os._exit(7)
    return {"square": x * x}
