"""Chaotic flows whose spikes are reconstructed: Lorenz', Rössler's, and any of the user's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from .._arguments import entries, function, number, text
from ..errors import InvalidInput

__all__ = ["Flow", "lorenz", "rossler"]


@dataclass(frozen=True)
class Flow:
    """A flow, ``dy/dt = f(t, y)``, as data.

    Parameters
    ----------
    function : callable
        ``function(t, y, *parameters)`` returns the rate of change of every coordinate, as a tuple
        or an array, as for `scipy.integrate.solve_ivp`. It must be a function that numba can
        compile.
    initial : sequence of float, shape (d,)
        State to start from by default; its length is the dimension of the flow.
    parameters : sequence of float
        Parameters of the function. Changing them does not recompile it, unlike changing constants
        inside the function.
    signal : callable, optional
        ``signal(y)``, a number: what `integrate_and_fire` integrates by default.
    coordinates : sequence of str, optional
        Names of the coordinates; by default x, y, z, or y0, y1, ... where there are more.
    name : str
        Name of the flow in results.

    Raises
    ------
    InvalidInput
        If a parameter is invalid. The functions are compiled when they are first used.

    See Also
    --------
    flows.rossler, flows.lorenz, simulate, threshold_crossings

    Examples
    --------
    >>> import math
    >>> from impactsig import Flow
    >>> def duffing(t, y, damping, amplitude):
    ...     return y[1], y[0] - y[0] ** 3 - damping * y[1] + amplitude * math.cos(t)
    >>> flow = Flow(duffing, initial=(0.1, 0.0), parameters=(0.15, 0.3))
    >>> flow.dimension, flow.coordinates
    (2, ('x', 'y'))
    """

    function: Callable[..., Any]
    initial: Sequence[float]
    parameters: Sequence[float] = ()
    signal: Callable[[Any], float] | None = None
    coordinates: Sequence[str] = ()
    name: str = "flow"

    moved_by: ClassVar[str] = "impactsig.simulation.flows.flow_motion"
    time_unit: ClassVar[float] = 1.0
    in_seconds: ClassVar[bool] = False
    forcing_period: ClassVar[None] = None

    def __post_init__(self) -> None:
        if self.signal is not None:
            function("signal", self.signal, "a function of the state", 1)
        initial = _numbers("initial", self.initial)
        if not initial:
            raise InvalidInput("initial", self.initial, "a number for every coordinate")
        text("name", self.name)
        given: Any = self.coordinates
        names = tuple(given) if isinstance(given, str) else entries("coordinates", given, "names")
        if not names:
            few = len(initial) <= 3
            names = tuple("xyz"[: len(initial)] if few else (f"y{k}" for k in range(len(initial))))
        if not all(isinstance(name, str) for name in names):
            raise InvalidInput("coordinates", self.coordinates, "names")
        if len(names) != len(initial) or len(set(map(str, names))) != len(names):
            raise InvalidInput("coordinates", self.coordinates, f"{len(initial)} different names")
        parameters = _numbers("parameters", self.parameters)
        required = f"a function of t, y and {len(parameters)} parameters"
        function("function", self.function, required, 2 + len(parameters))
        object.__setattr__(self, "initial", initial)
        object.__setattr__(self, "parameters", parameters)
        object.__setattr__(self, "coordinates", names)

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return len(self.initial)

    def __repr__(self) -> str:
        given = "".join(f", {value:g}" for value in self.parameters)
        return f"Flow({self.name}{given}; {', '.join(self.coordinates)})"


def lorenz(sigma: float = 10.0, rho: float = 28.0, beta: float = 8 / 3) -> Flow:
    """Lorenz' flow [Lorenz1963]_.

    ``x' = sigma (y - x),  y' = x (rho - z) - y,  z' = x y - beta z``. For the default parameters,
    those of Lorenz, the largest exponent is 0.906 and the correlation dimension 2.05. Its signal is
    ``(x + 2)²``, as in [Sauer1994]_.

    Parameters
    ----------
    sigma, rho, beta : float
        Parameters of the equations: Prandtl number, relative Rayleigh number, and a geometric
        factor.

    Returns
    -------
    Flow
        The flow, with the coordinates x, y and z (no units) and a state to start from as `initial`.

    See Also
    --------
    impactsig.flows.rossler, impactsig.Flow

    Examples
    --------
    >>> from impactsig import flows, simulate
    >>> motion = simulate(flows.lorenz(), duration=20, transient=5)
    >>> motion.status
    'complete'
    """
    return Flow(
        lorenz_rates,
        initial=(-7.0, -9.0, 22.0),
        parameters=(sigma, rho, beta),
        signal=lorenz_signal,
        name="Lorenz",
    )


def rossler(a: float = 0.2, b: float = 0.2, c: float = 5.7) -> Flow:
    """Rössler's flow [Rossler1976]_.

    ``x' = -y - z,  y' = x + a y,  z' = b + z (x - c)``. For the default parameters, those of
    Rössler, the largest exponent is 0.071. Its signal is ``x + 20``, which is positive on the
    attractor (x > -10), as integrate-and-fire requires [CastroSauer1997]_; the value 20 is our
    choice.

    Parameters
    ----------
    a, b, c : float
        Parameters of the equations.

    Returns
    -------
    Flow
        The flow, with the coordinates x, y and z (no units) and a state to start from as `initial`.

    See Also
    --------
    impactsig.flows.lorenz, impactsig.Flow

    Examples
    --------
    >>> from impactsig import flows, threshold_crossings
    >>> train = threshold_crossings(flows.rossler(), 0.0, signal="x", count=11, transient=200)
    >>> float(train.intervals().mean().round(1))
    5.9
    """
    return Flow(
        rossler_rates,
        initial=(-5.0, -5.0, 0.02),
        parameters=(a, b, c),
        signal=rossler_signal,
        name="Rössler",
    )


def lorenz_rates(t: float, y: Any, sigma: float, rho: float, beta: float) -> Any:
    """Right-hand side of `lorenz`."""
    return sigma * (y[1] - y[0]), y[0] * (rho - y[2]) - y[1], y[0] * y[1] - beta * y[2]


def lorenz_signal(y: Any) -> Any:
    """Signal of `lorenz`."""
    return (y[0] + 2.0) ** 2


def rossler_rates(t: float, y: Any, a: float, b: float, c: float) -> Any:
    """Right-hand side of `rossler`."""
    return -y[1] - y[2], y[0] + a * y[1], b + y[2] * (y[0] - c)


def rossler_signal(y: Any) -> Any:
    """Signal of `rossler`."""
    return y[0] + 20.0


def _numbers(name: str, values: Any) -> tuple[float, ...]:
    """Finite numbers as a tuple."""
    required = "a sequence of finite numbers"
    return tuple(number(name, value, required) for value in entries(name, values, required))
