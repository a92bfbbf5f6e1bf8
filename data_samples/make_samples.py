"""Make the recordings of this folder from simulated impacts: data_samples/make_samples.py."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from impactsig import Force, Impacts, LoadCell, Microphone, Recording, scenes, simulate, synthesize

FORCE_RATE = 50_000.0
SOUND_RATE = 22_050.0
VOLTS_PER_VELOCITY = 0.6  # of an approach velocity of one gap times omega_n
CONTACT = 300e-6  # [s], of an impact of unit approach velocity
TRANSIENT = 240  # forcing periods left out; three beats of the grazing beam
BEAT = 80  # forcing periods in which the grazing beam's forcing swells and fades once
GRAZING = 0.082, 0.0123  # amplitudes of its two forces: the first alone would just reach the stop

LOAD_CELL = LoadCell(noise=2e-3, hum=3e-3, drift=15e-3, drift_period=17.0, unit="V")
MICROPHONE = Microphone(distance=0.3, gain=0.15, noise=2e-3)


@dataclass(frozen=True)
class Sample:
    """One file: forcing [Hz], length [s], what recorded it."""

    name: str
    frequency: float
    duration: float
    sensor: str
    seed: int


SAMPLES = (
    Sample("loadcell_periodic_22.1Hz.wav", 22.1, 10.0, "force", 1),
    Sample("loadcell_chaotic_20.1Hz.wav", 20.1, 10.0, "force", 2),
    Sample("loadcell_grazing_21.55Hz.tdms", 21.55, 8.0, "force", 3),
    Sample("loadcell_periodic_22.1Hz_short.csv", 22.1, 0.8, "force", 4),
    Sample("loadcell_chaotic_20.1Hz_short.lvm", 20.1, 1.0, "force", 5),
    Sample("sound_periodic_22.1Hz.flac", 22.1, 6.2, "sound", 6),
    Sample("sound_chaotic_20.1Hz.flac", 20.1, 8.0, "sound", 7),
    Sample("sound_grazing_21.55Hz.flac", 21.55, 12.0, "sound", 8),
)


def scene(sample: Sample):
    """The beam of the thesis; near grazing it is forced by two forces that beat."""
    beam = scenes.karpodinis(sample.frequency)
    if "grazing" not in sample.name:
        return beam
    omega = beam.angular_forcing_frequency
    strong, weak = GRAZING
    return replace(beam, forces=(Force(strong, omega), Force(weak, omega * (1 + 1 / BEAT))))


def impacts_of(sample: Sample) -> Impacts:
    """What there was, before any instrument: the truth of a sample.

    The forcing is at its minimum at time 0, away from the impacts. Behind a load cell, peaks
    are proportional to the approach velocity and contact times follow Hertz, velocity**(-1/5).
    """
    beam = scene(sample)
    periods = sample.duration * sample.frequency
    motion = simulate(beam, periods=periods, transient=TRANSIENT, phase=np.pi)
    found = motion.impacts
    velocity = found.approach_velocity
    pulses = {}
    if sample.sensor == "force":
        pulses = {
            "contact_time": CONTACT * velocity**-0.2,
            "peak": VOLTS_PER_VELOCITY * velocity,
            "unit": "V",
        }
    return replace(
        found,
        time=found.time - motion.start,
        start=0.0,
        duration=sample.duration,
        sensor=sample.sensor,
        source=f"simulated: {sample.name}",
        settings={
            "forcing_frequency": sample.frequency,
            "natural_frequency": scenes.NATURAL_FREQUENCY,
            "damping": beam.damping / 2,
            "amplitudes": [force.amplitude for force in beam.forces],
            "restitution": beam.stops[0].law.restitution,
        },
        **pulses,
    )


def record(sample: Sample, truth: Impacts) -> Recording:
    """What the instrument made of it; 1.0 is full scale, 1 V for force."""
    instrument, rate = (
        (LOAD_CELL, FORCE_RATE) if sample.sensor == "force" else (MICROPHONE, SOUND_RATE)
    )
    return synthesize(truth, instrument, rate=rate, bits=16, full_scale=1.0, seed=sample.seed)


def write(path, recording):
    """Write a recording as the counts of its 16-bit converter."""
    counts = np.rint(recording.samples * 32768).astype(np.int16)
    assert np.abs(counts.astype(int)).max() < 32767, "the converter clips"
    {".wav": _audio, ".flac": _audio, ".tdms": _tdms, ".csv": _csv, ".lvm": _lvm}[path.suffix](
        path, counts
    )


def _audio(path, counts):
    import soundfile

    rate = FORCE_RATE if path.suffix == ".wav" else SOUND_RATE
    soundfile.write(path, counts, int(rate), subtype="PCM_16")


def _tdms(path, counts):
    """As NI-DAQmx logs it: raw counts, and the scale from counts to volts as properties."""
    from nptdms import ChannelObject, TdmsWriter

    properties = {
        "wf_start_offset": 0.0,
        "wf_increment": 1 / FORCE_RATE,
        "wf_samples": len(counts),
        "unit_string": "V",
        "NI_Number_Of_Scales": 1,
        "NI_Scaling_Status": "unscaled",
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 1 / 32768,
        "NI_Scale[0]_Linear_Y_Intercept": 0.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }
    with TdmsWriter(str(path)) as file:
        file.write_segment([ChannelObject("rig", "load cell", counts, properties)])


def _csv(path, counts):
    rows = (f"{i / FORCE_RATE:.5f},{n / 32768:.5f}\n" for i, n in enumerate(counts.tolist()))
    path.write_text("time [s],load cell [V]\n" + "".join(rows), newline="\n")


def _lvm(path, counts):
    """As LabVIEW writes it on a machine with decimal commas: no time column, a Delta_X."""
    head = (
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        "Decimal_Separator\t,",
        "Multi_Headings\tNo",
        "X_Columns\tNo",
        "Time_Pref\tRelative",
        "***End_of_Header***\t",
        "\t",
        "Channels\t1\t",
        f"Samples\t{len(counts)}\t",
        "Y_Unit_Label\tV\t",
        "X_Dimension\tTime\t",
        "X0\t0,0000000000000000E+0\t",
        f"Delta_X\t{1 / FORCE_RATE:.6E}\t".replace(".", ",").replace("E-0", "E-"),
        "***End_of_Header***\t\t",
        "X_Value\tload cell\tComment",
    )
    rows = (f"\t{n / 32768:.5f}\n".replace(".", ",") for n in counts.tolist())
    path.write_text("\n".join(head) + "\n" + "".join(rows), newline="\n")


def make(sample, folder):
    """Write one sample and its truth into `folder`."""
    truth = impacts_of(sample)
    path = Path(folder) / sample.name
    write(path, record(sample, truth))
    truth.to_csv(path.with_suffix(".truth.csv"))


if __name__ == "__main__":
    for sample in SAMPLES:
        make(sample, Path(__file__).parent)
        print(sample.name)
