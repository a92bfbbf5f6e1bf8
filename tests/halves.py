"""Half of a grid of cases for the default run, the rest when slow."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import pytest


def half(*choices: Sequence[Any]) -> list[Any]:
    """The product of the choices, of which every other one is slow.

    Of n choices, all combinations of n - 1 of them stay in the default run.
    """
    return [
        pytest.param(
            *(options[k] for options, k in zip(choices, places, strict=True)),
            marks=pytest.mark.slow if sum(places) % 2 else (),
        )
        for places in product(*(range(len(options)) for options in choices))
    ]
