"""The pages that list recordings in headless Chromium, on a desk and on a telephone."""

from __future__ import annotations

import base64
import importlib.util
import io

import pytest
from matplotlib.image import imread

from impactsig import Experiment
from impactsig.report import write_reports

from ..browser import MISSING
from ..drawing import leave_out_figures
from ..unit.test_experiment import RIG, record

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(bool(MISSING), reason=f"no {', no '.join(MISSING)} here"),
]
LONG = "second_beam_repeated_after_the_calibration_of_the_load_cell_2024-05-17T14-22-31"
SCHEMES = ("light", "dark")
PUSHED = "[...document.querySelectorAll('{}')].filter(e => e.scrollWidth > e.clientWidth).length"
# How much of a table's first column is covered by what is not of it, pushed along to the end.
COVERED = """
(box => {
  box.scrollIntoView();
  box.scrollLeft = 1e4;
  const edge = box.getBoundingClientRect().left;
  return [...box.querySelectorAll('th.words')].filter(
    cell => Math.abs(cell.getBoundingClientRect().left - edge) > 2).length;
})(document.querySelector('.scroll'))
"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The page of an experiment and that of a batch, of names long and short, one file broken."""
    place = tmp_path_factory.mktemp("pages")
    for value in (20.0, 21.0):
        record(place / "up" / f"{value:.1f}Hz.wav", value, 1 + (value < 20.5))
        record(place / "down" / f"{value:.1f}Hz.wav", value)
    record(place / "up" / f"22.0Hz_{LONG}.wav", 22.0)
    (place / "up" / "23.0Hz.wav").write_bytes(b"RIFF and no more")
    runs = Experiment.read(place, RIG, workers=1, progress=False)
    files = sorted(place.glob("up/*.wav"))[1:]
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)  # of recordings, whose pages are not opened
        first = runs.write_report(place / "experiment", workers=1, progress=False)
        write_reports(files, place / "batch", workers=1, progress=False, unit="N", sensor="force")
    return {"experiment": first, "batch": place / "batch" / "index.html"}


@pytest.fixture(params=["experiment", "batch"])
def page(request, pages):
    return pages[request.param]


def opened(browser, page, width, scheme="light"):
    """The page as a screen of that width shows it."""
    browser.emulate(prefers_color_scheme=scheme)
    screen = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    assert browser.open(page)[0] == []
    assert browser.run("innerWidth") == width


def test_every_run_has_its_report(pages):
    text = pages["experiment"].read_text(encoding="utf-8")
    assert text.count('<a href="./recordings/') == 5
    assert "no report" not in text


def test_nothing_is_cut_on_a_desk(browser, page):
    opened(browser, page, 1400)
    assert browser.run(PUSHED.format("html, .scroll, figure, dl, td, th")) == 0


def test_a_telephone_pushes_nothing_but_a_table_and_its_rows_keep_their_names(browser, page):
    opened(browser, page, 420)
    assert browser.run("document.documentElement.scrollWidth") <= 420
    assert browser.run(PUSHED.format("figure, dl, p, li")) == 0
    assert browser.run(PUSHED.format(".scroll")) == 1
    assert browser.run(COVERED.strip()) == 0


def test_a_telephone_is_shown_figures_drawn_for_it(browser, pages):
    opened(browser, pages["experiment"], 420)
    images = browser.run("[...document.images].map(i => [i.naturalWidth, i.clientWidth])")
    assert len(images) >= 6
    # Drawn 3.9 inches wide, a letter of 9.5 points has 12 pixels.
    assert all(own / shown < 0.85 * 4 / 3 for own, shown in images)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("width", [420, 1400])
def test_axe_finds_no_violation(browser, page, width, scheme):
    if not importlib.util.find_spec("axe_core_python"):
        pytest.skip('pip install "impactsig[test]"')
    from axe_core_python.selenium import Axe

    opened(browser, page, width, scheme)
    found = Axe().run(browser.driver)
    assert [(one["id"], one["nodes"][0]["html"]) for one in found["violations"]] == []


@pytest.mark.parametrize("scheme", SCHEMES)
def test_no_branch_hides_the_other(browser, pages, scheme):
    """Both have the same interval at 21 Hz: a stroke of either colour is seen."""
    opened(browser, pages["experiment"], 1400, scheme)
    figure = "document.querySelectorAll('figure')[1]"
    browser.run(f"{figure}.scrollIntoView()")
    box = browser.run(f"(b => [b.x, b.y, b.width, b.height])({figure}.getBoundingClientRect())")
    clip = dict(zip(("x", "y", "width", "height"), box, strict=True)) | {"scale": 1}
    clip["y"] += browser.run("scrollY")
    shot = browser.driver.execute_cdp_cmd("Page.captureScreenshot", {"clip": clip})["data"]
    seen = imread(io.BytesIO(base64.b64decode(shot)))[60:, :, :3]
    blue = seen[:, :, 2] - seen[:, :, 0] > 0.25
    red = seen[:, :, 0] - seen[:, :, 2] > 0.25
    assert blue.sum() > 20 < red.sum()
