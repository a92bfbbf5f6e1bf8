"""Batches of oscillators that differ in numbers only: columns in place of numbers."""

from __future__ import annotations

import functools
import html
import inspect
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from .._arguments import reals
from .._showing import html_table
from ..errors import InvalidInput
from .oscillator import Oscillator
from .parts import columns_allowed

if TYPE_CHECKING:
    import numpy as np

Scene = TypeVar("Scene", bound=Callable[..., Any])


class OscillatorBatch(Sequence[Oscillator]):
    """Oscillators that a scene makes of arrays; `simulate` moves all of them in one compiled call.

    Its items are the oscillators, created on access, in the order of the flattened arrays.

    Attributes
    ----------
    shape : tuple of int
        Shape of the arrays, broadcast.
    parameters : mapping of str to ndarray
        The arrays by the names of the scene's parameters, each of that shape.
    columns : Oscillator
        The structure, with an array of one value per oscillator for each number.

    See Also
    --------
    impactsig.scenes.karpodinis, impactsig.simulate_many, impactsig.lyapunov_spectrum

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import scenes, simulate
    >>> beams = scenes.karpodinis(np.array([22.1, 22.2]))
    >>> simulate(beams, periods=20, transient=500, keep="counts").impact_count
    array([20, 20])
    """

    moved_by = "impactsig.simulation.batches.many"

    def __init__(
        self,
        columns: Oscillator,
        parameters: Mapping[str, np.ndarray],
        shape: tuple[int, ...],
        item: Callable[[int], Oscillator],
    ) -> None:
        self.columns, self.shape = columns, shape
        self.parameters = MappingProxyType(dict(parameters))
        self._item = item

    def __len__(self) -> int:
        return math.prod(self.shape)

    def __getitem__(self, which: Any) -> Any:
        if isinstance(which, slice):
            return [self[k] for k in range(*which.indices(len(self)))]
        return self._item(index(which, self.shape))

    def __iter__(self) -> Iterator[Oscillator]:
        return map(self._item, range(len(self)))

    def __repr__(self) -> str:
        names = ", ".join(self.parameters)
        return f"OscillatorBatch({len(self)} oscillators over {names})"

    def _repr_html_(self) -> str:
        shape = " x ".join(map(str, self.shape))
        rows = [("shape", shape)]
        rows += [(name, _spread(values)) for name, values in self.parameters.items()]
        return f"<div><code>{html.escape(repr(self))}</code>{html_table(rows)}</div>"


def _spread(values: np.ndarray) -> str:
    """Least and greatest of some numbers, as text."""
    low, high = float(values.min()), float(values.max())
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"


def index(which: Any, shape: tuple[int, ...]) -> int:
    """Place in the flattened array of an index, which is a number or one for each axis."""
    if isinstance(which, tuple):
        import numpy as np

        which = np.ravel_multi_index(
            tuple(k + n * (k < 0) for k, n in zip(which, shape, strict=True)), shape
        )
    size = math.prod(shape)
    if not -size <= which < size:
        raise IndexError(f"no item {which} among {size}")
    return int(which) % size


def takes_arrays(*numbers: str) -> Callable[[Scene], Scene]:
    """Let a scene take arrays for its parameters, except for those that must be `numbers`.

    With arrays it makes an `OscillatorBatch`, whose items are what it makes of their entries.
    """

    def decorate(scene: Scene) -> Scene:
        signature = inspect.signature(scene)

        @functools.wraps(scene)
        def made(*args: Any, **options: Any) -> Any:
            arrays = [value for value in (*args, *options.values()) if _is_array(value)]
            if not arrays:
                return scene(*args, **options)
            given = signature.bind(*args, **options).arguments
            more = given.pop("changes", {})
            return _batch(scene, given, more, numbers)

        return made  # type: ignore[return-value]

    return decorate


def _is_array(value: Any) -> bool:
    """Whether a value holds a number, or a pair of numbers, for each oscillator."""
    if isinstance(value, (tuple, list)):
        return any(_is_array(one) for one in value)
    return getattr(value, "ndim", 0) > 0


def _batch(
    scene: Callable[..., Any], given: dict[str, Any], more: dict[str, Any], numbers: tuple[str, ...]
) -> OscillatorBatch:
    """The batch that a scene makes of arrays."""
    import numpy as np

    parameters: dict[str, Any] = {}
    for name, value in given.items():
        if not _is_array(value):
            continue
        required = "a number, or an array of numbers"
        if name in numbers:
            raise InvalidInput(name, value, "a number, the same for all oscillators of a batch")
        if isinstance(value, (tuple, list)):
            parts: Any = [reals(name, one, required) for one in value]
            parameters |= {f"{name}[{k}]": part for k, part in enumerate(parts)}
        else:
            parameters[name] = reals(name, value, required)
    for name, value in more.items():
        if _is_array(value):
            raise InvalidInput(name, value, "one value for all oscillators of a batch")
    try:
        shape = np.broadcast_shapes(*(value.shape for value in parameters.values()))
    except ValueError:
        shapes = ", ".join(str(value.shape) for value in parameters.values())
        raise InvalidInput(
            ", ".join(parameters), f"shapes {shapes}", "shapes that broadcast against each other",
            "Give one an axis of length 1, as in frequency[:, None]",
        ) from None  # fmt: skip
    if not math.prod(shape):
        raise InvalidInput(", ".join(parameters), f"shape {shape}", "at least one number")
    full = {name: np.broadcast_to(value, shape) for name, value in parameters.items()}
    flat = {name: np.ascontiguousarray(value).ravel() for name, value in full.items()}
    for value in flat.values():
        value.flags.writeable = False

    def arguments(pick: Callable[[np.ndarray], Any]) -> dict[str, Any]:
        """The scene's arguments, with something picked of every array."""
        found = dict(given)
        for name in given:
            if name in flat:
                found[name] = pick(flat[name])
            elif f"{name}[0]" in flat:
                found[name] = tuple(pick(flat[f"{name}[{k}]"]) for k in range(len(given[name])))
        return found

    def item(k: int) -> Oscillator:
        return scene(**arguments(lambda values: float(values[k])), **more)

    token = columns_allowed.set(True)
    try:
        columns = scene(**arguments(lambda values: values), **more)
    finally:
        columns_allowed.reset(token)
    _linear_between_events(columns)
    first = suspicious(columns)
    if first is not None:
        item(first)  # which is refused with the reason
    return OscillatorBatch(columns, full, shape, item)


def _linear_between_events(columns: Oscillator) -> None:
    """Refuse a structure that is not moved by compiled calls for many.

    Raises
    ------
    InvalidInput
        If it has a law, a Hertz stop or noise.
    """
    noise = columns.noise
    for name, value, there in (
        ("law", columns.law, columns.law is not None),
        ("stops", columns.stops, not all(stop.law.linear for stop in columns.stops)),
        ("noise", noise, noise is not None and noise.intensity > 0),
    ):
        if there:
            raise InvalidInput(
                name, value, "none in a batch, whose oscillators are linear between events",
                "Make them one by one: [scene(value) for value in values]",
            )  # fmt: skip


def suspicious(columns: Oscillator) -> int | None:
    """Index of the first oscillator with misplaced stops or forcing at resonance."""
    import numpy as np

    wrong: Any = np.zeros(1, bool)
    for a, b in itertools.combinations(columns.stops, 2):
        if a.side != b.side:
            lower, upper = (a, b) if a.side == "lower" else (b, a)
            wrong = wrong | (np.asarray(lower.position) >= upper.position)
            continue
        wrong = wrong | (np.asarray(a.position) == b.position)
        for near, far in ((a, b), (b, a)):
            if near.law.rigid:
                wrong = wrong | (a.sign * np.asarray(near.position) < a.sign * far.position)
    for frequency in columns.angular_frequencies:
        with np.errstate(over="ignore"):  # far from resonance
            natural = np.divide(columns.stiffness, columns.mass)
            detuning = natural / frequency / frequency - 1.0
            loss = np.divide(columns.damping, columns.mass) / frequency
            wrong = wrong | (np.hypot(detuning, loss) < 2e-6)
    return int(np.argmax(wrong)) if np.any(wrong) else None
