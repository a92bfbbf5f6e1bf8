"""The Van der Pol-Duffing oscillator with impacts and friction under white noise."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from impactsig import averaged_density, p_bifurcation, scenes, simulate_ensemble
from impactsig.results import Ensemble

from .rows import Found, Outcome, Paper

PAPER = Paper(
    "van-der-pol-duffing",
    "VanDerPolDuffing2020",
    "Van der Pol-Duffing vibro-impact system with Coulomb friction under white noise",
    "The text lacks its formulas; the noise is scaled by the root of epsilon, the only reading of "
    "three that gives the printed sequences. A peak is counted as the eye sees it in a figure: "
    "from 2 % of the highest (`least=0.02`), unless a row says otherwise.",
)
claims = PAPER.claims
SEEN = 0.02
scene = scenes.van_der_pol_duffing


@lru_cache
def ensemble(restitution: float) -> Ensemble:
    """Simulated paths from near where the averaged energy has its mean."""
    start = (0, 4.4) if restitution > 0.98 else (0.5, 0.5)
    return simulate_ensemble(
        scene(restitution, 1.0), paths=600, duration=800, transient=400, initial=start, seed=1
    )


def apart(restitution: float) -> tuple[float, float, float]:
    """Share of probability by which the densities of energy, displacement, velocity differ."""
    found, curve = ensemble(restitution), averaged_density(scene(restitution, 1.0))
    off = []
    for density, exact in (
        (found.energy, curve.energy_density),
        (found.displacement, curve.displacement_density),
        (found.velocity, curve.velocity_density),
    ):
        width = np.diff(density.edges)
        if density is found.energy:
            cells = np.diff(curve.cumulative(density.edges))
        else:
            cells = exact(density.centers) * width
        off.append(float(np.abs(cells - density.density * width).sum() / 2))
    return off[0], off[1], off[2]


def effective(place: str, restitution: float, claim: str) -> None:
    """A row for the agreement of averaging and simulation."""

    def find() -> Found:
        energy, x, v = apart(restitution)
        return Found(
            f"densities differ by {energy:.1%} (energy), {x:.1%} (displacement), {v:.1%} "
            "(velocity) of the probability",
            max(energy, x, v) < 0.05,
        )

    PAPER.claims(
        place, claim, "simulate_ensemble(...); averaged_density(...)", quick=False
    )(find)  # fmt: skip


effective("Fig. 2-4", 0.99, "r = 0.99: averaging and Monte Carlo agree")
effective("Fig. 5-7", 0.95, "r = 0.95: averaging and Monte Carlo agree")


@claims("Fig. 3", "r = 0.99: the joint density is a crater", "averaged_density(...).shape.visible")
def crater() -> Found:
    shape = averaged_density(scene(0.99, 1.0)).shape.visible(SEEN)
    return Found(shape.name, shape.name == "crater")


@claims(
    "Fig. 3", "... without a central peak", "averaged_density(...).shape", "differs",
    "friction holds up a peak at the origin as long as there is friction; here it has less than "
    "a hundredth of the ridge's height, too low for the figure",
)  # fmt: skip
def pure_crater() -> Found:
    shape = averaged_density(scene(0.99, 1.0)).shape
    centre = float(shape.height[0] / shape.height.max())
    return Found(f"{shape.name}; the peak has {centre:.1%} of the ridge", shape.name == "crater")


@claims(
    "Fig. 5", "r = 0.95: p(H) is greatest at H = 0, and not so at r = 0.99",
    "averaged_density(...).energy_density; simulate_ensemble(...).energy", "differs",
    "p(H) has a pole at H = 0 at every r, as 1/T(H) has, too narrow to be seen at 0.99; above it "
    "the claim holds, and in the joint density too", quick=False,
)  # fmt: skip
def peak_at_zero() -> Found:
    told, at_zero = [], []
    for r in (0.95, 0.99):
        curve = averaged_density(scene(r, 1.0))
        pole = float(curve.energy_density(np.array([1e-12]))[0])
        energy = np.linspace(0.05, 25, 5000)
        density = curve.energy_density(energy)
        at_zero.append(pole > density.max())
        told.append(
            f"r = {r}: p(1e-12) = {pole:.2g}, above 0.05 greatest at "
            f"H = {energy[np.argmax(density)]:.2f}"
        )
    return Found("; ".join(told), at_zero == [True, False])


@claims("Fig. 6", "r = 0.95: a single peak", "averaged_density(...).shape")
def single() -> Found:
    shape = averaged_density(scene(0.95, 1.0)).shape
    return Found(shape.name, shape.name == "peak")


@claims(
    "Section 4.2", "the smaller r, the likelier the oscillator is near rest",
    "averaged_density(...).cumulative(1)",
)  # fmt: skip
def rest() -> Found:
    values = (0.95, 0.96, 0.97, 0.98, 0.99)
    near = [float(averaged_density(scene(r, 1.0)).cumulative(np.array([1.0]))[0]) for r in values]
    told = ", ".join(f"{value:.3f}" for value in near)
    return Found(
        f"probability of H < 1 over r = 0.95 to 0.99: {told}", bool(np.all(np.diff(near) < 0))
    )


@claims(
    "Fig. 8", "over r from 0.95 on the section has one peak, then three, then two",
    "p_bifurcation(lambda restitution: van_der_pol_duffing(restitution, 1), r, least=least)",
    "undecidable", "the text does not say how low a peak the figure shows",
)  # fmt: skip
def over_restitution() -> list[Outcome]:
    values = [0.95, 0.975, 0.98, 0.99]
    found = []
    for least in (0.0, 0.005, 0.01, 0.02, 0.05):
        peaks = p_bifurcation(
            lambda restitution: scene(restitution, 1.0), values, least=least, tolerance=0.05
        ).peaks.tolist()
        told = ", ".join(map(str, peaks))
        found.append(Outcome(f"least = {least:g}", told, peaks == [1, 3, 3, 2]))
    return found


@claims(
    "Section 4.2", "a change of r induces a P-bifurcation",
    "p_bifurcation(...).transitions, all peaks counted",
)  # fmt: skip
def transition() -> Found:
    found = p_bifurcation(lambda restitution: scene(restitution, 1.0), [0.95, 0.99])
    (one,) = found.transitions
    return Found(f"{one.before} to {one.after} at r = {one.value:.5f}", one.before == "peak")


@claims(
    "Fig. 9, 10", "f_k = 0 a crater, 2 and 2.5 a new peak besides, 3 that peak alone",
    "p_bifurcation(lambda friction: van_der_pol_duffing(0.99, friction), [0, 2, 2.5, 3])",
)  # fmt: skip
def over_friction() -> Found:
    classes = p_bifurcation(lambda friction: scene(0.99, friction), [0, 2, 2.5, 3]).classes
    expected = ("crater", "crater with peak", "crater with peak", "peak")
    return Found(", ".join(classes), classes == expected)


@claims(
    "Fig. 9", "from f_k = 2 to 2.5 the new peak becomes higher and the others lower",
    "averaged_density(...).joint_density at the extrema",
)  # fmt: skip
def heights() -> Found:
    centre, ridge = [], []
    for friction in (2.0, 2.5):
        shape = averaged_density(scene(0.99, friction)).shape
        centre.append(float(shape.height[0]))
        ridge.append(float(shape.height[2]))
    return Found(
        f"centre {centre[0]:.4f} to {centre[1]:.4f}, ridge {ridge[0]:.4f} to {ridge[1]:.4f}",
        centre[1] > centre[0] and ridge[1] < ridge[0],
    )


def over_noise(place: str, r: float) -> None:
    """Rows for the effect of the noise's intensity."""
    values = [0.5, 1.0, 1.5, 2.0]

    def shape_kept() -> Found:
        found = p_bifurcation(lambda intensity: scene(r, 1.0, intensity), values)
        moved = max(
            float(np.abs(one.energy - found.shapes[0].energy).max()) for one in found.shapes
        )
        return Found(
            f"{found.classes[0]} at D = 0.5 to 2; the energies of the extrema move by {moved:.0e}",
            found.transitions == () and moved < 1e-9,
        )

    PAPER.claims(
        place, f"r = {r}: D changes no shape", "p_bifurcation(lambda intensity: ...).transitions"
    )(shape_kept)

    def peaks_rise() -> Found:
        x, v = np.linspace(0.0, 4, 400), np.linspace(-6, 6, 601)
        heights = []
        for intensity in values:
            curve = averaged_density(scene(r, 1.0, intensity))
            heights.append(
                [float(curve.displacement_density(x).max()), float(curve.velocity_density(v).max())]
            )
        told = "; ".join(f"{a:.3f}, {b:.3f}" for a, b in heights)
        return Found(
            f"greatest p(x), p(v) at D = 0.5, 1, 1.5, 2: {told}",
            bool(np.all(np.diff(heights, axis=0) < 0)),
        )

    PAPER.claims(
        place, f"r = {r}: the peaks of p(x) and p(v) rise as D falls",
        "averaged_density(...).displacement_density, .velocity_density",
    )(peaks_rise)  # fmt: skip


over_noise("Fig. 11", 0.99)
over_noise("Fig. 12", 0.97)


@claims(
    "Section 4.3", "no P-bifurcation over D",
    "p_bifurcation(lambda intensity: van_der_pol_duffing(0.99, 1, intensity), least=least)",
    "undecidable",
    "where only peaks that can be seen are counted, D changes the class, because it fills the "
    "hollow and with it changes the ratio of the peaks; counting all, it cannot",
)  # fmt: skip
def no_bifurcation() -> list[Outcome]:
    found = []
    for least in (0.0, 0.02):
        classes = p_bifurcation(
            lambda intensity: scene(0.99, 1.0, intensity), [0.5, 1.0, 2.0, 4.0],
            least=least, tolerance=0.05,
        ).classes  # fmt: skip
        found.append(Outcome(f"least = {least:g}", ", ".join(classes), len(set(classes)) == 1))
    return found


@claims(
    "Section 4.1", "averaging holds as the energy lost in a cycle is far less than the energy",
    "averaged_density(..., epsilon=0.01): cycle_loss",
)  # fmt: skip
def slow() -> Found:
    r = 0.99
    curve = averaged_density(scene(r, 1.0))
    loss = float(abs(curve.drift(np.array([2 * curve.mean]))[0]) * curve.period(2 * curve.mean))
    share = loss / (2 * curve.mean)
    return Found(f"{share:.1%} of the energy in a cycle at twice the mean energy", share < 0.1)
