"""The dynamics of a report: every part told or its absence explained, none taking another along."""

import html
import re
import shlex
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impactsig
from impactsig import Impacts, ImpactsigWarning, cli, identify_period
from impactsig.report import Dynamics, analyse, write_page
from impactsig.report.analysing import dynamics as dynamics_module
from impactsig.report.analysing.dynamics import SEED, exponent_of, read_dynamics
from impactsig.report.cards import tiles
from impactsig.report.contents import parameters
from impactsig.report.findings import care, findings, verdict

SAMPLES = Path(__file__).resolve().parents[2] / "data_samples"
CHAOTIC = SAMPLES / "loadcell_chaotic_20.1Hz.wav"
PERIODIC = SAMPLES / "loadcell_periodic_22.1Hz.wav"


def train(values):
    """Impacts 40 to 60 ms apart, by values from 0 to 1."""
    values = np.asarray(values, float)
    return Impacts.from_times(np.cumsum([0.0, *(0.04 + 0.02 * values)]))


def logistic(count):
    x = [0.4]
    for _ in range(count - 1):
        x.append(4 * x[-1] * (1 - x[-1]))
    return np.array(x)


def read(impacts, asked=True, frequency=None):
    period = None if frequency is None else 1 / frequency
    return read_dynamics(impacts, identify_period(impacts, period), frequency, asked)


@pytest.fixture(scope="module")
def periodic():
    return analyse(PERIODIC, sensor="force", unit="V", forcing_period=1 / 22.1, dynamics=True)


@pytest.fixture(scope="module")
def chaotic():
    return analyse(CHAOTIC, sensor="force", unit="V", forcing_period=1 / 20.1, dynamics=True)


@pytest.fixture(scope="module")
def page(chaotic, tmp_path_factory):
    path = write_page(chaotic, tmp_path_factory.mktemp("page") / "page.html")
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def unasked(chaotic):
    return of(chaotic, chaotic.impacts, asked=False)


@pytest.fixture(scope="module")
def noise(chaotic):
    return of(chaotic, train(np.random.default_rng(0).uniform(size=300)))


def of(analysis, impacts, asked=True, frequency=None):
    """That analysis, had these impacts been found in it."""
    forced = None if frequency is None else 1 / frequency
    period = identify_period(impacts, forced)
    return replace(
        analysis,
        impacts=impacts,
        periodicity=period,
        dynamics=read_dynamics(impacts, period, forced, asked),
        forcing_period=forced,
    )


def told(analysis):
    return {one.title: " ".join(one.words) for one in findings(analysis)}


# -- what is worked out ----------------------------------------------------------------------


def test_what_is_told_is_what_the_library_finds(chaotic):
    found, impacts = chaotic.dynamics, chaotic.impacts
    dimension = impactsig.correlation_dimension(impacts)
    assert found.dimension.slope == dimension.slope
    assert found.dimension.describe() == dimension.describe()
    assert found.surrogates.p_value == impactsig.surrogate_test(impacts, seed=SEED).p_value
    exponent = impactsig.lyapunov_exponent(impacts, dimension=found.exponent.dimension)
    assert found.exponent.exponent == exponent.exponent
    assert found.without == {}


def test_the_logistic_map_has_dimension_1_exponent_ln_2_and_is_called_chaos():
    found = read(train(logistic(700)))
    low, high = found.dimension.interval
    assert low < 1 < high
    assert found.exponent.exponent == pytest.approx(np.log(2), abs=0.05)
    assert found.chaotic
    assert found.describe().startswith("low-dimensional chaos by all three signs")
    impacts, seconds = re.search(
        r"factor e in (\S+) impacts \((\S+) s\)", found.describe()
    ).groups()
    assert float(impacts) == pytest.approx(1 / np.log(2), abs=0.1)
    assert float(seconds) == pytest.approx(0.05 / np.log(2), abs=0.005)


def test_noise_is_not_called_chaos(noise):
    found = noise.dynamics
    assert not found.chaotic
    assert found.describe().startswith("nothing tells these 300 intervals from linear noise; trust")


def test_a_quasi_periodic_train_is_not_called_chaos():
    found = read(train(0.5 + 0.5 * np.sin(2 * np.pi * np.sqrt(2) * np.arange(500))))
    assert not found.chaotic
    assert not dynamics_module.grows(found.exponent)


def test_what_takes_seconds_is_not_done_unasked(monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("nobody asked for this")

    for name in ("correlation_dimension", "surrogate_test", "lyapunov_exponent"):
        home = sys.modules[getattr(impactsig, name).__module__]
        monkeypatch.setattr(home, name, refuse)
    found = read(train(logistic(300)), asked=False)
    assert found.left_out
    assert found.without == {}
    assert found.dimension is found.exponent is found.surrogates is found.determinism is None


@pytest.mark.parametrize("asked", [False, True])
def test_a_periodic_train_has_dimension_0_and_nothing_is_fitted(asked):
    jitter = 1e-5 * np.random.default_rng(0).standard_normal(201)
    found = read(Impacts.from_times(0.05 * np.arange(201) + jitter), asked)
    assert (found.dimension.verdict, found.dimension.dimension) == ("periodic", 0.0)
    assert found.dimension.slope is found.exponent is found.surrogates is None
    assert not found.left_out
    assert re.fullmatch(
        r"the intervals recur to within (9|10|11)\S* µs: dimension 0, nothing fitted",
        found.describe(),
    )


@pytest.mark.parametrize("count", [0, 1, 2, 3, 10, 30])
def test_too_few_intervals_say_what_it_takes(count, chaotic):
    impacts = train(logistic(100)[:count])[: count + bool(count)]
    result = of(chaotic, impacts)
    found = result.dynamics
    assert found.dimension is found.exponent is None
    assert set(found.without) >= {"dimension", "exponent"}
    words = told(result)["Dimension"]
    assert words.startswith(f"No dimension: it got {found.intervals} intervals and needs at least ")
    assert verdict(result)
    list(parameters(result))


@pytest.mark.usefixtures("without_figures")
def test_one_failing_part_takes_no_other_with_it(monkeypatch, chaotic, tmp_path):
    def fail(*_, **__):
        raise ZeroDivisionError("at the worst moment")

    monkeypatch.setattr("impactsig.reconstruct.divergence.exponents.lyapunov_exponent", fail)
    with pytest.warns(ImpactsigWarning, match="exponent: it failed with ZeroDivisionError"):
        result = of(chaotic, chaotic.impacts)
    found = result.dynamics
    assert (found.exponent, found.false_share) == (None, None)
    assert found.dimension.slope == chaotic.dynamics.dimension.slope
    assert found.surrogates.p_value == chaotic.dynamics.surrogates.p_value
    written = write_page(result, tmp_path / "page.html").read_text(encoding="utf-8")
    assert "No exponent: it failed with ZeroDivisionError: at the worst moment." in written


@pytest.mark.usefixtures("without_figures")
def test_long_trains_are_read_from_their_first_intervals_and_say_so(monkeypatch, chaotic):
    from impactsig.report import findings as findings_module
    from impactsig.report import fitted

    for module in (dynamics_module, fitted):
        monkeypatch.setattr(module, "READ", 200)
    for module in (dynamics_module, findings_module, fitted):
        monkeypatch.setattr(module, "TESTED", 100)
    values = logistic(400)
    result, start = of(chaotic, train(values)), train(values[:200])
    assert result.dynamics.dimension.slope == impactsig.correlation_dimension(start).slope
    assert result.dynamics.surrogates.count <= 100
    words = told(result)
    assert "of the first 200 of 400 intervals" in words["Dimension"]
    assert "of the first 100 of 400 intervals" in words["More than noise?"]


@pytest.mark.parametrize(("values", "least"), [(logistic(600), 1), ("henon", 2)])
def test_the_exponent_has_the_least_embedding_without_false_neighbours(values, least):
    if isinstance(values, str):
        x, y = [0.1], 0.1
        for _ in range(600):
            x.append(1 - 1.4 * x[-1] ** 2 + y)
            y = 0.3 * x[-2]
        values = (np.array(x[1:]) + 1.3) / 2.6
    found, share = exponent_of(train(values))
    assert found.dimension == least
    assert share < 0.02


def test_missed_impacts_do_not_hide_the_exponent():
    # The false neighbours they leave would ask for ever more coordinates.
    whole = train(logistic(1500))
    kept = np.random.default_rng(1).uniform(size=len(whole)) > 0.02
    found, share = exponent_of(Impacts.from_times(whole.time[kept]))
    assert found.dimension <= 2
    assert share < 0.1
    assert dynamics_module.grows(found)


# -- how it is said --------------------------------------------------------------------------


@pytest.mark.usefixtures("without_figures")
def test_a_chaotic_recording_in_words(chaotic):
    words = told(chaotic)
    assert list(words) == ["Delay plot", "Dimension", "Lyapunov exponent", "More than noise?"]
    slope = chaotic.dynamics.dimension.slope
    assert f"grows with a slope of {slope.value:.2f}, 95 % interval " in words["Dimension"]
    assert "µs" in words["Dimension"]
    assert words["Lyapunov exponent"].startswith("Largest Lyapunov exponent 0.")
    assert words["More than noise?"].startswith("Yes: ")
    assert verdict(chaotic).endswith("(roughly: few intervals).")
    assert "No impact is clearly missed or spurious" in care(chaotic)[0]


def test_every_sentence_ends(chaotic, periodic, noise, unasked):
    for result in (chaotic, periodic, noise, unasked):
        sentences = [text for one in findings(result) for text in one.words]
        for text in (*sentences, *care(result), verdict(result) or "."):
            assert text.endswith(".")
            assert not re.search(r"\.\.|nan|None|  ", text)


def test_a_periodic_recording_in_words(periodic):
    words = told(periodic)
    assert list(words) == ["Delay plot", "Dimension"]
    assert "recurs after 1 impact appears as 1 point" in words["Delay plot"]
    recurs = r"The motion recurs \(period\(1,1\): 1 impact per forcing period\) to within (.*) µs"
    found = re.match(f"{recurs}: its dimension is 0", words["Dimension"])
    # The sample's impacts are exactly periodic: what is left is the error of their instants.
    assert 0 < float(found[1]) < 1.1
    assert "less than the time between two samples" in words["Dimension"]
    assert care(periodic) == []
    assert ("dimension", "0", "the intervals recur") in tiles(periodic)


@pytest.mark.usefixtures("without_figures")
@pytest.mark.parametrize("second", [0.0, 0.015])
def test_a_narrow_band_of_chaos_about_a_period_is_told_from_jitter(second, periodic):
    due = 0.05 * np.arange(500) + np.where(np.arange(500) % 2, second, 0.0)
    frequency = 10.0 if second else 20.0
    banded = of(periodic, Impacts.from_times(due + 1e-3 * logistic(500)), frequency=frequency)
    assert banded.periodicity.kind == "banded"
    assert not banded.dynamics.periodic
    late = np.random.default_rng(0).uniform(size=500)
    noisy = of(periodic, Impacts.from_times(due + 1e-3 * late), frequency=frequency)
    assert noisy.dynamics.periodic
    assert "deviations of successive impacts are unrelated" in told(noisy)["Dimension"]


@pytest.mark.usefixtures("without_figures")
@pytest.mark.parametrize(
    ("samples", "nothing"), [(0.3, True), (0.7, True), (1.5, False), (4.0, False)]
)
def test_a_jitter_below_the_time_between_two_samples_tells_nothing(samples, nothing, periodic):
    late = samples / periodic.rates[0] * np.random.default_rng(0).standard_normal(400)
    impacts = Impacts.from_times(1.0 + 0.05 * np.arange(400) + late)
    result = of(periodic, impacts, asked=False, frequency=20.0)
    # Known to 4 % from 400.
    assert result.periodicity.jitter * periodic.rates[0] == pytest.approx(samples, rel=0.15)
    words = told(result)["Dimension"]
    assert ("less than the time between two samples" in words) == nothing
    assert ("timing noise, or a small motion" in words) != nothing


@pytest.mark.usefixtures("without_figures")
@pytest.mark.parametrize(("spread", "part"), [(0.0, ""), (0.1, " in part")])
def test_an_interval_predicts_the_next_wholly_or_in_part(spread, part, chaotic):
    values = logistic(600) + spread * np.random.default_rng(0).standard_normal(600)
    result = of(chaotic, train(values), asked=False)
    determinism = impactsig.return_map_determinism(result.impacts, seed=1)
    result = replace(result, dynamics=replace(result.dynamics, determinism=determinism))
    share = determinism.explained
    assert (0.2 < share < 0.75) if part else (share > 0.95)
    words = told(result)["Delay plot"]
    assert f"the next impact can{part} be predicted from the last interval" in words
    assert f"explains {100 * share:.0f} % of the variance" in words


def test_deviations_are_those_that_were_put_in():
    late = 1e-4 * np.random.default_rng(0).standard_normal(600)
    due = 3.0 + 0.07 * (np.arange(600) // 3) + np.tile([0.0, 0.01, 0.04], 200)
    found = dynamics_module.deviations(due + late, 3)
    # A line and two more offsets are fitted: four numbers of 600.
    assert np.std(found - late) < 2e-5
    np.testing.assert_allclose(dynamics_module.deviations(due, 3), 0, atol=1e-12)


@pytest.mark.usefixtures("without_figures")
def test_noise_in_words(noise):
    words = told(noise)
    assert words["Dimension"] == "No dimension: nothing tells the series from linear noise."
    assert words["More than noise?"].startswith("No sign of it: ")
    assert words["Delay plot"] == (
        "An interval explains no more of the variance of the next one than in random order."
    )


@pytest.mark.usefixtures("without_figures")
def test_what_was_left_out_says_how_to_ask_for_it(unasked):
    words = told(unasked)
    assert list(words) == ["Delay plot", "Left out"]
    assert "--dynamics" in words["Left out"]
    assert "there are 115" in words["Left out"]


def test_missed_impacts_are_spoken_of_where_the_forcing_is_known(periodic):
    kept = np.delete(np.arange(200), [50, 120])
    impacts = Impacts.from_times(0.05 * kept + 1e-5 * np.sin(7.0 * kept))
    sentence = care(of(periodic, impacts, frequency=20.0))[0]
    assert "seems to lack 2 impacts, which" in sentence
    assert "impactsig.repair_intervals" in sentence
    assert care(of(periodic, impacts)) == []


def test_without_a_forcing_period_no_impact_is_checked(chaotic):
    unknown = replace(chaotic.dynamics, repair=None)
    asked = replace(chaotic, forcing_period=None, dynamics=unknown)
    assert "requires the forcing frequency" in care(asked)[0]


# -- the page and the command ----------------------------------------------------------------


def test_the_page_shows_every_part_with_words_before_its_figure(page):
    section = re.search(r"<h2>Dynamics</h2>(.*?)</section>", page, re.S)[1]
    parts = re.findall(r"<article.*?</article>", section, re.S)
    assert len(parts) == 4
    for part in parts:
        assert part.index("<p>") < part.index("<img")
        assert re.search(r'alt="[^"]{30,}"', part)


def test_the_numbers_stand_among_the_key_figures(chaotic):
    shown = {name: value for name, value, _ in tiles(chaotic)}
    found = chaotic.dynamics.dimension
    shown_as = "slope between two scales" if found.dimension is None else "dimension"
    assert shown[shown_as] == f"{found.slope.value:.2f}"
    assert shown["Lyapunov exponent"] == f"{chaotic.dynamics.exponent.exponent:.3g} per impact"
    assert dict(dict(parameters(chaotic))["Dynamics"])["seed"] == str(SEED)


def test_the_lines_shown_do_it_again(page, chaotic):
    command, python = (
        html.unescape(code) for code in re.findall(r"<code>(.*?)</code>", page, re.S)
    )
    assert "--dynamics" in shlex.split(command)
    names = {}
    *before, dimension, exponent, test = python.splitlines()
    exec("\n".join(before), names)
    found = chaotic.dynamics
    assert eval(dimension, names).slope == found.dimension.slope
    assert eval(exponent, names).exponent == found.exponent.exponent
    assert eval(test, names).p_value == found.surrogates.p_value


def test_two_runs_find_the_same(chaotic):
    again = read_dynamics(chaotic.impacts, chaotic.periodicity, None, True)
    assert again.describe() == chaotic.dynamics.describe()
    assert again.dimension.slope == chaotic.dynamics.dimension.slope
    assert isinstance(again, Dynamics)


@pytest.mark.usefixtures("without_figures")
def test_the_command_adds_a_line_where_it_is_asked(tmp_path, capsys):
    words = ["report", str(PERIODIC), "--sensor=force", "-o", str(tmp_path / "a.html")]
    assert cli.main([*words, "--dynamics"]) == 0
    _, line, where = capsys.readouterr().out.splitlines()
    assert re.match("dynamics: the intervals recur to within .* dimension 0, nothing fitted", line)
    assert where.startswith("report: ")
