"""Single gradual rises of power, as of gusts of wind, distinguished from impacts.

Noise that swells raises narrow bands as much as an impact does, but all of them, and for longer
than the 10 ms over which B is taken. With P(a, b) the mean square of the innovations from a to b
milliseconds after the attack, and

    R = ln(P(0, 4) / P(-4, 0)),    S = ln(P(1, 8) / P(-8, -1)),    S' = ln(P(-8, -1) / P(-16, -8)),

a rise of 0.33 and more in narrow bands, with H below 60, R below 3 and S above 0.3 has the log-odds

    x = 2.2 (R - 0.75 S) - 1.6 S' - 0.9 W + 0.55 ln(1 + H) + 1.5 ln(1 + G) + 0.95 ln(e + 0.03) - 5.4

of being sudden, where W is by how much the rising bands go on to rise within 17 ms, and e the
evidence from octaves (`_octave_evidence.py`): an impact raises the power at once, neither before
nor after, and most in a few bands, whereas sound that swells rises evenly in time and frequency. R
is limited to -1 and 3, S to -1 and 4, S' to -1 and 2, W to -1 and 3. Beside digital silence x is
not asked.
Swelling noise swells again, but a single gradual onset may be that of an impact: with n others of
negative x within a second, the log-odds of an impact are at most x + 3 - 1.15 min(n, 4).

Fitted by logistic regression to noise modulated 1 to 40 times a second, noise of random level, and
`benchmarks.other_sounds`, `benchmarks.varied_sound` (seeds 92201 to 92204), drums and keys.
"""

from __future__ import annotations

import numpy as np

from .._kernels import STEP
from .._nearby import places_about
from .._survey import Passage
from ._gradual_kernels import put_gradual_odds, put_steady_odds
from ._rise_odds_kernels import HERE

EDGES = -16e-3, -8e-3, -4e-3, -1e-3, 0.0, 1e-3, 4e-3, 8e-3  # [s], about the attack
NEAR, ALONE, EACH, MOST_OTHERS = 1.0, 3.0, -1.15, 4  # [s], log-odds alone, for each other, and most


def steady_odds(
    passage: Passage, frame: np.ndarray, by_octaves: np.ndarray, seconds: float
) -> np.ndarray:
    """The part of x that does not depend on the attack; infinite where a rise is not gradual.

    Parameters
    ----------
    frame, by_octaves : ndarray
        Frames of `seconds` each at which impacts lie, and their evidence from octaves.
    """
    out = np.empty(len(frame))
    put_steady_odds(
        frame, by_octaves, passage.bands, passage.likelihood, passage.growth, passage.rises,
        round(HERE / (STEP * seconds)), out,
    )  # fmt: skip
    return out


def gradual_odds(steady: np.ndarray, power: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Log-odds that rises are sudden; infinite if not asked for.

    `steady` are their `steady_odds`, `power` the powers between the `edges` [samples], NaN where
    not asked for.
    """
    out = np.empty(len(steady))
    put_gradual_odds(steady, power, edges, out)
    return out


def most_odds_beside(instant: np.ndarray, odds: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """The greatest log-odds that impacts at these instants [s], in order, may have.

    `odds` are those of `gradual_odds`. Those that are `likely` otherwise are company.
    """
    gradual = (odds < 0.0) & likely
    if not gradual.any():
        return odds + ALONE
    total = np.append(0, np.cumsum(gradual))
    first, last = places_about(instant, instant, NEAR, NEAR)
    others = np.minimum(total[last] - total[first] - gradual, MOST_OTHERS)
    return np.asarray(odds + ALONE + EACH * others)
