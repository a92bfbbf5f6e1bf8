"""The motions of many oscillators: arrays of what each has as a number, and each when asked for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._extras import library
from ..._showing import Shown
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...oscillators.batch import index
from ..motion import Motion
from .moving import Moving

if TYPE_CHECKING:
    import xarray

NUMBERS = (
    *("start", "duration", "impact_count", "stick_count", "energy_lost"),
    *("displacement", "velocity", "phase", "status"),
)  # fmt: skip


class Motions(Shown, Sequence[Motion]):
    """Simulated motions of many oscillators, in the given order.

    ``motions[k]`` equals the result of `simulate` for that oscillator to the last bit; it is
    created on each access. Scalar attributes of `Motion` are arrays here.

    Attributes
    ----------
    systems : sequence of Oscillator
        The simulated oscillators.
    shape : tuple of int
        Shape of the arrays.
    start, duration : ndarray
        The spans after the transients [s].
    impact_count, stick_count : ndarray of int
        Numbers of impacts and sticks.
    energy_lost : ndarray
        As in `Motion`.
    displacement, velocity, phase : ndarray
        The states at the end; see `Motion.final`.
    status : ndarray of str
        As in `Motion`.

    See Also
    --------
    simulate_many, results.OscillatorBatch, results.Motion

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import scenes, simulate
    >>> motions = simulate(scenes.karpodinis(np.array([22.1, 22.2])), periods=20, transient=500)
    >>> motions.impact_count, len(motions[1].impacts)
    (array([20, 20]), 20)
    """

    start: np.ndarray
    duration: np.ndarray
    impact_count: np.ndarray
    stick_count: np.ndarray
    energy_lost: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    phase: np.ndarray
    status: np.ndarray

    def __init__(
        self,
        systems: Sequence[Oscillator],
        shape: tuple[int, ...],
        moved: Sequence[tuple[np.ndarray, Moving]],
        others: Mapping[int, Motion],
        keep: bool,
        parameters: Mapping[str, np.ndarray],
    ) -> None:
        self.systems, self.shape = systems, shape
        self._moved, self._others, self._keep = moved, others, keep
        self._parameters = {k: np.broadcast_to(own, shape) for k, own in parameters.items()}

    def __len__(self) -> int:
        return math.prod(self.shape)

    def __getitem__(self, which: Any) -> Any:
        if isinstance(which, slice):
            return tuple(self[k] for k in range(*which.indices(len(self))))
        k = index(which, self.shape)
        if k in self._others:
            return self._others[k]
        stack, place = self._places[:, k].tolist()
        system = self.systems[k if len(self.systems) > 1 else 0]
        return self._moved[stack][1].motion(place, system, self._keep)

    @cached_property
    def _places(self) -> np.ndarray:
        """In which stack each is, and where there."""
        places = np.zeros((2, len(self)), int)
        for number, (which, _) in enumerate(self._moved):
            places[0, which], places[1, which] = number, np.arange(len(which))
        return places

    @cached_property
    def _numbers(self) -> dict[str, np.ndarray]:
        found: dict[str, np.ndarray] = {}
        alone = {k: _numbers_of(motion) for k, motion in self._others.items()}
        moved = [(which, moving.totals()) for which, moving in self._moved]
        for name in NUMBERS:
            kinds = [part[name].dtype for _, part in moved]
            kinds += [np.asarray(part[name]).dtype for part in alone.values()]
            column = np.empty(len(self), np.result_type(*kinds) if kinds else float)
            for which, part in moved:
                column[which] = part[name]
            for k, part in alone.items():
                column[k] = part[name]
            found[name] = column.reshape(self.shape)
        return found

    def __getattr__(self, name: str) -> Any:
        if name in NUMBERS:
            return self._numbers[name]
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @property
    def impacts_per_period(self) -> np.ndarray:
        """Impacts in a forcing period, on average, of the shape of the batch.

        Raises
        ------
        InvalidInput
            If there is no forcing.
        """
        return self.impact_count / (self.duration / self._forcing_period)

    @property
    def _forcing_period(self) -> np.ndarray:
        """Forcing periods [s].

        Raises
        ------
        InvalidInput
            If there is no forcing.
        """
        periods = np.empty(len(self))
        for which, moving in self._moved:
            if not moving.stack.forcing.slot.size:
                raise InvalidInput("motions", repr(self), "forced motions")
            unit = moving.stack.columns.time_unit
            periods[which] = 2 * math.pi / moving.stack.forcing.omega * unit
        for k, motion in self._others.items():
            if motion.system.forcing_period is None:
                raise InvalidInput("motions", repr(self), "forced motions")
            periods[k] = motion.system.forcing_period
        return periods.reshape(self.shape)

    def to_xarray(self) -> xarray.Dataset:
        """The arrays as a labelled dataset, with the parameters of one axis as coordinates.

        Raises
        ------
        MissingExtra
            If xarray is not installed.
        """
        xarray = library("xarray", "studies", "Motions as labelled arrays")
        varies = {  # the axes of length above 1 along which an array is not the same number
            name: [axis for axis, step in enumerate(values.strides) if step]
            for name, values in self._parameters.items()
        }
        axes = [f"axis_{axis}" for axis in range(len(self.shape))]
        for name, along in varies.items():
            if len(along) == 1 and axes[along[0]].startswith("axis_"):
                axes[along[0]] = name
        coordinates = {}
        for name, values in self._parameters.items():
            own = tuple(slice(None) if axis in varies[name] else 0 for axis in range(values.ndim))
            coordinates[name] = ([axes[axis] for axis in varies[name]], values[own])
        return xarray.Dataset({name: (axes, getattr(self, name)) for name in NUMBERS}, coordinates)

    def __reduce__(self) -> tuple[Any, ...]:
        """To other processes, as motions of their own: compiled functions cannot go."""
        motions = dict(enumerate(self))
        systems = [motion.system for motion in motions.values()]
        parameters = {  # numpy would write out what is only broadcast
            name: values[tuple(slice(None if step else 1) for step in values.strides)]
            for name, values in self._parameters.items()
        }
        return Motions, (systems, self.shape, (), motions, self._keep, parameters)

    def __repr__(self) -> str:
        complete = int(np.count_nonzero(self.status == "complete")) if len(self) else 0
        failed = len(self) - complete
        return f"Motions({len(self)} motions{f', {failed} ended early' if failed else ''})"


def _numbers_of(motion: Motion) -> dict[str, Any]:
    """What a motion has as numbers."""
    found = {name: getattr(motion, name) for name in NUMBERS if hasattr(motion, name)}
    return found | dict(zip(("displacement", "velocity", "phase"), motion.final, strict=True))
