"""Which values of the parameters that the texts lost meet which claims: a figure a paper.

    python -m benchmarks.papers.maps

Writes docs/papers/*.svg; some minutes.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes

from impactsig import (
    DelayedFeedback,
    InvalidInput,
    bifurcation_diagram,
    find_periodic_orbit,
    lyapunov_spectrum,
    match_rate,
    orbit_period,
    orbit_stability,
    scenes,
    simulate,
    sweep,
)

TITLES = {
    "pair": "Fig. 14c: a pair at 1.1",
    "first_chaos": "Fig. 20a: chaos",
    "second_chaos": "Fig. 20b: chaos",
    "periodic": "22.1 Hz: period(1, 1)",
    "chaos_low": "20.1 Hz: chaos",
    "chaos": "20.3355 Hz: chaos",
    "holds": "K = 0.15 holds (1, 1)",
    "too_weak": "K = 0.01 does not",
    "too_strong": "K = 0.45 does not",
    "holds_two": "K = 0.15 holds (1, 2)",
    "weak_holds_two": "K = 0.015 holds (1, 2)",
    "right_corner": "4/3, 4/2, 2/1 at A = 2",
    "left_corner": "1/3, 1/2 at A = 2",
}
BELOW = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3)  # thresholds of e_c
OMEGA, AMPLITUDE = np.linspace(0.5, 4.0, 50), np.linspace(0.1, 2.0, 50)
PAGES = Path(__file__).parents[2] / "docs" / "papers"


def chaotic(machine: object, periods: int = 1500) -> bool:
    found = lyapunov_spectrum(machine, periods=periods)
    return bool(found.exponents[0] > 5 * found.error[0])


def of_rho(rho: float) -> dict[str, float]:
    """Claims of Begley and Virgin at a stiffness ratio of the walls."""
    stiff = {"wall_stiffness": rho**2}
    machine = scenes.begley_virgin(1.1, 0.8, 0.04, **stiff)
    motion = simulate(machine, periods=2, transient=2000)
    first, second = (np.column_stack(motion.stroboscopic(phase))[0] for phase in (0.0, math.pi))
    apart = float(np.abs(first + second).max())  # 0 of an orbit that is its own mirror image
    return {
        "pair": apart > 1e-3,
        "first_chaos": chaotic(scenes.begley_virgin(0.88, (-1.86, 1.75), 0.06, **stiff)),
        "second_chaos": chaotic(scenes.begley_virgin(0.58, (-1.53, 1.47), 0.04, **stiff)),
    }


def of_beam(zeta: float, amplitude: float) -> dict[str, float]:
    """Claims of the thesis at a damping ratio and an amplitude.

    What is said of the control is not a number where there is no orbit to hold.
    """

    def beam(frequency: float):
        return scenes.karpodinis(frequency, damping_ratio=zeta, amplitude=amplitude)

    kinds = [str(orbit_period(simulate(beam(f), periods=60, transient=600))) for f in (22.1, 20.1)]
    held = {}
    for n, gains in ((1, (0.15, 0.01, 0.45)), (2, (0.15, 0.015))):
        try:
            orbit = find_periodic_orbit(beam(20.3355), n, impacts=1)
        except InvalidInput:  # no start leads to one: the beam does not reach its stop
            orbit = None
        for gain in gains:
            held[n, gain] = math.nan
            if orbit is not None and orbit.found:
                found = orbit_stability(orbit, DelayedFeedback(gain, n, 0.1), laps=160)
                held[n, gain] = float(found.growth < 1)
    return {
        "periodic": kinds[0] == "period(1, 1)",
        "chaos_low": chaotic(beam(20.1)),
        "chaos": chaotic(beam(20.3355)),
        "holds": held[1, 0.15],
        "too_weak": 1 - held[1, 0.01],
        "too_strong": 1 - held[1, 0.45],
        "holds_two": held[2, 0.15],
        "weak_holds_two": held[2, 0.015],
    }


def of_gap(gap: float, zeta: float) -> dict[str, float]:
    """Claims of Tian and others at a gap and a damping ratio."""
    there = {"right_corner": True, "left_corner": True}
    for stop in ("hard", "soft"):
        for name, span, wanted in (
            ("right_corner", (2.0, 3.4), ((4, 3), (4, 2), (2, 1))),
            ("left_corner", (0.3, 1.2), ((1, 3), (1, 2))),
        ):
            found = bifurcation_diagram(
                lambda omega, stop=stop: scenes.tian(
                    omega, 2.0, stop, gap=gap, damping_ratio=zeta
                ),
                np.linspace(*span, 71), workers=1,
            )  # fmt: skip
            kinds = list(zip(found.periods.tolist(), found.impacts.tolist(), strict=True))
            firsts = [kinds.index(kind) if kind in kinds else math.inf for kind in wanted]
            there[name] &= firsts == sorted(firsts) and math.inf not in firsts
    return there


def shares_of(gap: float) -> dict[str, float]:
    """Share of the plane that matches, by the threshold of e_c."""
    distance = plane(gap).distance
    return {f"below_{1000 * below:.0f}": float((distance < below).mean()) for below in BELOW}


def plane(gap: float):
    return match_rate(
        lambda omega, amplitude: scenes.tian(omega, amplitude, "hard", gap=gap),
        lambda omega, amplitude: scenes.tian(omega, amplitude, "soft", gap=gap),
        OMEGA, AMPLITUDE, workers=1,
    )  # fmt: skip


def cells(axes: list[Axes], study: object, x: np.ndarray, y: np.ndarray, names: list[str]) -> None:
    for ax, name in zip(axes, names, strict=False):
        ax.pcolormesh(x, y, np.asarray(study[name], float).T, vmin=0, vmax=1, cmap="Blues")
        ax.set_title(TITLES[name], fontsize="small")
        ax.set_facecolor("0.75")


def save(figure: object, name: str) -> None:
    figure.savefig(PAGES / f"{name}.svg", metadata={"Date": None})
    pyplot.close(figure)


def over_rho() -> None:
    rho = np.arange(6.0, 31.0)
    study = sweep(of_rho, {"rho": rho}, progress=False)
    names = list(of_rho(15.0))
    figure, ax = pyplot.subplots(figsize=(8, 2), layout="constrained")
    ax.pcolormesh(rho, np.arange(3), [study[name] for name in names], vmin=0, vmax=1, cmap="Blues")
    ax.set(
        yticks=range(3),
        yticklabels=[TITLES[name] for name in names],
        xlabel="rho (blue: the claim is met)",
    )
    save(figure, "begley-virgin")


def over_gap() -> None:
    gap, zeta = np.linspace(0.2, 1.2, 11), np.array([0.01, 0.02, 0.03, 0.04, 0.05])
    study = sweep(of_gap, {"gap": gap, "zeta": zeta}, progress=False)
    names = list(of_gap(1.0, 0.03))
    figure, (above, under) = pyplot.subplots(2, 2, figsize=(8, 6), layout="constrained")
    cells(list(above), study, gap, zeta, names)
    for ax in above:
        ax.set(xlabel="gap", ylabel="zeta")
    rates = sweep(shares_of, {"gap": gap}, progress=False)
    shares = np.array([rates[f"below_{1000 * below:.0f}"] for below in BELOW])
    shown = {"vmin": 0.7, "vmax": 1.0, "cmap": "Blues"}
    under[0].pcolormesh(gap, np.arange(len(BELOW)), shares, **shown)
    under[0].set(
        xlabel="gap", ylabel="threshold of e_c", yticks=range(len(BELOW)), yticklabels=BELOW
    )
    # A box from the least omega and A to others is a part of the plane.
    alike = plane(1.0).distance < 0.1
    size = np.outer(np.arange(1, len(OMEGA) + 1), np.arange(1, len(AMPLITUDE) + 1))
    boxes = alike.cumsum(axis=0).cumsum(axis=1) / size
    drawn = under[1].pcolormesh(OMEGA[10:], AMPLITUDE[10:], boxes[10:, 10:].T, **shown)
    under[1].set(xlabel="greatest omega of the box", ylabel="greatest A of the box")
    for ax, values, x, y in (
        (under[0], shares, gap, np.arange(len(BELOW))),
        (under[1], boxes[10:, 10:].T, OMEGA[10:], AMPLITUDE[10:]),
    ):
        ax.contour(x, y, values, levels=[0.919], colors="k", linewidths=0.8)
        ax.set_title("Fig. 1c: share that matches, line: 91.9 %", fontsize="small")
    figure.colorbar(drawn, ax=list(under))
    figure.suptitle("above, blue: the claim is met", fontsize="small")
    save(figure, "tian")


def over_beam() -> None:
    zeta, amplitude = np.array([0.01, 0.03, 0.05, 0.075, 0.1, 0.125]), np.linspace(0.22, 0.3, 9)
    study = sweep(of_beam, {"zeta": zeta, "amplitude": amplitude}, progress=False)
    figure, axes = pyplot.subplots(
        2, 4, figsize=(11, 5), layout="constrained", sharex=True, sharey=True
    )
    names = list(of_beam(0.03, 0.25))
    cells(list(axes.flat), study, zeta, amplitude, names)
    figure.supxlabel(
        "zeta (blue: the claim is met; grey: at 20.3355 Hz the beam does not reach its stop)"
    )
    figure.supylabel("A")
    save(figure, "karpodinis")
    both = np.nan_to_num(np.prod([np.asarray(study[name], float) for name in names], axis=0))
    print(f"all claims of the beam are met in {int(both.sum())} of {both.size} cells")


def main() -> None:
    pyplot.rcParams["svg.hashsalt"] = "impactsig"
    over_rho()
    over_gap()
    over_beam()


if __name__ == "__main__":
    main()
