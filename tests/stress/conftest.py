from __future__ import annotations

import pytest

from impactsig.simulation import run as _run

from ..browser import Browser


@pytest.fixture
def little_work(monkeypatch):
    """Ends sooner what creeps on a stiff stop, or bounces a thousand times in a period."""
    monkeypatch.setattr(_run, "LEGS_AT_LEAST", 10_000)
    monkeypatch.setattr(_run, "LEGS_PER_PERIOD", 1000)


@pytest.fixture(scope="module")
def browser():
    found = Browser()
    yield found
    found.driver.quit()
