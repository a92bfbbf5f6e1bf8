"""Every kind of motion refuses times at which it has no state, in the same words."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Cantilever,
    Controlled,
    DelayedFeedback,
    Force,
    InvalidInput,
    Oscillator,
    Rigid,
    Stop,
    flows,
    simulate,
)

MACHINE = Oscillator(damping=0.2, forces=(Force(1.0, 0.9),), stops=(Stop(0.5, Rigid(0.7)),))
BEAM = Cantilever(
    0.2, 0.02, 0.001, 2e11, 7800.0, Stop(1e-3, Rigid(0.7)), BaseMotion(1e-3, 10.0), modes=2
)
CALLS = {
    "oscillator": lambda: simulate(MACHINE, periods=2).sample,
    "cantilever": lambda: simulate(BEAM, periods=2).sample,
    "flow": lambda: simulate(flows.rossler(), duration=2.0).sample,
    "control force": lambda: simulate(Controlled(MACHINE, DelayedFeedback(0.1)), periods=2).force,
    "controlled flow": lambda: (
        simulate(
            Controlled(flows.rossler(), DelayedFeedback(0.1, delay=1.0, signal=1)), duration=4.0
        ).sample
    ),
}


@pytest.mark.parametrize("kind", CALLS)
def test_times_without_a_state_are_refused_by_name(kind):
    sample = CALLS[kind]()
    assert np.isfinite(np.asarray(sample([0.0, 1.0]))).all()
    for wrong in ("soon", 1j, np.datetime64("NaT"), -1.0, 1e9, np.nan):
        with pytest.raises(InvalidInput, match=r"^time: got .*(times .* span)"):
            sample(wrong)
