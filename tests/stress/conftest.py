from __future__ import annotations

import pytest

from ..browser import Browser


@pytest.fixture(scope="module")
def browser():
    found = Browser()
    yield found
    found.driver.quit()
