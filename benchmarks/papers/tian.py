"""Tian, Yin, Paez Chavez and Liu: soft stops made equivalent to rigid ones by optimisation."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from impactsig import (
    ContactSamples,
    KelvinVoigt,
    bifurcation_diagram,
    equivalence_error,
    fit_soft_stop,
    match_rate,
    periodicity_chart,
    scenes,
    stop_damping,
    stop_stiffness,
)

from .rows import Found, Outcome, Paper

PAPER = Paper(
    "tian",
    "Tian",
    "An optimisation approach to establish dynamical equivalence for soft and rigid impact models",
    "The text lacks the gap, the damping ratio, the ranges of omega and A in the figure and in the "
    "samples, and the definition of e_c; `scenes.tian` takes gap 1, zeta 0.03, and e_c is the mean "
    "distance of the sorted stroboscopic sets. A motion p/q is read as period p with q impacts.",
    "Claims over gap, zeta, threshold and box: where each is met",
)
claims = PAPER.claims
PRINTED = KelvinVoigt(1e4, 10.3288336)
CELLS = 32
SEED = 2206  # of the sampled contacts, so that a row comes out the same each time


def machine(stop: str, restitution: float = 0.85, gap: float = 1.0, zeta: float = 0.03):
    """The scene over omega and A; the soft stop of another r by its formula."""
    damping = 10.3288336 if restitution == 0.85 else stop_damping(restitution, 1e4)

    def scene(omega: float, amplitude: float):
        return scenes.tian(
            omega, amplitude, stop, restitution=restitution, stop_damping=damping, gap=gap,
            damping_ratio=zeta,
        )  # fmt: skip

    return scene


@lru_cache
def matched(restitution: float, gap: float, zeta: float, box: tuple[float, float, float, float]):
    axes = np.linspace(*box[:2], CELLS), np.linspace(*box[2:], CELLS)
    stops = (machine(stop, restitution, gap, zeta) for stop in ("hard", "soft"))
    return match_rate(*stops, *axes)


BOX = (0.5, 4.0, 0.1, 2.0)


@claims(
    "Methodology", "e_g is least at beta = 10^4, zeta_1 = 10.3288336 for r = 0.85",
    "fit_soft_stop(0.85, samples=ContactSamples.draw(...))", "undecidable",
    "the text lacks the ranges of the samples, and with them the damping moves in the fourth digit",
    quick=False,
)  # fmt: skip
def optimum() -> list[Outcome]:
    found = []
    for velocity in ((0.05, 4.0), (0.05, 1.0), (1.0, 2.0)):
        for amplitude in ((0.1, 2.0), (0.1, 1.0)):
            samples = ContactSamples.draw(400, velocity=velocity, amplitude=amplitude, seed=SEED)
            fit = fit_soft_stop(0.85, samples=samples)
            told = f"zeta_1 = {fit.stop.damping:.3f}"
            box = f"velocity {velocity[0]}-{velocity[1]}, A {amplitude[0]}-{amplitude[1]}"
            found.append(Outcome(box, told, abs(fit.stop.damping / 10.3288336 - 1) < 1e-3))
    return found


@claims(
    "Methodology", "the optimal stiffness is 10^4",
    "fit_soft_stop(0.85, stiffness=(10, edge)).at_edge", "undecidable",
    "e_2, the time in contact, falls with the stiffness for ever: the optimum is the edge of the "
    "range that is searched, which the text does not give", quick=False,
)  # fmt: skip
def edge() -> list[Outcome]:
    found = []
    for most in (1e3, 1e4, 1e5):
        fit = fit_soft_stop(
            0.85,
            stiffness=(10.0, most),
            damping=(0.1, 1e3),
            samples=ContactSamples.draw(200, seed=SEED),
        )
        found.append(
            Outcome(f"edge {most:g}", f"beta = {fit.stop.stiffness:.6g}",
                    abs(fit.stop.stiffness / 1e4 - 1) < 1e-3)
        )  # fmt: skip
    return found


@claims(
    "Introduction", "the formula of Okolewski needs the stiffness or the damping to be given",
    "stop_damping(0.85, 1e4); stop_stiffness(0.85, ...)",
)  # fmt: skip
def formula() -> Found:
    damping = stop_damping(0.85, 1e4)
    back = stop_stiffness(0.85, damping)
    return Found(
        f"damping {damping:.4f} from stiffness 1e4, and stiffness {back:.6g} from it; the printed "
        f"optimum is {abs(damping / 10.3288336 - 1):.2%} off",
        abs(back / 1e4 - 1) < 1e-9,
    )


@claims(
    "Conclusions", "the optimum is more effective than the formula",
    "fit_soft_stop(...).error.value; equivalence_error(formula)", quick=False,
)  # fmt: skip
def better() -> Found:
    samples = ContactSamples.draw(400, seed=SEED)
    fitted = fit_soft_stop(0.85, samples=samples).error.value
    plain = equivalence_error(KelvinVoigt(1e4, stop_damping(0.85, 1e4)), 0.85, samples).value
    return Found(
        f"e_g = {fitted:.8f} against {plain:.8f}: less by {1 - fitted / plain:.1e}",
        fitted < plain,
    )


@claims(
    "Fig. 1c", "the match rate is 91.9 %",
    "match_rate(hard, soft, omega, A).rate", "undecidable",
    "the text lacks gap, zeta, the box and the definition of e_c, and each of them moves it",
    quick=False,
)  # fmt: skip
def rate() -> list[Outcome]:
    found = []
    for gap, zeta, box in (
        (1.0, 0.03, BOX), (1.0, 0.01, BOX), (1.0, 0.05, BOX), (0.5, 0.03, BOX),
        (1.0, 0.03, (0.5, 2.5, 0.1, 2.0)), (1.0, 0.03, (0.5, 4.0, 0.1, 1.0)),
    ):  # fmt: skip
        value = matched(0.85, gap, zeta, box).rate
        where = f"gap {gap:g}, zeta {zeta:g}, omega {box[0]:g}-{box[1]:g}, A {box[2]:g}-{box[3]:g}"
        found.append(Outcome(where, f"{value:.1%}", abs(value - 0.919) < 0.01))
    distance = matched(0.85, 1.0, 0.03, BOX).distance
    for below in (0.05, 0.2):
        value = float(np.mean(distance < below))
        where = f"the first with e_c < {below:g}"
        found.append(Outcome(where, f"{value:.1%}", abs(value - 0.919) < 0.01))
    return found


@lru_cache
def charts():
    axes = np.linspace(*BOX[:2], CELLS), np.linspace(*BOX[2:], CELLS)
    return [periodicity_chart(machine(stop), *axes, periods=300) for stop in ("hard", "soft")]


@claims(
    "Fig. 1a, b", "remarkable similarities of both stops at r = 0.85",
    "periodicity_chart(hard), periodicity_chart(soft)", quick=False,
)  # fmt: skip
def similar() -> Found:
    hard, soft = charts()
    met = hard.impacts != 0
    alike = (hard.periods == soft.periods) & (hard.impacts == soft.impacts)
    return Found(
        f"the stop is met in {met.mean():.0%} of the cells; same period and impacts in "
        f"{alike[met].mean():.0%} of these",
        bool(alike[met].mean() > 0.9),
    )


@claims(
    "Fig. 1a, b", "upper left of the plane: from 1/3 to 1/2 motion, for both stops",
    "bifurcation_diagram(tian(omega, 2, stop, gap=gap))",
)  # fmt: skip
def upper_left() -> Found:
    told, right = [], []
    for stop in ("hard", "soft"):
        found = bifurcation_diagram(
            lambda omega, stop=stop: scenes.tian(omega, 2.0, stop), np.linspace(0.3, 0.9, 121)
        )
        one = found.periods == 1
        third, half = (found.values[one & (found.impacts == m)] for m in (3, 2))
        told.append(
            f"{stop}: 1/3 to omega = {third.max(initial=0):.3f}, 1/2 to {half.max(initial=0):.3f}"
        )
        right.append(len(third) > 0 and len(half) > 0 and third.max() < half.max())
    return Found("; ".join(told), all(right))


@claims(
    "Fig. 1a, b", "upper right of the plane: 4/3 to 4/2 to 2/1 motion",
    "bifurcation_diagram(tian(omega, 2, stop, gap=gap))", "undecidable",
    "the text lacks the gap; at 0.5 the sequence is there, with both stops, at 1 it is not",
)  # fmt: skip
def upper_right() -> list[Outcome]:
    found = []
    for gap in (1.0, 0.7, 0.5, 0.3):
        told, there = [], []
        for stop in ("hard", "soft"):
            diagram = bifurcation_diagram(
                lambda omega, stop=stop, gap=gap: scenes.tian(omega, 2.0, stop, gap=gap),
                np.linspace(2.2, 3.4, 97),
            )
            kinds = list(zip(diagram.periods.tolist(), diagram.impacts.tolist(), strict=True))
            where = {kind: [float(diagram.values[k]) for k, own in enumerate(kinds) if own == kind]
                     for kind in ((4, 3), (4, 2), (2, 1))}  # fmt: skip
            firsts = [min(one, default=np.nan) for one in where.values()]
            there.append(bool(firsts[0] < firsts[1] < firsts[2]))
            told.append(f"{stop} " + (
                "from omega = " + ", ".join(f"{one:.2f}" for one in firsts)
                if there[-1] else "no"
            ))  # fmt: skip
        found.append(Outcome(f"gap {gap:g}", "; ".join(told), all(there)))
    return found


@claims(
    "Conclusions", "at low r the two stops diverge",
    "match_rate(...) and periodicity_chart(...) at r = 0.85, 0.6, 0.3", "undecidable",
    "neither a number nor the measure is in the text. By our e_c the match rises as r falls, since "
    "impacts that lose more leave smaller sets; by the stiffness that equal losses leave (damping "
    "fixed) it falls", quick=False,
)  # fmt: skip
def low() -> list[Outcome]:
    found = []
    rates = [matched(r, 1.0, 0.03, BOX).rate for r in (0.85, 0.3)]
    found.append(
        Outcome("stiffness 1e4, e_c < 0.1", f"{rates[0]:.1%} at r = 0.85, {rates[1]:.1%} at 0.3",
                rates[1] < rates[0])
    )  # fmt: skip
    errors = []
    for r in (0.85, 0.3):
        law = KelvinVoigt(1e4, stop_damping(r, 1e4))
        errors.append(equivalence_error(law, r, ContactSamples.draw(400, seed=SEED)).value)
    found.append(
        Outcome("e_g of the contacts", f"{errors[0]:.4f} at r = 0.85, {errors[1]:.4f} at 0.3",
                errors[1] > errors[0])
    )  # fmt: skip
    return found
