"""Okolewski and Blazejczyk-Okolewska 2021: hard and soft stops on a moving base."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from impactsig import (
    KelvinVoigt,
    Stop,
    bifurcation_diagram,
    lyapunov_spectrum,
    orbit_period,
    scenes,
    simulate,
    stop_damping,
)
from impactsig.results import BifurcationDiagram

from .rows import Found, Paper

PAPER = Paper(
    "okolewski",
    "Okolewski2021",
    "Hard versus soft impact modeling of vibro-impact systems with a moving base",
    "The text lacks its formulas, (12) and (13) for the damping of the soft stop among them; "
    "`stop_damping` offers three readings. a_e is printed as the change of the body's kinetic "
    "energy in impacts: `kinetic_energy_per_period`; what the stop dissipates, relative to the "
    "base, is `energy_per_period`.",
)
claims = PAPER.claims
ETA = np.linspace(2, 10, 161)
STIFFNESSES = (2e5, 2000.0, 500.0, 100.0)


@lru_cache
def over_eta(restitution: float, stiffness: float | None = None) -> BifurcationDiagram:
    """The hard stop, or the soft one of a stiffness."""
    kind = {} if stiffness is None else {"stop": "soft", "stop_stiffness": stiffness}
    return bifurcation_diagram(lambda eta: scenes.okolewski(eta, restitution, **kind), ETA)


def alike(restitution: float, stiffness: float) -> float:
    """Share of eta at which both stops lead to orbits of the same period, or neither closes."""
    hard, soft = over_eta(restitution), over_eta(restitution, stiffness)
    return float(np.mean(hard.periods == soft.periods))


def same_period(restitution: float, stiffness: float) -> float:
    """Share of eta at which both stops lead to orbits that close with the same period."""
    hard, soft = over_eta(restitution), over_eta(restitution, stiffness)
    return float(np.mean((hard.periods == soft.periods) & (hard.periods > 0)))


@claims(
    "Section 3", "the base's damping follows from r and k_s by equal losses; 0 at r = 1",
    "stop_damping(r, k_s)",
)  # fmt: skip
def damping() -> Found:
    lossless = stop_damping(1.0, 2e5)
    motion = simulate(
        scenes.okolewski(4, 0.8, "soft", stop_stiffness=2e9), periods=8, transient=400
    )
    hard = simulate(scenes.okolewski(4, 0.8), periods=8, transient=400)
    return Found(
        f"0 at r = 1; {stop_damping(0.8, 2e5):.4f} at r = 0.8, k_s = 2e5; energy lost by a soft "
        f"stop of k_s = 2e9 over that of the hard one: {motion.energy_lost / hard.energy_lost:.4f}",
        lossless == 0 and abs(motion.energy_lost / hard.energy_lost - 1) < 1e-3,
    )


@claims(
    "Fig. 4", "period-1, -2, -3, -4 and -5 motions can be localised (r = 1)",
    "bifurcation_diagram(okolewski(eta, 1)).periods",
)  # fmt: skip
def regions() -> Found:
    seen = sorted(set(over_eta(1.0).periods.tolist()) - {0})
    return Found(f"periods {', '.join(map(str, seen))}", set(range(1, 6)) <= set(seen))


def exponents(place: str, eta: float, kind: str, printed: tuple[float, float]) -> None:
    """A row for a printed pair of exponents."""

    def find() -> Found:
        machine = scenes.okolewski(eta, 1.0, kind)
        found = bifurcation_diagram(
            lambda eta: scenes.okolewski(eta, 1.0, kind), [eta], exponents=True
        ).exponents[0]
        short = [
            tuple(lyapunov_spectrum(machine, periods=n, transient=0).exponents) for n in (20, 200)
        ]
        off = max(abs(a - b) for a, b in zip(found, printed, strict=True))
        told = "; ".join(f"{a:.6f}, {b:.6f}" for a, b in short)
        return Found(
            f"{found[0]:.6f}, {found[1]:.6f}, from the multipliers; over the first 20 and 200 "
            f"periods {told}",
            off < 5e-7,
        )

    why = (
        "the printed values are of a finite time: the multipliers are complex, so both exponents "
        "of the orbit are -0.115; the sums agree, see below"
    )
    PAPER.claims(
        place, f"exponents {printed[0]}, {printed[1]} ({kind}, eta = {eta:g}, r = 1)",
        "bifurcation_diagram(..., exponents=True)", "differs", why,
    )(find)  # fmt: skip


exponents("Fig. 9a", 4, "hard", (-0.114979, -0.115021))
exponents("Fig. 9b", 4, "soft", (-0.112269, -0.117731))
exponents("Fig. 10a", 8, "hard", (-0.112269, -0.117731))
exponents("Fig. 10b", 8, "soft", (-0.111880, -0.118120))


@claims(
    "Fig. 9, 10", "the printed exponents add up to -0.23, what the damper takes",
    "bifurcation_diagram(..., exponents=True)",
)  # fmt: skip
def sums() -> Found:
    found = [
        bifurcation_diagram(
            lambda eta, kind=kind: scenes.okolewski(eta, 1.0, kind), [4.0, 8.0], exponents=True
        ).exponents.sum(axis=1)
        for kind in ("hard", "soft")
    ]
    off = float(np.abs(np.array(found) + 0.23).max())
    return Found(f"off -0.23 by {off:.0e} at most, hard and soft, eta = 4 and 8", off < 1e-6)


@claims(
    "Fig. 9, 10", "period-2 with z = 1/2 at eta = 4, period-4 with z = 1/4 at eta = 8, both stops",
    "simulate(okolewski(eta, 1, stop)); orbit_period",
)  # fmt: skip
def orbits() -> Found:
    told = []
    for eta in (4, 8):
        for kind in ("hard", "soft"):
            motion = simulate(scenes.okolewski(eta, 1.0, kind), periods=40, transient=2000)
            told.append(str(orbit_period(motion)))
    return Found(", ".join(told), told == ["period(1, 2)"] * 2 + ["period(1, 4)"] * 2)


@claims(
    "Fig. 4b", "a_e is the change of the body's kinetic energy in impacts: not 0 at r = 1",
    "bifurcation_diagram(...).kinetic_energy_per_period; .energy_per_period",
)  # fmt: skip
def energies() -> Found:
    found = bifurcation_diagram(lambda eta: scenes.okolewski(eta, 1.0), [4.0, 8.0])
    gained, lost = found.kinetic_energy_per_period, found.energy_per_period
    return Found(
        f"gained {gained[0]:.2e} at eta = 4, {gained[1]:.2e} at 8; lost relative to the base "
        f"{lost[0]:.0e}, {lost[1]:.0e}",
        abs(gained[0] - 5.7e-4) < 5e-6
        and abs(gained[1] - 9.5e-4) < 5e-6
        and bool(np.all(lost == 0)),
    )


@claims(
    "Fig. 4, 5", "r = 1: hard and soft (k_s = 2e5) agree very well",
    "bifurcation_diagram for both; share of eta with the same period",
)  # fmt: skip
def stiff() -> Found:
    share = alike(1.0, 2e5)
    return Found(f"same period, or neither closes, at {share:.0%} of eta", share > 0.8)


@claims(
    "Fig. 6", "r = 1: still a good conformity at k_s = 2000", "the same, k_s = 2000"
)  # fmt: skip
def stiff_enough() -> Found:
    share = alike(1.0, 2000)
    return Found(f"same period, or neither closes, at {share:.0%} of eta", share > 0.7)


@claims(
    "Fig. 5-8", "r = 1: the softer the base, the greater the differences",
    "the same over k_s = 2e5, 2000, 500, 100",
)  # fmt: skip
def softer() -> Found:
    shares = [same_period(1.0, k) for k in STIFFNESSES]
    return Found(
        "same period at " + ", ".join(f"{share:.0%}" for share in shares),
        bool(np.all(np.diff(shares) < 0)),
    )


@claims(
    "Fig. 12, 13", "r = 0.8: hard and soft (k_s = 2e5) agree as at r = 1, and part as it softens",
    "the same, r = 0.8, k_s = 2e5, 2000, 500, 100",
)  # fmt: skip
def with_some_loss() -> Found:
    shares = [same_period(0.8, k) for k in STIFFNESSES]
    return Found(
        "same period at " + ", ".join(f"{share:.0%}" for share in shares),
        shares[0] > 0.7 and shares[-1] < shares[0] - 0.1,
    )


@claims(
    "Fig. 14, 15", "r = 0.6: considerable differences even at k_s = 2e5, in impacts per period",
    "bifurcation_diagram(...).impacts_per_period, hard and soft",
)  # fmt: skip
def with_loss() -> Found:
    off = {}
    for r in (1.0, 0.8, 0.6):
        hard, soft = over_eta(r).impacts_per_period, over_eta(r, 2e5).impacts_per_period
        off[r] = float(np.mean(np.abs(hard - soft) > 0.5))
    told = ", ".join(f"{share:.0%} at r = {r:g}" for r, share in off.items())
    return Found(f"off by more than half an impact at {told} of eta", off[0.6] > 2 * off[0.8])


@claims(
    "Fig. 14b, 15b", "r = 0.6: the energies of impacts are the same for both stops",
    "bifurcation_diagram(...).kinetic_energy_per_period and .energy_per_period",
)  # fmt: skip
def same_energy() -> Found:
    hard, soft = over_eta(0.6), over_eta(0.6, 2e5)
    off = {}
    for name in ("kinetic_energy_per_period", "energy_per_period"):
        one, other = getattr(hard, name), getattr(soft, name)
        off[name] = float(np.median(np.abs(one / other - 1)))
    told = ", ".join(f"{name} {value:.1%}" for name, value in off.items())
    return Found(f"median difference: {told}", max(off.values()) < 0.05)


@claims(
    "Section 4.3", "r = 0.6, eta = 3: 2.25 impacts per period of the soft stop",
    "simulate(okolewski(3, 0.6, 'soft')).impacts_per_period",
)  # fmt: skip
def soft_count() -> Found:
    counts = {}
    for formula in ("gap", "force", "work"):
        law = KelvinVoigt(2e5, stop_damping(0.6, 2e5, formula=formula))
        machine = scenes.okolewski(3, 0.6, stops=(Stop(0.0, law, "lower"),))
        counts[formula] = simulate(machine, periods=400, transient=400).impacts_per_period
    told = ", ".join(f"{count:.2f} ({formula})" for formula, count in counts.items())
    return Found(f"by the reading of equal losses: {told}", abs(counts["gap"] - 2.25) < 1e-9)


@claims(
    "Section 4.3", "r = 0.6, eta = 3: 201 impacts per period of the hard stop",
    "simulate(okolewski(3, 0.6), chatter=...).impacts_per_period", "differs",
    "each chatter has infinitely many impacts, so the count depends on where they are summed "
    "up, while the orbit does not",
)  # fmt: skip
def hard_count() -> Found:
    counts, strobes = [], []
    for chatter in (1e-4, 1e-6, 1e-9):
        motion = simulate(scenes.okolewski(3, 0.6), periods=400, transient=400, chatter=chatter)
        counts.append(motion.impacts_per_period)
        strobes.append(motion.stroboscopic()[0][-4:])
    off = max(float(np.abs(strobes[0] - one).max()) for one in strobes)
    told = ", ".join(f"{count:.1f}" for count in counts)
    return Found(
        f"{told}, summed below 1e-4, 1e-6, 1e-9; period-4, its points {off:.0e} apart",
        any(abs(count - 201) < 1 for count in counts),
    )


@claims(
    "Section 4.3", "r = 0.6: wide ranges of chaos of the hard stop where the soft one is periodic",
    "bifurcation_diagram(okolewski(eta, 0.6)).periods", "differs",
    "where the paper reads chaos the mass chatters, comes to rest on the base and leaves it at "
    "the same phase: a periodic motion that no count of impacts shows to be one",
)  # fmt: skip
def hard_chaos() -> Found:
    hard, soft = over_eta(0.6), over_eta(0.6, 2e5)
    sticking = hard.sticking > 0
    alone = (hard.periods == 0) & (soft.periods > 0)
    return Found(
        f"not closed where the soft stop is periodic: {alone.mean():.0%} of eta; the hard one "
        f"rests on the base at {sticking.mean():.0%}, and there "
        f"{(hard.periods[sticking] > 0).mean():.0%} have closed",
        bool(alone.mean() > 0.05),
    )


@claims(
    "Section 4.3", "most impacts of the hard stop there are of velocities near 0",
    "simulate(okolewski(3, 0.6), chatter=1e-9).impacts.approach_velocity",
)  # fmt: skip
def slow_impacts() -> Found:
    motion = simulate(scenes.okolewski(3, 0.6), periods=100, transient=400, chatter=1e-9)
    speed = motion.impacts.approach_velocity
    share = float(np.mean(speed < 0.05 * speed.max()))
    return Found(f"{share:.0%} below a twentieth of the greatest", share > 0.5)


@claims(
    "Fig. 16", "r = 0.6, eta = 6.9: the hard stop has series of impacts where the soft has few",
    "simulate(okolewski(6.9, 0.6, stop))",
)  # fmt: skip
def series() -> Found:
    hard, soft = (
        simulate(scenes.okolewski(6.9, 0.6, kind), periods=400, transient=400)
        for kind in ("hard", "soft")
    )
    return Found(
        f"{hard.impacts_per_period:.2f} impacts a period and {hard.stick_count} rests in 400, "
        f"against {soft.impacts_per_period:.2f}",
        hard.impacts_per_period > 2 * soft.impacts_per_period,
    )


@claims(
    "Conclusions", "the models agree on a stiff base with little loss, and not on a soft one or "
    "with much loss", "share of eta with the same period, and the time in contact",
)  # fmt: skip
def conclusions() -> Found:
    stiff_, soft_, loss = alike(1.0, 2e5), alike(1.0, 100), alike(0.6, 2e5)
    lasts = [math.pi / math.sqrt(k) / (2 * math.pi / 6) for k in (2e5, 100)]
    return Found(
        f"{stiff_:.0%} (stiff, r = 1; contact {lasts[0]:.1%} of a period at eta = 6), {soft_:.0%} "
        f"(soft; {lasts[1]:.0%}), {loss:.0%} (stiff, r = 0.6)",
        stiff_ > soft_ and stiff_ > loss,
    )
