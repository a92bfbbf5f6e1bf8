"""Make the folder experiment/: the beam recorded at eleven frequencies upwards and downwards."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import soundfile

from impactsig import LoadCell, bifurcation_diagram, scenes, simulate, synthesize

FREQUENCIES = np.round(np.arange(19.0, 21.51, 0.25), 2)
SECONDS, RATE = 4.0, 8000
CONTACT = 1.5e-3  # [s], of an impact of unit approach velocity: a soft cell, recorded slowly
RIG = """# The rig of this folder: one load cell; the frequency and the branch stand in the names.
files = "**/*.flac"

[[channel]]
number = 0
sensor = "force"
unit = "V"

[parameter]
name = "frequency"
unit = "Hz"
from = "file name"
pattern = '(?P<branch>up|down)_(?P<value>[0-9.]+)Hz'

[forcing]
frequency = "parameter"
"""


def main() -> None:
    """Write the recordings and their rig."""
    folder = Path(__file__).parent / "experiment"
    folder.mkdir(exist_ok=True)
    (folder / "rig.toml").write_text(RIG, encoding="utf-8")
    for seed, (branch, values) in enumerate((("up", FREQUENCIES), ("down", FREQUENCIES[::-1]))):
        diagram = bifurcation_diagram(scenes.karpodinis, values, carry=True)
        for number, (value, strobe) in enumerate(zip(values, diagram.strobe, strict=True)):
            scene = scenes.karpodinis(float(value))
            motion = simulate(scene, periods=SECONDS * float(value), initial=tuple(strobe[-1]))
            hits = motion.impacts
            train = replace(
                hits,
                start=0.0,
                duration=SECONDS,
                contact_time=CONTACT * hits.approach_velocity**-0.2,
                peak=0.6 * hits.approach_velocity,
                unit="V",
            )
            made = synthesize(train, LoadCell(noise=4e-3), rate=RATE, seed=100 * seed + number)
            name = folder / f"{branch}_{value:05.2f}Hz.flac"
            soundfile.write(name, made.samples, RATE, subtype="PCM_16")


if __name__ == "__main__":
    main()
