"""Validators of arguments: each returns the value or raises `InvalidInput`."""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterable
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from .errors import InvalidInput, shown

if TYPE_CHECKING:  # the command's help needs no arrays
    import numpy as np

Kind = TypeVar("Kind")
Seed: TypeAlias = "int | np.random.SeedSequence | np.random.Generator | None"


READING = (
    *("channel", "start", "stop", "rate", "resample", "scale", "offset", "unit", "sensor", "raw"),
)
"""Arguments of `read` that say how a recording is read."""
PER_CHANNEL = ("scale", "offset", "unit", "sensor")
"""Those that differ from channel to channel, where several are read."""


MOST_WORKERS = 4096
GREATEST = 2**62
"""Of whole numbers: what a kernel counts in."""


def number(
    name: str,
    value: Any,
    required: str = "",
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
) -> float:
    """A finite number within bounds; `required` may describe the bounds in other words.

    Raises
    ------
    InvalidInput
        If it is not one, or out of bounds. Text, truth values and arrays are not numbers.
    """
    given = real(value)
    if math.isfinite(given) and given > above and least <= given <= most:
        return given
    if not required:
        required = "a positive number" if above == 0 else "a finite number"
        if above and above > -math.inf:
            required += f" above {above:g}"
        if least > -math.inf and most < math.inf:
            required += f" from {least:g} to {most:g}"
        elif least > -math.inf:
            required += f", {least:g} or greater"
        elif most < math.inf:
            required += f", {most:g} or less"
    raise InvalidInput(name, value, required)


def real(value: Any) -> float:
    """A real number as a float; NaN for anything that is not one.

    Unlike `float`, it reads no text, converts no span of time and drops no imaginary part.
    """
    try:
        return float(value) if type(value) in (float, int) or _is_real(value) else math.nan
    except Exception:  # a value's own methods may raise anything
        return math.nan


def _is_real(value: Any) -> bool:
    if isinstance(value, (bool, str, bytes)) or getattr(value, "ndim", 0) != 0:
        return False
    return _kind(value) not in tuple("bmMSUV") and getattr(value, "imag", 0) == 0


def _kind(value: Any) -> str:
    """NumPy's letter for the kind of a number of its own; empty for others."""
    return str(getattr(getattr(value, "dtype", None), "kind", ""))


def one_or_several(name: str, value: Any, required: str) -> tuple[tuple[Any, ...], bool]:
    """The items of a sequence, or a single number in a tuple; and whether it was single.

    Raises
    ------
    InvalidInput
        If it is neither a number nor a sequence. The items are for the caller to validate.
    """
    if type(value) in (float, int, bool) or not math.isnan(real(value)):
        return (value,), True
    return entries(name, value, required), False


def pair(name: str, value: Any, required: str) -> tuple[Any, Any]:
    """The two items of a sequence.

    Raises
    ------
    InvalidInput
        If it is not a sequence of two. The items are for the caller to validate.
    """
    found = entries(name, value, required)
    if len(found) != 2:
        raise InvalidInput(name, value, required)
    return found[0], found[1]


def limits(
    name: str,
    value: Any,
    required: str,
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
) -> tuple[float, float]:
    """Two finite numbers within bounds, the first less than the second.

    Raises
    ------
    InvalidInput
        If they are not.
    """
    low, high = map(real, pair(name, value, required))
    if low > above and least <= low < high <= most and math.isfinite(high - low):
        return low, high
    raise InvalidInput(name, value, required)


def reals(name: str, value: Any, required: str) -> np.ndarray:
    """Real numbers of any shape as float64; no dates, text, complex or masked numbers.

    Raises
    ------
    InvalidInput
        If it holds anything else. NaN and infinities are for the caller to judge.
    """
    import numpy as np

    if type(value) is np.ndarray and value.dtype == np.float64:
        return value
    try:
        given = np.asarray(value)
        masked = (
            given is not value
            and isinstance(value, np.ndarray)
            and np.any(getattr(value, "mask", False))
        )
        if given.dtype.kind in "biufO" and not masked:
            return np.asarray(given, np.float64)
    except Exception:  # a value's own methods may raise anything
        pass
    raise InvalidInput(name, value, required)


def times_within(
    value: Any, start: float, stop: float, unit: str = "", ended: str = ""
) -> np.ndarray:
    """Times within the span of a motion, as float64 of any shape.

    Raises
    ------
    InvalidInput
        If one is outside, by more than rounding.
    """
    import numpy as np

    required = f"times in the span, {start:.9g} to {stop:.9g}{unit}{ended}"
    asked = reals("time", value, required)
    slack = 1e-12 * max(abs(start), abs(stop))
    if not np.all((asked >= start - slack) & (asked <= stop + slack)):
        raise InvalidInput("time", value, required)
    return asked


def text(name: str, value: Any) -> str:
    """A string.

    Raises
    ------
    InvalidInput
        If it is not one.
    """
    if isinstance(value, str):
        return value
    raise InvalidInput(name, value, "text")


def whole(name: str, value: Any, least: int, most: int = GREATEST) -> int:
    """A whole number within bounds.

    Raises
    ------
    InvalidInput
        If it is not one.
    """
    integral = _is_integral(value)
    if not integral or not least <= value <= most:
        bounds = f", {least} or greater" if most == GREATEST else f" from {least} to {most}"
        if integral and value > most == GREATEST:
            bounds = f" from {least} to {most}"
        raise InvalidInput(name, value, f"a whole number{bounds}")
    return int(value)


def _is_integral(value: Any) -> bool:
    """Whether it is a whole number, which neither a truth value nor a span of time is."""
    return isinstance(value, Integral) and not isinstance(value, bool) and _kind(value) != "m"


def choice(name: str, value: Any, choices: Iterable[str]) -> str:
    """One of several words.

    Raises
    ------
    InvalidInput
        If it is not one of them.
    """
    words = tuple(choices)
    if isinstance(value, str) and value in words:
        return value
    quoted = [f'"{word}"' for word in words]
    raise InvalidInput(name, value, " or ".join((", ".join(quoted[:-1]), quoted[-1])))


def flag(name: str, value: Any) -> bool:
    """True or False.

    Raises
    ------
    InvalidInput
        If it is neither.
    """
    if isinstance(value, bool) or type(value).__name__ in ("bool", "bool_"):  # or NumPy's
        return bool(value)
    raise InvalidInput(name, value, "True or False")


def function(name: str, value: Any, required: str, takes: int | None) -> Callable[..., Any]:
    """A callable that takes so many positional arguments, or, of None, any.

    Raises
    ------
    InvalidInput
        If it cannot be called, or not with so many.
    """
    if callable(value) and (takes is None or _can_take(value, takes)):
        return value
    raise InvalidInput(name, value, required)


def _can_take(value: Callable[..., Any], count: int) -> bool:
    """Whether a callable can be called with so many arguments, as far as its signature is known."""
    try:
        signature = inspect.signature(value)
    except Exception:  # written in C, or one whose own methods raise
        return True
    try:
        signature.bind(*range(count))
    except TypeError:
        return False
    return True


def instance(name: str, value: Any, kind: type[Kind], required: str = "", remedy: str = "") -> Kind:
    """An instance of a class.

    Raises
    ------
    InvalidInput
        If it is of another.
    """
    if isinstance(value, kind):
        return value
    article = "an" if kind.__name__[0] in "AEIO" else "a"
    raise InvalidInput(name, value, required or f"{article} {kind.__name__}", remedy)


def one_of_them(**given: Any) -> tuple[str, Any]:
    """Name and value of the only one of several arguments that is given.

    Raises
    ------
    InvalidInput
        If none is, or more than one.
    """
    present = [(name, value) for name, value in given.items() if value is not None]
    if len(present) == 1:
        return present[0]
    values = ", ".join(map(shown, given.values()))
    raise InvalidInput(", ".join(given), values, "one of them, and only one")


def refuse(of: str, remedy: str, **given: Any) -> None:
    """Refuse arguments that have no meaning for what they are given for.

    Raises
    ------
    InvalidInput
        If one is not None.
    """
    for name, value in given.items():
        if value is not None:
            raise InvalidInput(name, value, f"no {name} {of}", remedy)


def unless(default: float, value: Any) -> Any:
    """A value, or None where it is the default: what `refuse` takes of an argument that has one."""
    return None if isinstance(value, (int, float)) and value == default else value


def entries(name: str, value: Any, required: str) -> tuple[Any, ...]:
    """The items of a sequence that is not text.

    Raises
    ------
    InvalidInput
        If it is no sequence.
    """
    try:
        if not isinstance(value, (str, bytes)) and getattr(value, "ndim", 1) != 0:
            return tuple(value)
    except Exception:  # a value's own methods may raise anything
        pass
    raise InvalidInput(name, value, required)


def all_of(name: str, value: Any, kind: type[Kind], required: str) -> tuple[Kind, ...]:
    """The items of a sequence of instances of a class; a single instance stands for itself.

    Raises
    ------
    InvalidInput
        If one is of another class, or it is no sequence.
    """
    found = (value,) if isinstance(value, kind) else entries(name, value, required)
    if all(isinstance(one, kind) for one in found):
        return found
    raise InvalidInput(name, value, required)


def some_of(name: str, value: Any, choices: Iterable[str]) -> tuple[str, ...]:
    """One or several of several words, each once, in the order of `choices`.

    Raises
    ------
    InvalidInput
        If one is not among them or given twice, or there is none.
    """
    words = tuple(choices)
    required = f"some of {', '.join(words)}, each once"
    found = all_of(name, value, str, required)
    if not found or len(set(found)) < len(found) or not set(found) <= set(words):
        raise InvalidInput(name, value, required)
    return tuple(word for word in words if word in found)


def texts(name: str, value: Any, count: int, each: str) -> tuple[str, ...]:
    """A string for each of several things, such as the channels of a recording.

    Raises
    ------
    InvalidInput
        If they are not so many, or no texts.
    """
    required = f"one text {each} ({count})"
    found = entries(name, value, required)
    if len(found) == count and all(isinstance(one, str) for one in found):
        return tuple(str(one) for one in found)
    raise InvalidInput(name, value, required)


def path(name: str, value: Any) -> Path:
    """A path.

    Raises
    ------
    InvalidInput
        If it is not one.
    """
    if isinstance(value, (str, os.PathLike)):
        try:
            written = os.fspath(value)
            if b"\0" not in os.fsencode(written):
                return Path(written)
        except Exception:  # a text that no file system can encode, or a path that raises
            pass
    raise InvalidInput(name, value, "a path")


def path_list(files: Any) -> list[Path]:
    """The argument `files`: a list of paths.

    Raises
    ------
    InvalidInput
        If one is not a path, or it is a single path.
    """
    required = "several paths, in a list for example"
    if isinstance(files, os.PathLike):
        raise InvalidInput("files", files, required)
    return [path("files", one) for one in entries("files", files, required)]


def thread_count(workers: int | None) -> int:
    """Number of threads: as given, or the number of cores.

    Raises
    ------
    InvalidInput
        If it is not a whole number from 1 to `MOST_WORKERS`.
    """
    return os.cpu_count() or 1 if workers is None else whole("workers", workers, 1, MOST_WORKERS)


def streams(seed: Seed, count: int) -> list[np.random.Generator]:
    """Independent random generators, the same for the same seed; see `seed_sequence`."""
    import numpy as np

    seed = seed_sequence(seed)
    children = (
        np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, child))
        for child in range(count)
    )
    return [np.random.default_rng(child) for child in children]


def seed_sequence(seed: Seed) -> np.random.SeedSequence:
    """The seed sequence of a `seed` argument.

    A SeedSequence is not spawned from but read: given twice, it means the same twice. A Generator
    is drawn from, so that successive calls with it differ.

    Raises
    ------
    InvalidInput
        If it is none of these, nor a whole number, 0 or greater, nor None.
    """
    import numpy as np

    if isinstance(seed, np.random.SeedSequence):
        return seed
    if isinstance(seed, np.random.Generator):
        return np.random.SeedSequence(seed.integers(2**63, size=2).tolist())
    if seed is None or (_is_integral(seed) and seed >= 0):
        return np.random.SeedSequence(seed)
    raise InvalidInput("seed", seed, "a whole number >= 0, a SeedSequence or a Generator")
