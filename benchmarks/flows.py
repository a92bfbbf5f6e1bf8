"""Spikes of flows: intervals per second and their errors, beside scipy's solve_ivp.

Both integrate Lorenz' and Rössler's flow with the integral of the signal as a further coordinate,
and fire at 20; scipy with DOP853, its dense output and an event. Errors are those of the first ten
instants against Taylor series of 25 digits. Prints a table.

    python -m benchmarks.flows
"""

from __future__ import annotations

import time

import mpmath
import numpy as np
from scipy.integrate import solve_ivp

from impactsig import flows, integrate_and_fire

THRESHOLD = 20.0


def scipy_fires(flow, count, tolerance):
    """The same spikes by solve_ivp, which is started anew at each."""

    def rates(t, y):
        return [*flow.function(t, y, *flow.parameters), flow.signal(y)]

    def full(t, y):
        return y[-1] - THRESHOLD

    full.terminal = True
    now, state, times = 0.0, np.array(flow.initial), []
    for _ in range(count):
        run = solve_ivp(
            rates, (now, now + 100), [*state, 0.0], "DOP853", events=full, dense_output=True,
            rtol=tolerance, atol=tolerance,
        )  # fmt: skip
        now, state = run.t_events[0][0], run.y_events[0][0][:-1]
        times.append(now)
    return np.array(times)


def exact(flow, times):
    """The instants nearest to those given, to 25 digits."""
    with mpmath.workdps(30):
        parameters = [mpmath.mpf(value) for value in flow.parameters]

        def rates(t, y):
            return [*flow.function(t, y, *parameters), flow.signal(y)]

        start = [mpmath.mpf(value) for value in (*flow.initial, 0)]
        solution = mpmath.odefun(rates, 0, start, tol=mpmath.mpf(10) ** -25)
        return [
            mpmath.findroot(lambda t, n=n: solution(t)[-1] - THRESHOLD * n, mpmath.mpf(float(at)))
            for n, at in enumerate(times, start=1)
        ]


def best_rate(run, count, repeats=3):
    """Intervals per second, best of several runs."""
    least = np.inf
    for _ in range(repeats):
        start = time.perf_counter()
        run(count)
        least = min(least, time.perf_counter() - start)
    return count / least


def main():
    """Print the table."""
    print(f"{'flow':8} {'tool':22} {'intervals/s':>12} {'greatest error of 10':>22}")
    for flow in (flows.lorenz(), flows.rossler()):

        def ours(count, flow=flow):
            return integrate_and_fire(flow, THRESHOLD, count=count).time

        truth = exact(flow, ours(10))
        rows = [("impactsig", ours, 20_000)]
        for tolerance in (1e-9, 1e-13):

            def theirs(count, flow=flow, tolerance=tolerance):
                return scipy_fires(flow, count, tolerance)

            rows.append((f"solve_ivp, rtol {tolerance:g}", theirs, 50))
        for name, run, count in rows:
            error = max(abs(float(a - t)) for a, t in zip(run(10), truth, strict=True))
            print(f"{flow.name:8} {name:22} {best_rate(run, count):12.0f} {error:22.1e}")


if __name__ == "__main__":
    main()
