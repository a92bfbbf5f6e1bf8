"""Small faults put in by hand, each of which a test must notice.

``python -m tests.faults`` puts them, one after the other, into a copy of this tree and runs the
tests that guard the place; with words, only faults whose names contain one of them. A fault that
no test notices is a missing test. A fault whose line is gone ends the run: give its new line, or
strike it out with the code.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]


class Fault(NamedTuple):
    """`line` of `file`, which stands there once, becomes `wrong`; `tests` should fail."""

    name: str
    file: str
    line: str
    wrong: str
    tests: str


REST = "tests/reference/test_rest_and_chatter.py"
SOFT = "tests/reference/test_simulation_soft.py -k begins_as"
UNITS = "tests/unit/test_io_time_units.py"
PULSES = "tests/unit/test_detect_pulses.py"
STORE = "tests/unit/test_sweep_store.py -k fingerprint"
PARTS = "tests/unit/test_fitting_parts.py"

CONTACT = "simulation/stepping/contact.py"
LEFT = "left = out * (1 / up + kept / down) / (1 - r * kept)"
CHANGE = "change = abs(jerk(p, f, leg, s, state[Q])) + most * left"
FALLS = "falls = g3 < 0 or (g3 == 0.0 and g4 < 0)"
BENDS = "(way * f1 > 0 or (f1 == 0.0 and way * f2 > 0))"
CALM = "calm = min(time_until(clock, end_turns, end_phase), smooth)"
TOUCH = "edges = touches(x, first, last, edge, seen)"

FAULTS = tuple(
    Fault(*row)
    for row in (
        (
            "energy taken off at every part",
            CONTACT,
            "state[LOST] -= v * v / 2 if before == 1 else 0.0",
            "state[LOST] -= v * v / 2",
            f"{REST} -k 'two_springs and stepped'",
        ),
        ("chatter: kept", CONTACT, LEFT, LEFT.replace("r * kept", "r"), f"{REST} -k rubbing"),
        ("chatter: down", CONTACT, LEFT, LEFT.replace("kept / d", "1 / d"), f"{REST} -k rubbing"),
        (
            "chatter: jerk",
            CONTACT,
            CHANGE,
            "change = most * left",
            f"{REST} -k hardly_changes",
        ),
        (
            "chatter: change of the force",
            CONTACT,
            CHANGE,
            CHANGE.removesuffix(" + most * left"),
            f"{REST} -k force_is_least",
        ),
        (
            "rest: friction always even",
            "simulation/stepping/rest.py",
            "even = p.static == p.kinetic",
            "even = True",
            f"{REST} -k 'crest or rounding'",
        ),
        (
            "rest: friction never even",
            "simulation/stepping/rest.py",
            "even = p.static == p.kinetic",
            "even = p.static != p.kinetic",
            f"{REST} -k 'crest or rounding'",
        ),
        (
            "rest: step of the search",
            "simulation/stepping/rest.py",
            "tau = min(tau + TURN / 64 / p.fastest, end)",
            "tau = min(tau + TURN / 64, end)",
            f"{REST} -k short_pulse",
        ),
        (
            "passing: second derivative",
            "simulation/exact/passing.py",
            BENDS,
            "way * f1 > 0",
            f"{REST} -k 'second_derivative or leaves_a_rigid'",
        ),
        (
            "passing: first derivative",
            "simulation/exact/passing.py",
            BENDS,
            "(f1 == 0.0 and way * f2 > 0)",
            f"{REST} -k 'limit or leaves_a_rigid'",
        ),
        (
            "passing: what is nothing",
            "simulation/exact/passing.py",
            "NOTHING = 4e-16",
            "NOTHING = 4e-10",
            f"{REST} -k gap_of_rounding",
        ),
        ("touching: third derivative", "simulation/exact/engine.py", FALLS, "falls = False", SOFT),
        (
            "control: chatter beyond what is smooth",
            "control/running/delays/_settling.py",
            CALM,
            CALM.replace("min(", "").replace(", smooth)", ""),
            f"{REST} -k 'under_control or ends_in_time'",
        ),
        (
            "control: chatter beyond the end",
            "control/running/delays/_settling.py",
            CALM,
            "calm = smooth",
            f"{REST} -k 'under_control or ends_in_time'",
        ),
        (
            "spectrum: ends of a band",
            "simulation/spectrum.py",
            "self.frequency >= low",
            "self.frequency > low",
            "tests/unit/test_spectrum.py -k power_of_a_band",
        ),
        (
            "strobing: impacts not compared",
            "dynamics/diagrams/settling/strobing.py",
            "alike &= strobes",
            "alike |= strobes",
            "tests/unit/test_diagrams.py -k closed_only",
        ),
        (
            "basins: Wilson's centre",
            "dynamics/diagrams/basins.py",
            "middle = share + z * z / (2 * of)",
            "middle = share + z * z / of",
            "tests/unit/test_basins.py -k wilson",
        ),
        (
            "stability: half a turn",
            "control/stability/stability.py",
            "(orbit.periods * 2 * math.pi)",
            "(orbit.periods * math.pi)",
            "tests/reference/test_control.py -k without_gain",
        ),
        (
            "ensembles: correlation time doubled",
            "stochastic/ensembles.py",
            "correlation_time=paths * span / (2 * effective)",
            "correlation_time=paths * span / effective",
            "tests/reference/test_stochastic.py -k correlation_time",
        ),
        (
            "resonance: one-sided density",
            "identify/resonance.py",
            "scale = 2 / (found.rate * found.count)",
            "scale = 1 / (found.rate * found.count)",
            "tests/unit/test_identify.py -k density",
        ),
        (
            "fit: p-value the other way",
            "fitting/_judging.py",
            "simulated >= measured",
            "simulated <= measured",
            "tests/unit/test_fitting_judging.py -k rank",
        ),
        (
            "fit: word told by its first impact",
            "fitting/trains/moments.py",
            "middle = words.first + partition.length // 2",
            "middle = words.first",
            f"{PARTS} -k middle",
        ),
        (
            "fit: share of the trains",
            "fitting/searching/narrow.py",
            "scatter = problem.share + len",
            "scatter = 1.0 + len",
            f"{PARTS} -k longer_train",
        ),
        (
            "fit: cloud stays",
            "fitting/searching/narrow.py",
            "cloud = cloud._replace(centre=estimate.psi)",
            "pass",
            f"{PARTS} -k cloud",
        ),
        (
            "fit: false impacts",
            "fitting/searching/search.py",
            "float(sifted.off[0]) / outside",
            "float(sifted.off[0])",
            f"{PARTS} -k false",
        ),
        (
            "store: code of this package",
            "studies/fingerprint.py",
            "parts[HOME] = own_code(frozenset(self.modules), frozenset(self.names))",
            "parts[HOME] = ''",
            "tests/unit/test_sweep_store.py -k 'source or package or code'",
        ),
        (
            "store: shape of an array",
            "studies/fingerprint.py",
            "{value.dtype.str} {value.shape}",
            "{value.dtype.str}",
            STORE,
        ),
        (
            "store: keyword defaults",
            "studies/fingerprint.py",
            "[value.__defaults__, value.__kwdefaults__, cells]",
            "[value.__defaults__, cells]",
            STORE,
        ),
        (
            "store: records of another study",
            "studies/_store.py",
            'not isinstance(record, dict) or record.get("study") != self.study',
            "not isinstance(record, dict)",
            "tests/unit/test_sweep_store.py -k 'study or another or record'",
        ),
        (
            "units: times of UFF as text",
            "io/instruments/uff.py",
            "base = time_base(times * header.factor, printed)",
            "base = time_base(times / header.factor, printed)",
            UNITS,
        ),
        (
            "units: times of binary UFF",
            "io/instruments/uff.py",
            "base = time_base(times * header.factor, float",
            "base = time_base(times, float",
            UNITS,
        ),
        (
            "units: step of UFF",
            "io/instruments/uff.py",
            "printed_step(header.step, start, header.factor)",
            "printed_step(header.step, start, 1.0)",
            UNITS,
        ),
        (
            "units: step of TDMS",
            "io/instruments/tdms.py",
            "rate_of_step(increment * factor)",
            "rate_of_step(increment)",
            UNITS,
        ),
        ("units: nanoseconds", "io/times/time_columns.py", '"ns": 1e-9', '"ns": 1e-6', UNITS),
        (
            "times: how far the rate is known",
            "io/times/timebase.py",
            "uncertainty = 2 * max(rounding / 2, deviation) / span",
            "uncertainty = 2 * max(rounding, deviation) / span",
            f"{UNITS} tests/unit/test_io_text.py -k rate",
        ),
        (
            "times: whole rates",
            "io/times/timebase.py",
            "abs(rate - whole) <= 4 * np.spacing(rate)",
            "abs(rate - whole) <= 4e9 * np.spacing(rate)",
            UNITS,
        ),
        (
            "LVM: one clock for all",
            "io/text/lvm.py",
            "not (shared and column.delta_x != first.delta_x)",
            "not (column.delta_x != first.delta_x)",
            "tests/unit/test_io_lvm.py -k x_column",
        ),
        (
            "UFF: direction of a node",
            "io/instruments/_uff_header.py",
            '-1: "-X"',
            '-1: "+X"',
            "tests/unit/test_io_uff.py -k direction",
        ),
        (
            "UFF: century",
            "io/instruments/_uff_header.py",
            "1900 if year >= 70",
            "1900 if year >= 60",
            "tests/unit/test_io_uff.py -k century",
        ),
        (
            "report: seconds printed as ms",
            "report/analysing/analysis.py",
            "mean_and_spread(impacts.contact_time * 1e3)",
            "mean_and_spread(impacts.contact_time)",
            "tests/unit/test_report.py -k contact_time",
        ),
        (
            "report: foretold in part",
            "report/findings.py",
            "found.explained > LARGELY",
            "found.explained < LARGELY",
            "tests/unit/test_report_dynamics.py -k in_part",
        ),
        (
            "report: jitter below a sample",
            "report/findings.py",
            "if jitter * analysis.rates[0] < 1:",
            "if jitter * analysis.rates[0] < 10:",
            "tests/unit/test_report_dynamics.py -k between_two_samples",
        ),
        (
            "exponents: no warning near 0",
            "reconstruct/divergence/exponents.py",
            'warnings.append("the exponent is not told apart from 0")',
            "pass",
            "tests/unit/test_exponents.py -k two_errors",
        ),
        (
            "pulses: two samples are clipped",
            "detect/pulses/edges.py",
            "if longest >= 3 else",
            "if longest >= 2 else",
            f"{PULSES} -k clipped",
        ),
        (
            "pulses: rise from the record's begin",
            "detect/pulses/pulse.py",
            "edges.contact, top + shift - edges.start",
            "edges.contact, top + shift",
            f"{PULSES} -k rise_time",
        ),
        (
            "pulses: contact beyond the record",
            "detect/pulses/pulse.py",
            "contact = min(contact, len(x) - 1 - start)",
            "contact = min(contact, len(x) - start)",
            f"{PULSES} -k outlasts",
        ),
        (
            "pulses: end of the contact",
            "detect/pulses/pulse.py",
            TOUCH,
            TOUCH.replace("last", "first + last"),
            "tests/unit/test_detect_pulses.py tests/unit/test_detect_force.py",
        ),
        (
            "pulses: half-way to a neighbour",
            "detect/pulses/_extent.py",
            "(place.before + place.peak) // 2 + 1 - place.lo",
            "(place.before + place.peak) // 2 - place.lo",
            f"{PULSES} -k 'half_way or between or crest'",
        ),
        (
            "merging: as far as given",
            "detect/_merge.py",
            'side="right"',
            'side="left"',
            "tests/unit/test_detect_merging.py",
        ),
        (
            "merging: flags",
            "detect/_merge.py",
            "np.bitwise_or.reduceat",
            "np.bitwise_and.reduceat",
            "tests/unit/test_detect_merging.py -k flags",
        ),
        (
            "period: silence",
            "intervals/period.py",
            "np.quantile(intervals, 0.9)",
            "np.quantile(intervals, 0.5)",
            "tests/unit/test_intervals_period.py -k silence",
        ),
        (
            "histogram: score of a width",
            "intervals/histogram.py",
            "(2 - (n + 1) / n**2 * squares)",
            "(2 - (n - 1) / n**2 * squares)",
            "tests/unit/test_intervals.py -k 'score or width'",
        ),
        (
            "slots: penalty",
            "intervals/phases/slots.py",
            "score -= (2 * len(centre) + 1.5) * np.log(n)",
            "score -= (2 * len(centre) + 0.5) * np.log(n)",
            "tests/unit/test_intervals_period.py -k penalty",
        ),
    )
)


def noticed(fault: Fault, tree: Path) -> list[str]:
    """Tests that fail with the fault in the tree."""
    path = tree / "impactsig" / fault.file
    right = path.read_text()
    if right.count(fault.line) != 1:
        raise SystemExit(f"{fault.name}: {fault.line!r} must stand once in {fault.file}")
    path.write_text(right.replace(fault.line, fault.wrong))
    command = f"{sys.executable} -m pytest -q -n 0 -p no:cacheprovider --tb=no -rfE {fault.tests}"
    paths = {**os.environ, "PYTHONPATH": str(tree)}
    try:
        done = subprocess.run(
            command, shell=True, cwd=tree, env=paths, capture_output=True, text=True, check=False
        )
    finally:
        path.write_text(right)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{fault.name}: {command}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return [line.split(" - ")[0] for line in done.stdout.splitlines() if line.startswith("FAILED")]


def main() -> None:
    """Put the faults in, and say which were noticed by what."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*", help="only faults whose names contain one of these")
    words = parser.parse_args().words
    chosen = [one for one in FAULTS if not words or any(word in one.name for word in words)]
    missed = []
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", ".venv"))
        for fault in chosen:
            failures = noticed(fault, tree)
            by = failures[0] if failures else "NOT NOTICED"
            print(f"{fault.name}: {len(failures)} {by}", flush=True)
            if not failures:
                missed.append(fault.name)
    print(f"{len(chosen) - len(missed)} of {len(chosen)} noticed")
    raise SystemExit(1 if missed else 0)


if __name__ == "__main__":
    main()
