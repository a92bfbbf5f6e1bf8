"""Pickle a job for other processes, and check that it arrives unchanged."""

from __future__ import annotations

import functools
import importlib.util
import pickle

from ...errors import ImpactsigError, InvalidInput
from .._cells import Job, brief, name_of
from ..fingerprint import code_of


def pack(job: Job, code: dict[str, str]) -> bytes:
    """Pickle a job, together with the names and digests of its code.

    Raises
    ------
    InvalidInput
        If the function cannot be pickled.
    """
    try:
        if importlib.util.find_spec("cloudpickle"):
            import cloudpickle

            function = cloudpickle.dumps(job.function)
        else:
            function = pickle.dumps(job.function)
    except Exception as error:
        raise InvalidInput(
            "function", f"{name_of(job.function)} ({brief(error)})",
            "one that can be pickled, to be sent to other processes",
            "Take a function of a module, install impactsig[studies], which can send those of a "
            'notebook as well, or use executor="threads"',
        ) from None  # fmt: skip
    return pickle.dumps((function, name_of(job.function), job.vectorized, job.key, code))


@functools.lru_cache(maxsize=4)
def unpack(payload: bytes) -> Job:
    """Unpickle a job in a worker.

    Raises
    ------
    InvalidInput
        If the function cannot be imported there, or is made of other code.
    """
    packed, name, vectorized, key, code = pickle.loads(payload)
    try:
        function = pickle.loads(packed)
        here = code_of(function)
    except ImpactsigError:
        raise
    except Exception as error:
        raise InvalidInput(
            "function", f"{name} ({brief(error)})", "one that can be imported where workers run",
            "Install its module there, or install impactsig[studies] on both sides",
        ) from None  # fmt: skip
    other = sorted(part for part in code | here if code.get(part) != here.get(part))
    if other:
        raise InvalidInput(
            "function", name, "the same code where workers run as here",
            f"Other there: {', '.join(other)}. Install the same there, or start the workers anew",
        )  # fmt: skip
    return Job(function, vectorized, key)
