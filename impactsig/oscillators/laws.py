"""The contact laws, written once: coding of stops, contact forces, restitution.

- *Rigid*: the velocity v becomes -r v, r a number or a function of the approach velocity.
- *Kelvin-Voigt*: stiffness * depth + loss * inward. Contact ends at zero gap (`SPRING`), or the
  stop only pushes, and it ends at zero force (`PUSHER`).
- *Hertz*, with the loss of Hunt and Crossley: stiffness * depth^n * (1 + loss * inward). The loss
  may be a number over the approach velocity, as that of Lankarani and Nikravesh is.

`depth` and `inward` are how far the mass is behind the stop's place, and its velocity that way. The
force of the user's own `law` is `rates.accelerate`'s: it belongs to no stop.

The functions serve Python and numpy as they are; `rates` and `stochastic.paths.equation` compile
them. The laws of `stops` put themselves into these columns.
"""

from __future__ import annotations

from typing import Any, NamedTuple

RIGID, SPRING, PUSHER, HERTZ = range(4)

# Columns of a table of stops. LOSS is the damping of a Kelvin-Voigt stop, or the loss per velocity
# of Hunt and Crossley. What a stop needs beyond that is numbered from `LAW_COLUMNS` on.
PLACE, SIDE, LAW, STIFFNESS, LOSS, EXPONENT, RESTITUTION = range(7)
BY_APPROACH = RESTITUTION  # of a Hertz stop: its loss per velocity, times the approach velocity
LAW_COLUMNS = RESTITUTION + 1


class Row(NamedTuple):
    """The columns from LAW to RESTITUTION of a stop."""

    law: int
    stiffness: float
    loss: float
    exponent: float
    restitution: float


# Numbers of the last column that are none: of a stop that has no such number, and of one that has
# a function in place of it.
NO_NUMBER, BY_FUNCTION = -1.0, -2.0


def spring_push(stiffness: Any, loss: Any, depth: Any, inward: Any) -> Any:
    """Force of a Kelvin-Voigt stop."""
    return stiffness * depth + loss * inward


def hertz_push(stiffness: Any, exponent: Any, loss: Any, depth: Any, root: Any, inward: Any) -> Any:
    """Force of a Hertz stop in contact; for the usual exponent, without calling pow.

    `root` is that of the depth, which is taken otherwise of a number than of an array.
    """
    power = depth * root if exponent == 1.5 else depth**exponent
    return stiffness * power * (1 + loss * inward)


def approach_loss(by_approach: Any, approach: Any) -> Any:
    """Loss per velocity of a contact whose loss goes by its approach velocity.

    A touch at no speed has no velocity to measure the loss by, and none is taken.
    """
    return by_approach / approach if approach > 0 else 0.0
