"""identify_period where many impacts do not come: at random about a period, or by a pattern."""

import numpy as np
import pytest

from impactsig import Impacts, identify_period

T = 1 / 22.1
PHASES = {(1, 1): [0.0], (1, 2): [0.0], (2, 3): [0.0, 1.15]}


def instants(name, count):
    """Instants of an orbit [forcing periods]."""
    m, n = name
    return (n * np.arange(count // m)[:, None] + np.array(PHASES[name])).ravel()


def train(cycles, rng, jitter=0.01):
    time = T * (cycles + jitter * rng.standard_normal(len(cycles)))
    return Impacts.from_times(np.sort(time - time[0]))


@pytest.mark.parametrize("share", [0.3, 0.45, 0.6])
@pytest.mark.parametrize("name", PHASES)
def test_a_period_is_seen_where_impacts_are_left_out_at_random(name, share):
    rng = np.random.default_rng([19, *name, int(100 * share)])
    due = instants(name, int(250 / (1 - share)))
    found = identify_period(train(due[rng.random(len(due)) >= share], rng), T)
    assert found.kind == "periodic"
    assert (found.impacts, found.periods) == name
    # four standard deviations of the share drawn
    assert found.missed == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / len(due)))
    if share > 0.4:
        assert f"{found.missed:.0%} of the impacts due are left out at random" in str(found)


def test_a_period_is_seen_without_its_forcing_where_impacts_are_left_out_at_random():
    rng = np.random.default_rng(20)
    due = instants((1, 1), 500)
    found = identify_period(train(due[rng.random(len(due)) >= 0.45], rng))
    assert found.impacts == 1
    assert found.repeat_period == pytest.approx(T, rel=1e-4)


def tent(count, rng):
    """An orbit of the tent map, whose signs are those of a fair coin."""
    x = np.empty(count)
    x[0] = rng.uniform(-0.5, 0.5)
    for k in range(1, count):
        x[k] = 1 - 1.99999 * abs(x[k - 1])
    return x


@pytest.mark.parametrize("count", [60, 300])
def test_impacts_skipped_by_a_pattern_are_chaotic(count):
    """Intervals of one and of two periods, as the signs of a chaotic map say; 1 % of jitter.

    After one period come two.
    """
    for seed in range(2):
        rng = np.random.default_rng([count, seed])
        steps = np.where(tent(count, rng) > 0, 2, 1)
        for k in range(1, count):
            if steps[k - 1] == 1:
                steps[k] = 2
        found = identify_period(train(np.cumsum(steps).astype(float), rng), T)
        assert not found.recurs, str(found)


def test_impacts_skipped_by_what_the_one_before_foretells_are_chaotic():
    """Skips that are those of a fair coin, but for the phase of the impact before them."""
    rng = np.random.default_rng(21)
    x = tent(600, rng)
    came = np.append(True, x[:-1] < 0)
    cycles = np.arange(600) + 0.03 * x
    found = identify_period(train(cycles[came], rng, jitter=0.002), T)
    assert not found.recurs, str(found)


def test_a_gap_is_no_pattern():
    rng = np.random.default_rng(22)
    due = instants((1, 1), 400)
    came = due[(rng.random(400) >= 0.4) & ((due < 150) | (due >= 230))]
    time = T * (came + 0.01 * rng.standard_normal(len(came)))
    lost = T * np.array([[149.5, 229.5]])
    found = identify_period(Impacts(time - time[0], gaps=lost - time[0]), T)
    assert (found.impacts, found.periods) == (1, 1)
    assert found.missed == pytest.approx(0.4, abs=4 * np.sqrt(0.24 / 320))


def test_a_faint_pattern_of_skips_is_shared_between_a_period_and_chaos():
    """A third of the impacts that came in two periods in a row are taken out."""
    rng = np.random.default_rng(24)
    due = instants((1, 1), 500)
    came = rng.random(500) >= 0.5
    came[np.flatnonzero(came[:-1] & came[1:])[::3] + 1] = False
    found = identify_period(train(due[came], rng), T)
    assert sum(found.probability.values()) == pytest.approx(1)
    assert 0.01 < found.probability["chaotic"] < 0.99
