"""The contact laws, written once: coding of stops, contact forces, restitution.

- *Rigid*: the velocity v becomes -r v, r a number or a function of the approach velocity.
- *Kelvin-Voigt*: stiffness * depth + loss * inward. Contact ends at zero gap (`SPRING`), or the
  stop only pushes, and it ends at zero force (`PUSHER`).
- *Hertz*, with the loss of Hunt and Crossley: stiffness * depth^n * (1 + loss * inward). The loss
  of Lankarani and Nikravesh follows from a restitution coefficient and the approach velocity.

`depth` and `inward` are how far the mass is behind the stop's place, and its velocity that way. The
force of the user's own `law` is `rates.accelerate`'s: it belongs to no stop.

The functions serve Python and numpy as they are; `rates` and `stochastic._equation` compile them.
`stops` puts the stops of an oscillator into these columns.
"""

from __future__ import annotations

from typing import Any

RIGID, SPRING, PUSHER, HERTZ = range(4)

# Columns of a table of stops. LOSS is the damping of a Kelvin-Voigt stop, or the loss per velocity
# of Hunt and Crossley. What a stop needs beyond that is numbered from `LAW_COLUMNS` on.
PLACE, SIDE, LAW, STIFFNESS, LOSS, EXPONENT, RESTITUTION = range(7)
LAW_COLUMNS = RESTITUTION + 1

# Restitution coefficients that are none: of a stop that has no such number, and of one that has a
# function in place of it.
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


def hertz_loss(restitution: Any, approach: Any) -> Any:
    """Loss per velocity of Lankarani and Nikravesh [LankaraniNikravesh1990]_.

    A touch at no speed has no velocity to measure the loss by, and none is taken.
    """
    return 0.75 * (1 - restitution * restitution) / approach if approach > 0 else 0.0
