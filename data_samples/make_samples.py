"""Make the recordings of this folder from integrated impacts: data_samples/make_samples.py."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.recordings import PULSES, add_pulses  # noqa: E402
from tests import naive  # noqa: E402

FORCE_RATE = 50_000.0
SOUND_RATE = 22_050.0
VOLTS_PER_VELOCITY = 0.6  # of an approach velocity of one gap times omega_n
CONTACT = 300e-6  # [s], of an impact of unit approach velocity
TRANSIENT = 200  # forcing periods left out
SWELL_PERIODS = 80  # forcing periods in which the grazing runs' forcing swells and fades once
MODES = ((2140.0, 6e-3, 1.0), (3710.0, 4e-3, 0.6), (5930.0, 2e-3, 0.4))  # [Hz], [s], share


@dataclass(frozen=True)
class Sample:
    """One file: forcing [Hz] and its relative swell, length [s], and what recorded it."""

    name: str
    frequency: float
    duration: float
    sensor: str
    seed: int
    swell: float = 0.0


SAMPLES = (
    Sample("loadcell_periodic_22.1Hz.wav", 22.1, 10.0, "force", 1),
    Sample("loadcell_chaotic_20.1Hz.wav", 20.1, 10.0, "force", 2),
    Sample("loadcell_grazing_19.3Hz.tdms", 19.3, 8.0, "force", 3, swell=0.04),
    Sample("loadcell_periodic_22.1Hz_short.csv", 22.1, 0.8, "force", 4),
    Sample("loadcell_chaotic_20.1Hz_short.lvm", 20.1, 1.0, "force", 5),
    Sample("sound_periodic_22.1Hz.flac", 22.1, 6.0, "sound", 6),
    Sample("sound_chaotic_20.1Hz.flac", 20.1, 8.0, "sound", 7),
    Sample("sound_grazing_19.3Hz.flac", 19.3, 12.0, "sound", 8, swell=0.04),
)


@cache
def beam_impacts(frequency, duration, swell=0.0, *, steps=400):
    """Instants [s] and approach velocities; the forcing is at its maximum at time 0.

    With a `swell` the amplitude of the forcing is AMPLITUDE (1 + swell cos(2 pi k / SWELL_PERIODS))
    in its k-th period. Near grazing this makes impacting alternate with stretches without.
    """
    omega = naive.frequency_ratio(frequency)
    state = (0.0, 0.0, 0.0)
    instants, velocity = [], []
    for k in range(TRANSIENT + int(duration * frequency) + 2):
        amplitude = naive.AMPLITUDE * (1 + swell * np.cos(2 * np.pi * k / SWELL_PERIODS))
        t, v, state = naive.integrate_impacts(
            omega, 1, steps=steps, amplitude=float(amplitude), state=state
        )
        instants.extend(t)
        velocity.extend(v)
    time = naive.seconds(instants) - TRANSIENT / frequency
    inside = (time > 2e-3) & (time < duration - 2e-3)
    return time[inside], np.array(velocity)[inside]


def load_cell(time, velocity, duration, rng):
    """Strain [V] of a load cell behind the stop, and the contact time [s] of each impact.

    Half-sine pulses whose peak is proportional to the approach velocity; contact times follow
    Hertz, velocity**(-1/5). White noise of 2 mV, 50 Hz hum of 3 mV, a drift of 15 mV.
    """
    t = np.arange(round(duration * FORCE_RATE)) / FORCE_RATE
    volts = 2e-3 * rng.standard_normal(len(t))
    volts += 3e-3 * np.sin(2 * np.pi * 50 * t + 1) + 15e-3 * np.sin(2 * np.pi * t / 17)
    contact = CONTACT * velocity**-0.2
    add_pulses(volts, FORCE_RATE, time, contact, VOLTS_PER_VELOCITY * velocity, PULSES["half-sine"])
    return volts, contact


def microphone(time, velocity, duration, rng):
    """Sound: every impact rings three modes; pink room noise, RMS 0.002 of full scale."""
    count = round(duration * SOUND_RATE)
    spectrum = np.fft.rfft(rng.standard_normal(count))
    spectrum /= np.sqrt(np.maximum(np.fft.rfftfreq(count, 1 / SOUND_RATE), 20.0))
    sound = np.fft.irfft(spectrum, count)
    sound *= 2e-3 / sound.std()
    for start, speed in zip(time, velocity, strict=True):
        first = int(np.ceil(start * SOUND_RATE))
        since = np.arange(first, min(first + round(0.06 * SOUND_RATE), count)) / SOUND_RATE - start
        for tone, decay, share in MODES:
            phase = rng.uniform(0, 2 * np.pi)
            ring = np.exp(-since / decay) * np.sin(2 * np.pi * tone * since + phase)
            sound[first : first + len(since)] += 0.5 * speed * share * ring
    return sound


def write(path, samples):
    """Write samples, of which 1.0 is the full scale of a 16-bit converter (1 V for force)."""
    counts = np.round(samples * 32768).astype(np.int64)
    assert np.abs(counts).max() < 32767, "the converter clips"
    counts = counts.astype(np.int16)
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


def write_truth(path, sample, time, velocity, contact):
    """A table beside the recording that `Impacts.read_csv` understands."""
    run = {
        "start": 0.0,
        "duration": sample.duration,
        "unit": "V" if sample.sensor == "force" else "",
        "sensor": sample.sensor,
        "source": f"integrated: {sample.name}",
        "settings": {
            "forcing_frequency": sample.frequency,
            "natural_frequency": naive.NATURAL_FREQUENCY,
            "damping": naive.DAMPING,
            "amplitude": naive.AMPLITUDE,
            "swell": sample.swell,
            "restitution": naive.RESTITUTION,
        },
    }
    columns = {"time": time, "approach_velocity": velocity}
    if contact is not None:
        columns |= {"contact_time": contact, "peak": VOLTS_PER_VELOCITY * velocity}
    rows = ("".join(f"{v:.12g}," for v in row)[:-1] for row in zip(*columns.values(), strict=True))
    lines = [f"# impactsig {json.dumps(run)}", ",".join(columns), *rows]
    path.write_text("\n".join(lines) + "\n", newline="\n")


def make(sample, folder):
    """Write one sample and its truth into `folder`."""
    time, velocity = beam_impacts(sample.frequency, sample.duration, sample.swell)
    rng = np.random.default_rng(sample.seed)
    contact = None
    if sample.sensor == "force":
        samples, contact = load_cell(time, velocity, sample.duration, rng)
    else:
        samples = microphone(time, velocity, sample.duration, rng)
    path = Path(folder) / sample.name
    write(path, samples)
    write_truth(path.with_suffix(".truth.csv"), sample, time, velocity, contact)


if __name__ == "__main__":
    for sample in SAMPLES:
        make(sample, Path(__file__).parent)
        print(sample.name)
