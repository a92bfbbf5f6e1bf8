"""One valid call of each public callable, quick to run: what `test_arguments` varies."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import soundfile

import impactsig as im


def driven(amplitude: float, damping: float = 0.1) -> im.Oscillator:
    return im.Oscillator(
        damping=damping,
        forces=(im.Force(amplitude, 0.9),),
        stops=(im.Stop(0.5, im.Rigid(0.7)),),
    )


def noisy(intensity: float) -> im.Oscillator:
    return im.Oscillator(damping=0.2, noise=im.Noise(intensity))


def rates(t: float, y: Any) -> Any:
    return y[1], -y[0]


def double(a: float) -> float:
    return 2 * a


class Things:
    """What the calls take, each made when first asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.rng = np.random.default_rng(0)

    @cached_property
    def x(self) -> np.ndarray:
        return np.cos(np.arange(200) * 0.7) + np.random.default_rng(0).normal(0, 0.1, 200)

    @cached_property
    def intervals(self) -> np.ndarray:
        return np.random.default_rng(1).exponential(1.0, 60) + 0.1

    @cached_property
    def irregular(self) -> im.Impacts:
        return im.Impacts(np.cumsum(self.intervals))

    @cached_property
    def train(self) -> im.Impacts:
        return im.Impacts(np.arange(80) * 0.05 + np.random.default_rng(2).normal(0, 1e-4, 80))

    @cached_property
    def bounces(self) -> im.Impacts:
        return im.Impacts(np.cumsum(0.5 * 0.8 ** np.arange(8)), time_error=np.full(8, 1e-4))

    @cached_property
    def oscillator(self) -> im.Oscillator:
        return driven(1.0)

    @cached_property
    def orbit(self) -> im.results.PeriodicOrbit:
        return im.find_periodic_orbit(self.oscillator)

    @cached_property
    def saddle(self) -> im.results.PeriodicOrbit:
        found = im.find_periodic_orbits(im.scenes.karpodinis(20.1), guesses=60)
        return next(orbit for orbit in found if abs(orbit.multipliers).max() > 1)

    @cached_property
    def motion(self) -> im.results.Motion:
        return im.simulate(self.oscillator, periods=20)

    @cached_property
    def beam(self) -> im.Cantilever:
        return im.Cantilever(0.2, 0.02, 0.001, 2e11, 7800.0)

    @cached_property
    def beam_motion(self) -> im.results.BeamMotion:
        stop, base = im.Stop(1e-3, im.Rigid(0.7)), im.BaseMotion(1e-3, 10.0)
        return im.simulate(replace(self.beam, stop=stop, modes=3, forcing=base), periods=30)

    @cached_property
    def recording(self) -> im.Recording:
        spikes = im.Impacts(np.arange(1, 10) * 0.1)
        return im.synthesize(spikes, "force", rate=20_000.0, duration=1.2, seed=1)

    @cached_property
    def sound(self) -> im.Recording:
        spikes = im.Impacts(np.arange(1, 10) * 0.1)
        return im.synthesize(spikes, "sound", rate=22_050.0, duration=1.2, seed=1)

    @cached_property
    def swinging(self) -> im.Recording:
        time = np.arange(2000) / 1000.0
        noise = np.random.default_rng(3).normal(0, 1e-3, 2000)
        return im.Recording(np.sin(6 * np.pi * time) + noise, 1000.0)

    @cached_property
    def decaying(self) -> im.Recording:
        time = np.arange(2000) / 1000.0
        noise = np.random.default_rng(4).normal(0, 1e-4, 2000)
        return im.Recording(np.exp(-3 * time) * np.sin(60 * np.pi * time) + noise, 1000.0)

    @cached_property
    def file(self) -> Path:
        path = self.folder / "a.wav"
        samples = self.recording.samples
        soundfile.write(path, 0.9 * samples / np.abs(samples).max(), 20_000)
        return path

    @cached_property
    def study(self) -> Path:
        im.sweep(double, {"a": [1.0]}, directory=self.folder / "study")
        return self.folder / "study"


def valid_calls(t: Things) -> dict[str, tuple[tuple[Any, ...], dict[str, Any]]]:
    """Arguments of each, by position and by name."""
    ones = np.ones(3)
    rossler = im.flows.rossler()
    made: dict[str, Any] = {}

    def call(name: str, /, *args: Any, **options: Any) -> None:
        made[name] = args, options

    call("BaseMotion", 1.0, 1.0)
    call("Cantilever", 0.2, 0.02, 0.001, 2e11, 7800.0)
    call("ContactSamples", ones, ones, ones, ones, 0.1 * ones)
    call("Controlled", t.oscillator, im.DelayedFeedback(0.1))
    call("DelayedFeedback", 0.1)
    call("FixedStep")
    call("Flow", rates, (1.0, 0.0))
    call("Force", 1.0, 1.0)
    call("Friction", 0.1)
    call("Hertz", 10.0)
    call("Impacts", np.arange(3.0))
    call("KelvinVoigt", 10.0)
    call("Limits")
    call("LoadCell")
    call("Microphone")
    call("Noise", 0.1)
    call("OGY", t.saddle, 0.1)
    call("Oscillator")
    call("RawLayout", "int16")
    call("Recording", np.ones((5, 1)), 10.0)
    call("Rig", [{"number": 0}], reading={"start": 0.0})
    call("Rigid", 0.7)
    call("RungeKutta")
    call("Stop", 1.0, im.Rigid(0.7))
    call("Swept", t.oscillator)
    call("align_impacts", t.irregular, t.irregular)
    call("apparent_restitution", t.beam_motion)
    call("embedding_delay", t.x, longest=5)
    call("averaged_density", im.scenes.van_der_pol_duffing())
    call("averaged_false_neighbors", t.x)
    call("basins_of_attraction", t.oscillator, [-1.0, 0.4], [-1.0, 1.0])
    call("bifurcation_diagram", driven, [1.0, 1.1], periods=5, transient=5, seed=1)
    call("coefficient_of_variation", t.intervals)
    call("combine_impacts", [t.train, t.train])
    call("compare", t.train, t.train)
    call("continue_orbit", driven, [1.0, 1.02])
    call("correlation_dimension", t.irregular)
    call("correlation_sum", t.x)
    call("cv2", t.intervals)
    call("delay_embed", t.x, 2)
    call("detect_impacts", t.recording)
    call("detect_many", [t.file], workers=1)
    call("displacement_section", t.motion)
    call("equivalence_error", im.KelvinVoigt(1000.0, 1.0), 0.7)
    call("false_nearest_neighbors", t.x)
    call("find_periodic_orbit", t.oscillator)
    call("find_periodic_orbits", t.oscillator, guesses=3)
    call("fit_calibration", np.arange(5.0), [0, 2.1, 3.9, 6, 8.1])
    call("fit_oscillator", t.train, 0.05, scene=t.oscillator)
    call("fit_soft_stop", 0.7, evaluations=100, seed=0)
    call("identify_period", t.train)
    call("identify_resonance", t.decaying, "decay")
    call("impact_map", t.motion)
    call("info", t.file)
    call("IntervalFeedback", 0.1, 0.1)
    call("identify_friction", t.decaying)
    call("integrate_and_fire", rossler, 5.0, count=5)
    call("interval_histogram", t.intervals)
    call("local_variation", t.intervals)
    call("lyapunov_exponent", t.x, dimension=2)
    call("lyapunov_spectrum", t.oscillator, periods=20)
    call("match_impacts", t.train, t.train)
    call("match_rate", driven, driven, [1.0], [0.1, 0.2], periods=5, transient=5, workers=1)
    call("measure", t.train, seed=1)
    call("mutual_information", t.x, t.x[::-1])
    call("open_study", t.study)
    call("orbit_period", t.motion)
    call("orbit_stability", t.orbit, im.DelayedFeedback(0.1), laps=50)
    call("ordinal_patterns", t.x)
    call("p_bifurcation", lambda a: im.scenes.van_der_pol_duffing(a), [0.9, 0.95])
    call("periodicity_chart", driven, [1.0], [0.1, 0.2], periods=5, workers=1)
    call("prediction_error", t.x)
    call("read", t.file)
    call("read_blocks", t.file, 0.5)
    call("read_many", [t.file], workers=1)
    call("recorded_motion", t.swinging)
    call("recurrence_plot", t.x, radius=0.2, workers=1)
    call("recurrence_quantification", t.x, radius=0.2, workers=1)
    call("repair_intervals", t.intervals, 1.0)
    call("response_spectrum", driven, [1.0], periods=5, transient=5, workers=1)
    call("restitution_from_bounces", t.bounces, contact_time=0.0)
    call("return_map", t.intervals)
    call("return_map_determinism", t.x, count=19, seed=1)
    call("separate_stops", t.sound, t.train)
    call("simulate", t.oscillator, periods=5)
    call("simulate_blocks", t.oscillator, block=5, periods=10)
    call("simulate_ensemble", noisy(0.1), paths=4, duration=50.0, seed=1)
    call("simulate_many", [t.oscillator] * 2, periods=5, workers=1)
    call("stability_chart", t.orbit, [0.1], laps=50)
    call("stop_damping", 0.7, 10.0)
    call("stop_restitution", 10.0, 1.0)
    call("stop_stiffness", 0.7, 1.0)
    call("strobe_distance", np.zeros((4, 2)), np.ones((4, 2)))
    call("surrogate_test", t.x, count=19, seed=1)
    call("surrogates", t.x, seed=1)
    call("sweep", double, {"a": [1.0, 2.0]})
    call("synthesize", t.train, rate=20_000.0, seed=1)
    call("tangent_map", t.oscillator, periods=5)
    call("threshold_crossings", rossler, 0.0, count=5)
    call("time_reversal_asymmetry", t.x)
    call("track_period", t.train, 0.05)
    call("write_report", t.file, t.folder / "page.html")
    call("write_reports", [t.file], t.folder / "pages", workers=1)
    return made
