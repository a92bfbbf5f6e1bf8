"""Dynamics of a recording from its intervals: each part a result, or the reason for none."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ...errors import ImpactsigError, ImpactsigWarning, InvalidInput

if TYPE_CHECKING:
    from ...impacts import Impacts
    from ...intervals import Periodicity, Repair
    from ...reconstruct.dimensions.dimension import CorrelationDimension
    from ...reconstruct.divergence.exponents import LyapunovExponent
    from ...reconstruct.testing.determinism import ReturnMapDeterminism
    from ...reconstruct.testing.surrogate_testing import SurrogateTest

DIMENSIONS = (1, 2, 3, 4, 5)
"""Embedding dimensions that the exponent chooses from."""

SEED = 0
"""Of surrogates: the same recording gives the same page."""

TESTED = 1500
"""Intervals, from the first on, that are held against surrogates: the cost grows as their square,
and the test of a thousand misses next to nothing."""

READ = 20_000
"""Intervals, from the first on, that dimension and exponent are read from."""

ROUGH_BELOW = 300
"""Intervals below which dimension and exponent are rough, whatever their 95 % intervals say."""

REPAIRED = 5000
"""Impacts up to which a repair is tried: that many take half a second."""

FEW_FALSE = 0.02
"""Share of false neighbours that an embedding for the exponent may have in any case, or else twice
the least: missed impacts and jumps of the impact map leave some in every dimension, which the
median of the exponent does not notice."""

Part = TypeVar("Part")


@dataclass(frozen=True, eq=False)
class Dynamics:
    """What the intervals reveal about the motion: dimension, exponent, surrogates, repair.

    Attributes
    ----------
    intervals : int
        Number of intervals.
    asked : bool
        Whether the parts that take seconds were requested.
    dimension : CorrelationDimension or None
        Correlation dimension of at most the first 20 000 intervals. For a train that is certainly
        periodic it is 0, with the verdict "periodic".
    exponent : LyapunovExponent or None
        Largest Lyapunov exponent of the same intervals.
    surrogates : SurrogateTest or None
        Surrogate test of at most the first 1500 intervals.
    determinism : ReturnMapDeterminism or None
        How far an interval determines the next, for the same intervals; for a periodic train
        without missed and spurious impacts, how far the timing deviation of an impact determines
        that of the next.
    false_share : float or None
        Share of false neighbours in the embedding of the exponent.
    repair : Repair or None
        Changes that `impactsig.repair_intervals` would make; None without a forcing frequency, with
        more than 5000 impacts, or if there are none.
    without : mapping of str to str
        Reason why a part is missing, by its name.
    """

    intervals: int
    asked: bool = False
    dimension: CorrelationDimension | None = None
    exponent: LyapunovExponent | None = None
    surrogates: SurrogateTest | None = None
    determinism: ReturnMapDeterminism | None = None
    false_share: float | None = None
    repair: Repair | None = None
    without: Mapping[str, str] = field(default_factory=dict)

    @property
    def periodic(self) -> bool:
        """Whether the train is periodic, so that there is no geometry to estimate."""
        return self.dimension is not None and self.dimension.verdict in ("periodic", "constant")

    @property
    def chaotic(self) -> bool:
        """Whether all signs of chaos are present: determinism, a dimension, diverging orbits."""
        return (
            self.surrogates is not None
            and self.surrogates.rejected
            and self.dimension is not None
            and self.dimension.verdict in ("dimension", "slope")
            and self.exponent is not None
            and grows(self.exponent)
        )

    @property
    def significant(self) -> bool:
        """Whether numbers fitted to the intervals say more than those of linear noise would."""
        return self.surrogates is None or self.surrogates.rejected

    def covers(self, found: LyapunovExponent) -> bool:
        """Whether the 95 % interval of the exponent has reliable coverage.

        The coverage was measured for at least 300 intervals without warnings.
        """
        return self.significant and self.intervals >= ROUGH_BELOW and not found.warnings

    @property
    def left_out(self) -> bool:
        """Whether parts were skipped that the user could ask for."""
        return not (self.asked or self.periodic)

    def describe(self) -> str:
        """The verdict in one sentence, without its full stop."""
        if self.periodic:
            assert self.dimension is not None
            within = self.dimension.noise / math.sqrt(2)
            words = (
                f"the intervals recur to within {short_time(within)}"
                if within
                else "the intervals recur"
            )
            return f"{words}: dimension 0, nothing fitted"
        if not self.asked:
            return "not asked for"
        test, found, exponent = self.surrogates, self.dimension, self.exponent
        if test is not None and not test.rejected:
            words = f"nothing tells these {self.intervals} intervals from linear noise"
            if not test.decided:
                words = f"not decided whether these {self.intervals} intervals are linear noise"
            return (
                words if found is exponent is None else f"{words}; trust no number fitted to them"
            )
        parts = ["not tested against noise" if test is None else "more than linear noise"]
        parts.append(_dimension_in_words(found))
        if exponent is not None and grows(exponent):
            parts.append(f"neighbouring trajectories separate {pace(exponent)}")
        elif exponent is not None and exponent.verdict == "no divergence":
            parts.append("neighbouring trajectories stay together")
        else:
            parts.append("no exponent tells chaos from order")
        words = "; ".join(parts)
        if self.chaotic:
            words = f"low-dimensional chaos by all three signs: {', '.join(parts)}"
        rough = found is not None and self.intervals < ROUGH_BELOW
        return f"{words} (roughly: few intervals)" if rough else words

    def __str__(self) -> str:
        return self.describe()


def _dimension_in_words(found: CorrelationDimension | None) -> str:
    if found is not None and found.dimension is not None:
        return f"dimension {found.dimension:.2f}"
    if found is not None and found.slope is not None:
        return f"slope {found.slope.value:.2f} between two scales, which need not be the dimension"
    return "no dimension could be read"


def grows(exponent: LyapunovExponent) -> bool:
    """Whether neighbouring trajectories certainly diverge."""
    return (
        exponent.verdict == "divergence"
        and exponent.interval is not None
        and exponent.interval[0] > 0
    )


def pace(exponent: LyapunovExponent) -> str:
    """Rate at which neighbouring trajectories diverge, in words."""
    assert exponent.exponent is not None
    impacts = 1 / exponent.exponent
    words = f"by a factor e in {impacts:.2g} impacts"
    return words if exponent.step is None else f"{words} ({impacts * exponent.step:.2g} s)"


def short_time(seconds: float) -> str:
    """A short time in a suitable unit."""
    factor, unit = (1e3, "ms") if seconds >= 1e-3 else (1e6, "µs")
    return f"{factor * seconds:.3g} {unit}"


def read_dynamics(
    impacts: Impacts, period: Periodicity, forcing_period: float | None, asked: bool
) -> Dynamics:
    """Estimate the dynamics behind the intervals of a train.

    No part can take another with it: what one could not do is said in its place.

    Parameters
    ----------
    impacts : Impacts
        As found.
    period : Periodicity
        What `impactsig.identify_period` says of them.
    forcing_period : float or None
        [s]; with it, what a repair of the train would change.
    asked : bool
        Whether to work out what takes seconds: dimension, exponent, surrogate test, determinism.
    """
    from ... import intervals
    from ...reconstruct.dimensions.dimension import correlation_dimension, of_kind
    from ...reconstruct.recognition.kinds import is_certain, of_period
    from ...reconstruct.testing.determinism import return_map_determinism
    from ...reconstruct.testing.surrogate_testing import surrogate_test

    values = impacts.intervals()
    without: dict[str, str] = {}

    def part(name: str, work: Callable[[], Part]) -> Part | None:
        try:
            return work()
        except ImpactsigError as error:
            without[name] = _why(error)
        except Exception as error:
            # A page that hours of detection went into is not lost to one of its parts.
            without[name] = f"it failed with {type(error).__name__}: {error}"
            warnings.warn(f"{name}: {without[name]}", ImpactsigWarning, stacklevel=2)
        return None

    repair = None
    if forcing_period is not None and len(impacts) <= REPAIRED:
        repair = part("repair", lambda: intervals.repair_intervals(impacts, forcing_period))
    if is_certain(period):
        found = of_kind(of_period(period))
        determinism = None
        whole = not (period.missed or period.spurious or period.satellites or len(impacts.gaps))
        if asked and whole and period.kind != "drifting":
            late = deviations(impacts.time, period.impacts or 1)[:TESTED]
            determinism = part("determinism", lambda: return_map_determinism(late, seed=SEED))
        return Dynamics(
            len(values),
            asked,
            dimension=found,
            determinism=determinism,
            repair=repair,
            without=without,
        )
    if not asked:
        return Dynamics(len(values), repair=repair, without=without)
    read, tested = impacts[: READ + 1], values[:TESTED]
    exponent = part("exponent", lambda: exponent_of(read))
    return Dynamics(
        len(values),
        asked,
        dimension=part("dimension", lambda: correlation_dimension(read)),
        exponent=None if exponent is None else exponent[0],
        surrogates=part("surrogates", lambda: surrogate_test(tested, seed=SEED)),
        determinism=part("determinism", lambda: return_map_determinism(tested, seed=SEED)),
        false_share=None if exponent is None else exponent[1],
        repair=repair,
        without=without,
    )


def deviations(time: np.ndarray, recurring: int) -> np.ndarray:
    """Deviation of each impact from the instant at which it is due at a constant rate [s]."""
    each, turn = np.arange(len(time)) % recurring, np.arange(len(time)) // recurring
    design = np.column_stack((turn, *(each == one for one in range(recurring)))).astype(float)
    return time - design @ np.linalg.lstsq(design, time, rcond=None)[0]


def exponent_of(
    impacts: Impacts, dimensions: Sequence[int] = DIMENSIONS, theiler: int | None = None
) -> tuple[LyapunovExponent, float]:
    """Lyapunov exponent of a train, and the share of false neighbours in its embedding.

    The embedding is the least beyond which the share of false neighbours hardly falls.
    """
    from ...reconstruct.divergence.exponents import lyapunov_exponent
    from ...reconstruct.neighbors import false_nearest_neighbors

    share = false_nearest_neighbors(impacts, dimensions, theiler=theiler).share
    chosen = int(np.argmax(share <= max(FEW_FALSE, 2 * share.min())))
    found = lyapunov_exponent(impacts, dimension=dimensions[chosen], theiler=theiler)
    return found, float(share[chosen])


def _why(error: ImpactsigError) -> str:
    """Reason for a missing part, worded for a reader of the report."""
    if isinstance(error, InvalidInput) and error.argument == "x":
        value = str(error.value).replace(" values", " intervals")
        return f"it got {value} and needs {error.required}"
    return str(error)
