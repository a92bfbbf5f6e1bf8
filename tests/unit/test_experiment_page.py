"""What is drawn and written of an experiment."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib.colors import to_hex

from impactsig import Experiment, InvalidInput, bifurcation_diagram, cli, plot, scenes
from impactsig.report import analyse
from impactsig.report import experiment as page
from impactsig.report.batches import write_each_report

from .test_experiment import RIG, record


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    place = tmp_path_factory.mktemp("experiment")
    for value in (20.0, 21.0):
        record(place / "up" / f"{value:.1f}Hz.wav", value, 1 + (value < 20.5))
        record(place / "down" / f"{value:.1f}Hz.wav", value)
    (place / "up" / "23.0Hz.wav").write_bytes(b"RIFF <b>and no more")
    return Experiment.read(place, RIG, workers=1)


def test_every_impact_is_drawn_at_its_value(experiment, ax):
    experiment.plot("interval", ax)
    up, down = ax.lines
    assert (up.get_label(), down.get_label()) == ("up", "down")
    assert len(down.get_xdata()) == sum(len(experiment.impacts(k)) - 1 for k in (2, 3))
    at_21 = down.get_ydata()[down.get_xdata() == 21.0]
    np.testing.assert_allclose(at_21, 1 / 21, rtol=1e-3)
    assert ax.get_xlabel() == "frequency [Hz]"
    assert ax.get_ylabel() == "interval [ms]"


@pytest.mark.parametrize("observe", ["interval", "impacts_per_period"])
def test_branches_without_a_direction_have_colours_of_their_own(experiment, ax, observe):
    others = replace(experiment, branches=("dry", "dry", "oiled", "oiled"))
    others.plot(observe, ax)
    first, second = ax.lines
    assert (first.get_label(), second.get_label()) == ("dry", "oiled")
    assert len({to_hex(line.get_color()) for line in (first, second)}) == 2
    captions = [picture.caption for picture in page._pictures(others, ())]
    assert not any("strokes" in one for one in captions)
    assert any("strokes" in picture.caption for picture in page._pictures(experiment, ()))


def test_peaks_of_a_simulation_are_scaled_to_those_measured(experiment, ax):
    diagram = bifurcation_diagram(scenes.karpodinis, [20.8, 21.0], transient=200)
    experiment.plot("peak", ax, simulated=diagram)
    simulated = ax.lines[0]
    assert simulated.get_label() == "simulated"
    # One gain for all, with which the medians agree: 0.8 N is the peak of a single impact.
    ratio = simulated.get_ydata() / np.concatenate(diagram.velocity)
    np.testing.assert_allclose(ratio, ratio[0])
    assert np.median(simulated.get_ydata()) == pytest.approx(0.85, rel=0.1)


def test_the_motion_is_a_bar_for_each_branch(experiment, ax):
    diagram = bifurcation_diagram(scenes.karpodinis, [20.0, 21.0], transient=200)
    experiment.plot("period", ax, simulated=[diagram])
    assert [one.get_text() for one in ax.get_yticklabels()] == ["up", "down", "simulated"]
    spans = [(round(one.get_y() + 0.35), one.get_x(), one.get_width()) for one in ax.patches]
    # Upwards the motion changes at 20.5; downwards it does not.
    assert [(row, x) for row, x, _ in spans][:3] == [(0, 19.5), (0, 20.5), (1, 19.5)]
    assert spans[2][2] == 2.0
    assert to_hex(ax.patches[1].get_facecolor()) == to_hex(ax.patches[2].get_facecolor())


@pytest.mark.parametrize("observe", ["contact_time", "phase", "impulse", "time_in_contact"])
def test_the_other_quantities_are_drawn(experiment, ax, observe):
    assert experiment.plot(observe, ax) is ax
    assert all(np.isfinite(line.get_ydata()).all() for line in ax.lines)


def test_what_cannot_be_drawn_is_refused(experiment, ax):
    with pytest.raises(InvalidInput, match="observe"):
        experiment.plot("colour", ax)
    with pytest.raises(InvalidInput, match="dimension = true"):
        experiment.plot("dimension", ax)
    with pytest.raises(InvalidInput, match="simulated"):
        experiment.plot("peak", ax, simulated=[3])
    diagram = bifurcation_diagram(scenes.karpodinis, [26.0], transient=50)
    with pytest.raises(InvalidInput, match="counterpart"):
        plot.experiment(experiment, "interval", ax, simulated=diagram)


def test_the_page_names_jumps_runs_and_failures(experiment, tmp_path, monkeypatch):
    monkeypatch.setattr(page, "_pictures", lambda *_: [])  # drawing takes seconds
    written = experiment.write_report(tmp_path / "out", reports=False)
    text = written.read_text(encoding="utf-8")
    assert "up: period(2,1) to period(1,1) at 20.5 ± 0.29 Hz" in text.replace("\xa0", " ")
    assert text.count('<th scope="row"') == 4
    assert "23.0Hz.wav" in text
    assert "<b>" not in text
    assert (tmp_path / "out" / "jumps.csv").read_text(encoding="utf-8").count("\n") == 2
    assert (tmp_path / "out" / "runs.csv").read_text(encoding="utf-8").count("\n") == 5


def test_the_report_of_a_run_has_the_forcing_of_its_value(experiment):
    found = analyse(experiment.files[0], **page._options(experiment, 0))
    assert found.forcing_period == 1 / 20.0
    assert found.periodicity.name == "period(2,1)"


def test_only_reports_of_what_changed_are_written_again(tmp_path, monkeypatch):
    written = []

    def analysed(path, page, **options):
        written.append(path.name)
        page.write_text(f"{path.name} {options}", encoding="utf-8")
        return SimpleNamespace(summary=lambda: f"of {path.name}"), page

    monkeypatch.setattr("impactsig.report.page.analyse_to_page", analysed)
    monkeypatch.setattr("impactsig.report.cards.tiles", lambda _: [("Impacts", "3", "in 1 s")])
    files = [tmp_path / "a.wav", tmp_path / "b.wav"]
    out = tmp_path / "out"

    def write(runs, options=({}, {})):
        written.clear()
        entries = write_each_report(files, out, options, runs=runs, workers=1)
        assert [one.summary for one in entries] == ["of a.wav", "of b.wav"]
        assert all(one.figures == (("Impacts", "3", "in 1 s"),) for one in entries)
        return list(written)

    assert write(["1", "2"]) == ["a.wav", "b.wav"]
    assert write(["1", "2"]) == []
    assert write(["1", "3"]) == ["b.wav"]  # another recording, or other settings of the rig
    assert write(["1", "3"], ({"unit": "N"}, {})) == ["a.wav"]
    (out / "b.wav.html").write_text("changed by hand", encoding="utf-8")
    assert write(["1", "3"], ({"unit": "N"}, {})) == ["b.wav"]
    (out / "a.wav.html").unlink()
    assert write(["1", "3"], ({"unit": "N"}, {})) == ["a.wav"]
    (out / ".impactsig" / "a.wav.html.json").write_text("[", encoding="utf-8")
    assert write(["1", "3"], ({"unit": "N"}, {})) == ["a.wav"]
    monkeypatch.setattr("impactsig.report._drawn._package", lambda: "another version")
    assert write(["1", "3"], ({"unit": "N"}, {})) == ["a.wav", "b.wav"]
    assert write([]) == ["a.wav", "b.wav"]  # a batch without runs writes all


@pytest.mark.slow
def test_the_command_writes_a_page_that_links_the_reports(tmp_path, capsys):
    record(tmp_path / "up" / "20.0Hz.wav", 20.0)
    (tmp_path / "rig.toml").write_text(
        '[[channel]]\nnumber = 0\nsensor = "force"\n[parameter]\nname = "frequency"\nunit = "Hz"\n'
        "from = \"file name\"\npattern = '(?P<value>[0-9.]+)Hz'\n"
        '[forcing]\nfrequency = "parameter"\n',
        encoding="utf-8",
    )
    assert cli.main(["experiment", str(tmp_path), "-o", str(tmp_path / "out")]) == 0
    assert "Experiment(1 run; frequency 20 to 20 Hz)" in capsys.readouterr().out
    text = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert 'href="./recordings/20.0Hz.wav.html"' in text
    # Figures are there a second time, for narrow screens.
    assert text.count("<figure") == text.count('<source media="screen') > 0
    assert text.count("<img") == 7
    report = tmp_path / "out" / "recordings" / "20.0Hz.wav.html"
    assert "period(1,1)" in report.read_text(encoding="utf-8")
    assert cli.main(["experiment", str(tmp_path / "nowhere")]) == 1
