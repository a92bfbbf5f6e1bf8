"""Begley and Virgin 1998: impact and friction."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from impactsig import (
    basins_of_attraction,
    bifurcation_diagram,
    lyapunov_spectrum,
    orbit_period,
    periodicity_chart,
    response_spectrum,
    scenes,
    simulate,
)

from .rows import Found, Outcome, Paper

PAPER = Paper(
    "begley-virgin",
    "BegleyVirgin1998",
    "Impact response and the influence of friction",
    "The text lacks the stiffness ratio of the walls, rho; `scenes.begley_virgin` takes rho = 15. "
    "The charts of friction have h = 0.001 and those of viscous damping f = 0, as section 5.1 "
    "says; the figures of section 7 have h = 0.02, the value that section 6 gives for the rig.",
    "Claims over rho: where each is met",
)
TINY = 0.001  # viscous damping of the charts of friction
FAR = 100.0  # walls out of reach
RHO = (8, 12, 15, 17, 20, 30)
GAMMA = np.linspace(0.3, 2.2, 50)
claims = PAPER.claims


@lru_cache
def friction_chart(sigma: float, initial: tuple[float, float] = (0.0, 0.0), transient: int = 0):
    options = {"periods": transient} if transient else {}
    return periodicity_chart(
        lambda gamma, f: scenes.begley_virgin(gamma, sigma, f, damping_ratio=TINY),
        GAMMA, np.linspace(0, 0.8, 30), initial=initial, **options,
    )  # fmt: skip


@lru_cache
def viscous_chart(sigma: float, initial: tuple[float, float] = (0.0, 0.0), transient: int = 0):
    options = {"periods": transient} if transient else {}
    return periodicity_chart(
        lambda gamma, h: scenes.begley_virgin(gamma, sigma, 0.0, damping_ratio=h),
        GAMMA, np.linspace(TINY, 0.5, 30), initial=initial, **options,
    )  # fmt: skip


def shares(chart, part: slice = slice(None)) -> tuple[float, float, float]:
    """Shares of the three classes."""
    return tuple(float(np.mean(chart.classes[part] == k)) for k in range(3))


def spectrum(h: float, f: float, gamma):
    return response_spectrum(
        lambda gamma: scenes.begley_virgin(gamma, FAR, f, damping_ratio=h), gamma
    ).greatest


def attractors(machine, cells: int = 14):
    """(impacts, periods, on the left, on the right, how far from its mirror image) of each."""
    found = []
    grid = np.linspace(-2, 2, cells), np.linspace(-3, 3, cells)
    for one in basins_of_attraction(machine, *grid).attractors:
        motion = simulate(machine, periods=one.periods, initial=tuple(one.strobe[0]))
        left, right = (int(np.sum(motion.impacts.stop_index == k)) for k in range(2))
        mirrored = -np.column_stack(motion.stroboscopic(math.pi))
        apart = np.abs(mirrored[:, None] - one.strobe).max(axis=2).min(axis=1).max()
        found.append((one.impacts, one.periods, left, right, float(apart)))
    return found


def settled(gamma: float, sigma, f: float) -> tuple[str, int, int]:
    """period(m, n) from rest, and impacts on either wall in 24 forcing periods."""
    motion = simulate(scenes.begley_virgin(gamma, sigma, f), periods=24, transient=400)
    left, right = (int(np.sum(motion.impacts.stop_index == k)) for k in range(2))
    return str(orbit_period(motion, tolerance=1e-6)), left, right


@claims(
    "Section 3", "f is half the range of positions at which the mass can rest",
    "simulate(machine without forcing, initial=(x, 0))",
)  # fmt: skip
def rest_range() -> Found:
    machine = replace(scenes.begley_virgin(1.0, FAR, 0.3), base=None)
    ends = [simulate(machine, duration=50, initial=(x, 0.0)).final[0] for x in (0.299, 0.301)]
    return Found(
        f"from 0.299 it ends at {ends[0]:.3f}, from 0.301 at {ends[1]:.3f}, with f = 0.3",
        ends[0] == 0.299 and ends[1] < 0.3005,
    )


@claims(
    "Section 3", "the amplitude tends to 1 as the frequency tends to 0 (no friction)",
    "response_spectrum(begley_virgin(gamma, 100, 0), [0.01])",
)  # fmt: skip
def low_frequency() -> Found:
    amplitude = float(spectrum(0.02, 0.0, [0.01])[0])
    return Found(f"{amplitude:.4f} at gamma = 0.01", abs(amplitude - 1) < 2e-4)


@claims(
    "Fig. 2, section 5", "f = 0.8 and h = 0.5 are the greatest dampings with impact at 1.5",
    "response_spectrum(begley_virgin(gamma, 100, f, damping_ratio=h), gamma)",
)  # fmt: skip
def scaling_pair() -> Found:
    gamma = np.linspace(0.7, 1.1, 161)
    rubbing = float(spectrum(TINY, 0.8, gamma).max())
    damped = float(spectrum(0.5, 0.0, gamma).max())
    # Greatest amplitude of the damped one in closed form.
    closed = max(math.hypot(1, g) / math.hypot(1 - g * g, g) for g in np.linspace(0.8, 0.9, 4001))
    return Found(
        f"greatest amplitudes {rubbing:.3f} (f = 0.8) and {damped:.3f} (h = 0.5; closed form "
        f"{closed:.3f}), both just short of 1.5",
        abs(rubbing - 1.466) < 1e-3 and abs(damped - 1.468) < 1e-3 and abs(damped - closed) < 1e-3,
    )


@claims(
    "Fig. 2", "the regions of impact have similar shapes: around resonance, narrower with damping",
    "response_spectrum over (gamma, f) and (gamma, h)", quick=False,
)  # fmt: skip
def impact_regions() -> Found:
    gamma = np.linspace(0.2, 2, 73)
    widths = {}
    for name, pairs in (
        ("f", [(TINY, f) for f in (0.1, 0.3, 0.5, 0.7)]),
        ("h", [(h, 0.0) for h in (0.0625, 0.1875, 0.3125, 0.4375)]),
    ):
        widths[name] = [float(np.mean(spectrum(*pair, gamma) > 1.5)) * 1.8 for pair in pairs]
    told = "; ".join(
        f"over {name} {', '.join(f'{w:.2f}' for w in row)}" for name, row in widths.items()
    )
    falling = all(np.all(np.diff(row) <= 0) for row in widths.values())
    return Found(f"widths in gamma at four scaled dampings: {told}", falling)


@claims(
    "Fig. 3a", "at low damping friction does not attenuate the response near resonance",
    "response_spectrum: h = 0.001, f = 0.15 and h = 0.1, f = 0",
)  # fmt: skip
def low_damping() -> Found:
    rubbing, damped = (float(spectrum(*pair, [1.0])[0]) for pair in ((TINY, 0.15), (0.1, 0.0)))
    return Found(f"at gamma = 1: {rubbing:.0f} with friction, {damped:.2f} without", rubbing > 50)


@claims(
    "Fig. 3b", "at high damping friction dips well below the linear amplitude at low frequencies",
    "response_spectrum: h = 0.001, f = 0.8 and h = 0.5, f = 0",
)  # fmt: skip
def high_damping() -> Found:
    rubbing, damped = (float(spectrum(*pair, [0.3])[0]) for pair in ((TINY, 0.8), (0.5, 0.0)))
    return Found(f"at gamma = 0.3: {rubbing:.2f} and {damped:.2f}", rubbing < 0.6 * damped)


@claims(
    "Fig. 3b", "past resonance the response with friction drops abruptly",
    "response_spectrum: h = 0.001, f = 0.8 and h = 0.5, f = 0",
)  # fmt: skip
def abrupt() -> Found:
    gamma = np.linspace(0.9, 1.6, 71)
    steepest = [float(-np.diff(spectrum(*pair, gamma)).min() / 0.01) for pair in
                ((TINY, 0.8), (0.5, 0.0))]  # fmt: skip
    return Found(
        f"steepest fall per unit of gamma {steepest[0]:.1f} with friction, {steepest[1]:.1f} "
        "without",
        steepest[0] > 2 * steepest[1],
    )


CHARTS = "periodicity_chart over (gamma, f), h = 0.001, and (gamma, h), f = 0"


@claims(
    "Fig. 4, section 5.2", "sigma = 1.5: higher-order motion is more prevalent with friction",
    CHARTS, quick=False,
)  # fmt: skip
def more_higher_order() -> Found:
    rubbing, damped = shares(friction_chart(1.5))[2], shares(viscous_chart(1.5))[2]
    coarse = np.mean(periodicity_chart(
        lambda gamma, f: scenes.begley_virgin(gamma, 1.5, f, damping_ratio=0.02),
        GAMMA, np.linspace(0, 0.8, 30),
    ).classes != friction_chart(1.5).classes)  # fmt: skip
    return Found(
        f"{rubbing:.1%} of the cells against {damped:.1%} (with h = 0.02 beside the friction "
        f"{coarse:.0%} of the cells change class)",
        rubbing > 3 * damped,
    )


@claims(
    "Fig. 4, section 5.2", "... particularly at higher damping", CHARTS, quick=False
)  # fmt: skip
def at_high_damping() -> Found:
    upper = slice(15, None)
    rubbing, damped = (shares(chart(1.5), upper)[2] for chart in (friction_chart, viscous_chart))
    return Found(
        f"in the upper half {rubbing:.1%} against {damped:.1%}", rubbing > 0.05 > 5 * damped
    )


@claims(
    "Section 5.2", "an increase in friction leads to higher order in many cases",
    CHARTS, quick=False,
)  # fmt: skip
def increase() -> Found:
    higher = friction_chart(1.5).classes == 2
    risen = np.any(higher[1:] & ~higher[:-1], axis=0).mean()
    return Found(f"at {risen:.0%} of the frequencies some increase of f does", risen > 0.2)


@claims("Fig. 4b", "period-1 dominates with viscous damping", CHARTS, quick=False)
def period_one() -> Found:
    silent, impacting, _ = shares(viscous_chart(1.5))
    return Found(f"{silent + impacting:.1%} of the cells", silent + impacting > 0.9)


@claims(
    "Section 5.2", "at low damping both systems do nearly the same at all frequencies",
    CHARTS, "undecidable",
    "the text does not say how low; f = 0 and h = 0.001 are the same machine, and they part "
    "as the damping grows", quick=False,
)  # fmt: skip
def alike_at_low() -> list[Outcome]:
    found = []
    for row in (0, 1, 2, 4, 8):
        same = float(np.mean(friction_chart(1.5).classes[row] == viscous_chart(1.5).classes[row]))
        f = row * 0.8 / 29
        found.append(Outcome(f"f = {f:.2f}", f"{same:.0%} of the classes alike", same > 0.8))
    return found


@claims(
    "Fig. 5c", "a period-3 motion is dominant in both systems at low damping",
    "periodicity_chart(...).periods, cells of higher order that have closed", "undecidable",
    "the text does not say how low; in a slender band next to no damping period-2 has more cells",
    quick=False,
)  # fmt: skip
def period_three() -> list[Outcome]:
    found = []
    for rows in (2, 4, 6, 8):
        told, most = [], []
        for name, chart in (("friction", friction_chart(1.5)), ("viscous", viscous_chart(1.5))):
            orders = chart.periods[:rows].ravel()
            counts = {n: int(np.sum(orders == n)) for n in range(2, 13)}
            best = max(counts, key=counts.get)
            told.append(f"{name} period-{best}")
            most.append(best == 3)
        found.append(Outcome(f"f up to {(rows - 1) * 0.8 / 29:.2f}", ", ".join(told), all(most)))
    return found


@claims(
    "Fig. 5a", "a period-1 solution that meets one wall only has an anti-symmetric partner",
    "basins_of_attraction(begley_virgin(gamma, 1.5, f, damping_ratio=0.001))",
)  # fmt: skip
def single_impact() -> Found:
    found = attractors(scenes.begley_virgin(0.8, 1.5, 0.2, damping_ratio=TINY), 10)
    left = [one for one in found if one[1:4] == (1, 1, 0)]
    right = [one for one in found if one[1:4] == (1, 0, 1)]
    return Found(
        f"gamma = 0.8, f = 0.2: {len(left)} with the left wall, {len(right)} with the right",
        len(left) == len(right) == 1,
    )


@claims(
    "Fig. 5b", "chaos with friction is absent with comparable viscous damping",
    "periodicity_chart(...).periods == 0", quick=False,
)  # fmt: skip
def chaos_with_friction() -> Found:
    told, highest = [], []
    for name, chart in (("friction", friction_chart(1.5)), ("viscous", viscous_chart(1.5))):
        rows = np.flatnonzero(np.any(chart.periods == 0, axis=1))
        highest.append(int(rows.max(initial=0)))
        told.append(
            f"{name}: not closed in {np.mean(chart.periods == 0):.1%} of the cells, up to "
            f"{highest[-1] / 29:.0%} of the greatest damping"
        )
    return Found("; ".join(told), highest[0] > 2 * highest[1])


@claims(
    "Fig. 6, section 5.2", "sigma = 0.8: period-1 with impacts dominates both", CHARTS, quick=False
)  # fmt: skip
def near_walls() -> Found:
    classes = [shares(friction_chart(0.8)), shares(viscous_chart(0.8))]
    return Found(
        f"{classes[0][1]:.0%} of the cells with friction, {classes[1][1]:.0%} without",
        all(one[1] == max(one) for one in classes),
    )


@claims(
    "Fig. 6", "sigma = 0.8: the region without impact is larger with friction", CHARTS, quick=False
)  # fmt: skip
def silent_region() -> Found:
    rubbing, damped = shares(friction_chart(0.8))[0], shares(viscous_chart(0.8))[0]
    return Found(f"{rubbing:.0%} against {damped:.0%}", rubbing > damped)


@claims(
    "Section 5.2", "with sigma < 1 the viscous system cannot avoid impact at low frequencies; "
    "friction can", "simulate(begley_virgin(0.02, 0.8, f, damping_ratio=h), periods=4)",
)  # fmt: skip
def low_frequency_impact() -> Found:
    counts = [
        simulate(
            scenes.begley_virgin(0.02, 0.8, f, damping_ratio=h), periods=4, transient=4
        ).impact_count
        for h, f in ((0.5, 0.0), (TINY, 0.8))
    ]
    return Found(
        f"gamma = 0.02: {counts[0]} impacts with h = 0.5, {counts[1]} with f = 0.8",
        counts[0] > 0 == counts[1],
    )


@claims(
    "Fig. 7", "sigma = -1.5, 1.3: a period-3 and a period-6 motion",
    "bifurcation_diagram(begley_virgin(gamma, (-1.5, 1.3), f, damping_ratio=0.001)).periods",
    quick=False,
)  # fmt: skip
def asymmetric() -> Found:
    seen = {}
    for f in (0.02, 0.05, 0.1, 0.2, 0.3):
        found = bifurcation_diagram(
            lambda gamma, f=f: scenes.begley_virgin(
                gamma, (-1.5, 1.3), f, damping_ratio=TINY
            ),
            np.linspace(0.4, 2.2, 361),
        )  # fmt: skip
        for n in (3, 6):
            cells = found.values[found.periods == n]
            if len(cells):
                seen.setdefault(n, f"period-{n} at gamma = {cells[0]:.3f}, f = {f}")
    return Found("; ".join(seen.values()) or "none", set(seen) == {3, 6})


@claims(
    "Section 5.4", "motion without impact is more common with friction", CHARTS, quick=False
)  # fmt: skip
def silence() -> Found:
    silent = {
        sigma: [shares(chart(sigma))[0] for chart in (friction_chart, viscous_chart)]
        for sigma in (1.5, 0.8)
    }
    rubbing, damped = (np.mean([silent[sigma][k] for sigma in silent]) for k in range(2))
    told = ", ".join(f"{a:.0%} against {b:.0%} at {sigma}" for sigma, (a, b) in silent.items())
    return Found(
        f"{rubbing:.0%} against {damped:.0%} of both charts ({told})", bool(rubbing > damped)
    )


@claims(
    "Section 5.4", "started at (1, 1) much of what had no impact at higher frequencies becomes "
    "period-1 with impacts, and little else changes",
    "periodicity_chart(..., initial=(1, 1))", quick=False,
)  # fmt: skip
def other_start() -> Found:
    told, right = [], []
    for name, chart in (("friction", friction_chart), ("viscous", viscous_chart)):
        rest, moved = chart(1.5).classes, chart(1.5, (1.0, 1.0)).classes
        high = GAMMA > 1
        woken = float(np.mean((rest == 0)[:, high] & (moved != 0)[:, high]))
        slept = float(np.mean((rest != 0) & (moved == 0)))
        other = float(np.mean((rest != moved) & (rest != 0)))
        told.append(f"{name}: {woken:.1%} of the cells above gamma = 1 wake, {other:.1%} of all "
                    "change otherwise")  # fmt: skip
        right.append(woken > slept and other < 0.1)
    return Found("; ".join(told), all(right))


FOUR = "basins_of_attraction(begley_virgin(1.338, 1.6, 0.05, wall_stiffness=rho**2))"


@claims("Fig. 10", "four attractors side by side at gamma = 1.338", FOUR, quick=False)
def four() -> list[Outcome]:
    found = []
    for rho in (8, 15, 30):
        machine = scenes.begley_virgin(1.338, 1.6, 0.05, wall_stiffness=rho**2)
        kinds = sorted(one[:2] for one in attractors(machine, 40))
        told = ", ".join(f"({m}, {n})" for m, n in kinds)
        found.append(Outcome(f"rho = {rho}", told, kinds == [(0, 1), (2, 1), (3, 2), (3, 2)]))
    return found


def phase_portrait(place: str, claim: str, gamma: float, sigma, f: float, expected: str) -> None:
    """A row for a phase portrait that the text describes."""

    def find() -> Found:
        period, left, right = settled(gamma, sigma, f)
        told = f"{period}; {left / 24:g} impacts a period on the left, {right / 24:g} on the right"
        return Found(told, period == expected)

    call = f"simulate(begley_virgin({gamma}, {sigma}, {f}))"
    PAPER.claims(place, claim, call)(find)


phase_portrait("Fig. 12a", "single-impact response", 1.12, (-1.1, 2.2), 0.05, "period(1, 1)")
phase_portrait("Fig. 12b", "period-2 motion", 1.41, (-1.1, 2.2), 0.05, "period(3, 2)")


@claims(
    "Fig. 11, 12c", "the period-4 branch near gamma = 1.6 is not in the simulation",
    "bifurcation_diagram(begley_virgin(gamma, (-1.1, 2.2), 0.05), gamma 1.5 to 1.7)",
)  # fmt: skip
def no_period_four() -> Found:
    found = bifurcation_diagram(
        lambda gamma: scenes.begley_virgin(gamma, (-1.1, 2.2), 0.05), np.linspace(1.5, 1.7, 81)
    )
    count = int(np.sum(found.periods == 4))
    return Found(f"period-4 at {count} of 81 frequencies", count <= 2)


@claims(
    "Fig. 13, 14c", "sigma = 0.8, f = 0.04: an anti-symmetric pair near gamma = 1.0",
    "basins_of_attraction(begley_virgin(1.0, 0.8, 0.04))",
)  # fmt: skip
def pair_at_one() -> Found:
    found = attractors(scenes.begley_virgin(1.0, 0.8, 0.04), 10)
    return Found(
        f"{len(found)} of {found[0][:2]}, {found[0][4]:.2f} from their mirror images",
        len(found) == 2 and found[0][4] > 0.1,
    )


@claims(
    "Fig. 14c", "the pair is there at gamma = 1.1",
    "basins_of_attraction(begley_virgin(1.1, 0.8, 0.04, wall_stiffness=rho**2))",
    "undecidable", "the text lacks rho; the pair needs 17 or more", quick=False,
)  # fmt: skip
def pair() -> list[Outcome]:
    found = []
    for rho in RHO:
        machine = scenes.begley_virgin(1.1, 0.8, 0.04, wall_stiffness=rho**2)
        orbits = attractors(machine, 8)
        apart = max(one[4] for one in orbits)
        told = f"{len(orbits)} orbits, {apart:.2g} from the mirror image"
        found.append(Outcome(f"rho = {rho}", told, len(orbits) == 2 and apart > 1e-3))
    return found


@claims(
    "Fig. 15", "period-1 at gamma = 0.54 with two impacts on the left wall and one on the right",
    "basins_of_attraction(begley_virgin(gamma, 0.8, 0.04, wall_stiffness=rho**2))",
    "differs", "at no rho from 8 to 50 is there such an orbit at 0.54 from any start tried; up to "
    "gamma = 0.48 there is for rho >= 30. The caption does not name the walls", quick=False,
)  # fmt: skip
def two_and_one() -> Found:
    seen = []
    for gamma in (0.48, 0.54):
        for rho in (15, 30, 50):
            machine = scenes.begley_virgin(gamma, 0.8, 0.04, wall_stiffness=rho**2)
            if any(one[1:4] == (1, 2, 1) for one in attractors(machine, 14)):
                seen.append((gamma, rho))
    told = ", ".join(f"gamma = {gamma}, rho = {rho}" for gamma, rho in seen)
    return Found(f"found at {told or 'none'}", any(gamma == 0.54 for gamma, _ in seen))


@claims(
    "Fig. 16, 17", "single-impact responses for the largely asymmetric walls",
    "bifurcation_diagram(begley_virgin(gamma, (-1.91, 1.08), 0.38))",
)  # fmt: skip
def one_impact() -> Found:
    found = bifurcation_diagram(
        lambda gamma: scenes.begley_virgin(gamma, (-1.91, 1.08), 0.38), np.linspace(0.5, 1.3, 81)
    )
    share = float(np.mean((found.periods == 1) & (found.impacts == 1)))
    kinds = [settled(gamma, (-1.91, 1.08), 0.38)[0] for gamma in (0.7, 1.1)]
    return Found(
        f"period(1, 1) at {share:.0%} of the frequencies from 0.5 to 1.3, and at 0.7 and 1.1",
        share > 0.5 and kinds == ["period(1, 1)"] * 2,
    )


@claims(
    "Fig. 18, 19", "double-impact period-1 dominates for sigma = 0.8, f = 0.36",
    "bifurcation_diagram(begley_virgin(gamma, 0.8, 0.36))",
)  # fmt: skip
def two_impacts() -> Found:
    found = bifurcation_diagram(
        lambda gamma: scenes.begley_virgin(gamma, 0.8, 0.36), np.linspace(0.5, 1.5, 81)
    )
    share = float(np.mean((found.periods == 1) & (found.impacts == 2)))
    kinds = [settled(gamma, 0.8, 0.36)[0] for gamma in (0.7, 1.4)]
    return Found(
        f"period(2, 1) at {share:.0%} of the frequencies from 0.5 to 1.5, and at 0.7 and 1.4",
        share > 0.5 and kinds == ["period(2, 1)"] * 2,
    )


def exponent(gamma: float, sigma, f: float, rho: float) -> tuple[float, float]:
    machine = scenes.begley_virgin(gamma, sigma, f, wall_stiffness=rho**2)
    found = lyapunov_spectrum(machine, periods=3000)
    return float(found.exponents[0]), float(found.error[0])


@claims(
    "Fig. 20a", "chaos at gamma = 0.88, sigma = -1.86, 1.75, f = 0.06",
    "lyapunov_spectrum(begley_virgin(0.88, (-1.86, 1.75), 0.06, wall_stiffness=rho**2))",
)  # fmt: skip
def chaos() -> list[Outcome]:
    found = []
    for rho in RHO:
        value, error = exponent(0.88, (-1.86, 1.75), 0.06, rho)
        found.append(Outcome(f"rho = {rho}", f"{value:.3f}", value > 5 * error))
    return found


@claims(
    "Fig. 20b", "chaos at gamma = 0.58, sigma = -1.53, 1.47, f = 0.04",
    "lyapunov_spectrum(begley_virgin(0.58, (-1.53, 1.47), 0.04, wall_stiffness=rho**2))",
    "undecidable",
    "the text lacks rho; of 6, 7, ... 30 only at 10 and 29, windows in the chaos, the orbit closes",
)  # fmt: skip
def more_chaos() -> list[Outcome]:
    found = []
    for rho in (10, *RHO[1:-1], 29, RHO[-1]):
        value, error = exponent(0.58, (-1.53, 1.47), 0.04, rho)
        found.append(Outcome(f"rho = {rho}", f"{value:.3f}", value > 5 * error))
    return found


@claims(
    "Fig. 24", "a period-3 motion at gamma = 0.8",
    "basins_of_attraction(begley_virgin(0.8, sigma, f))", "undecidable",
    "the caption names neither the walls nor the friction", quick=False,
)  # fmt: skip
def third() -> list[Outcome]:
    found = []
    for sigma, f in (
        ((-1.6, 1.6), 0.05), ((-0.8, 0.8), 0.04), ((-1.93, 1.93), 0.05),
        ((-1.86, 1.75), 0.06), ((-1.1, 2.2), 0.05), ((-0.51, 0.82), 0.04),
    ):  # fmt: skip
        orbits = attractors(scenes.begley_virgin(0.8, sigma, f), 10)
        kinds = ", ".join(f"({m}, {n})" for m, n, *_ in orbits) or "none closes"
        found.append(
            Outcome(f"walls {sigma[0]}, {sigma[1]}, f = {f}", kinds, any(o[1] == 3 for o in orbits))
        )
    return found


for place, claim in (
    ("Section 6", "natural frequency of the rig about 0.9 Hz"),
    ("Section 6", "Feeny and Liang's method gave f = 0.057, h = 0.024 on the rig, against 0.05 "
                  "and 0.02 from the range of rest"),
    ("Fig. 9a, 11a, 13a, 16a, 18a, 21a, 22a, 23a", "bifurcation diagrams of the experiment"),
    ("Fig. 12c", "a period-4 motion at gamma = 1.58, in the experiment only"),
    ("Fig. 15c", "the orbit of Fig. 15 doubles its period at gamma = 0.61, in the experiment only"),
    ("Fig. 25", "phase portraits of experiment and simulation at gamma = 0.9 and 1.1"),
):  # fmt: skip
    PAPER.experiment(place, claim)
