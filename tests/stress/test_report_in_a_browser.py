"""The report in headless Chromium: drawn whole, asks for nothing, runs nothing that a file says."""

from __future__ import annotations

import io

import numpy as np
import pytest
import soundfile
from matplotlib.image import imread

from impactsig import LoadCell, scenes, simulate, synthesize
from impactsig.report import write_report

from ..browser import MISSING, Browser

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(bool(MISSING), reason=f"no {', no '.join(MISSING)} here"),
]
PAYLOADS = (
    "<script>window.canary=1</script>",
    "</script><script>window.canary=1</script>",
    "</title></style><img src=x onerror=window.canary=1>",
    "\"'><svg onload=window.canary=1>",
    "$$\\href{javascript:window.canary=1}{x}$$<b>",
)


@pytest.fixture(scope="module")
def browser():
    found = Browser()
    yield found
    found.driver.quit()


@pytest.fixture
def page(browser, long_page):
    browser.emulate()
    browser.driver.set_window_size(1280, 1000)
    return browser.open(long_page)


@pytest.fixture(scope="module")
def long_page(tmp_path_factory):
    """3 million samples, 1326 impacts."""
    folder = tmp_path_factory.mktemp("long")
    motion = simulate(scenes.karpodinis(22.1), periods=1326, transient=100)
    cell = LoadCell(gain=0.6, noise=2e-3, unit="V")
    record = synthesize(motion.impacts, cell, rate=50_000, seed=1)
    assert len(record) >= 2_999_000
    soundfile.write(folder / "long.wav", np.asarray(record.samples, np.float32), 50_000, "FLOAT")
    return write_report(folder / "long.wav", folder / "page.html", forcing_period=1 / 22.1)


def test_a_long_record_is_drawn_whole_and_asks_for_nothing(browser, long_page, page):
    told, asked = page
    assert told == []
    assert asked == {long_page.as_uri()}
    assert long_page.stat().st_size < 3_000_000
    seen = imread(io.BytesIO(browser.driver.find_element("id", "waveform").screenshot_as_png))
    for colour, share in (((0x00, 0x72, 0xB2), 0.3), ((0xD5, 0x5E, 0x00), 0.005)):
        near = np.abs(255 * seen[:, :, :3] - colour).max(axis=2) < 40
        assert near.mean() > share


def test_every_picture_is_there_and_told_in_words(browser, page):
    images = browser.run("[...document.images].map(i => [i.naturalWidth, i.alt.length])")
    assert len(images) >= 8
    assert all(width > 0 and words > 10 for width, words in images)
    assert len(browser.run("document.querySelector('#waveform').getAttribute('aria-label')")) > 10
    assert browser.run("document.querySelectorAll('h1').length") == 1


def test_all_impacts_can_be_taken_away_as_csv(browser, page):
    link = "document.querySelector('a[download]')"
    assert browser.run(f"{link}.download") == "long-impacts.csv"
    lines = browser.run(f"atob({link}.href.split(',')[1])").splitlines()
    rows = [line for line in lines if not line.startswith("#")]
    assert rows[0].startswith("time")
    assert len(rows) == 1 + 1326


@pytest.mark.parametrize("width", [320, 420, 800])
def test_nothing_stands_out_of_a_narrow_page(width, browser, page):
    # A window has a least width; the screen of a telephone has not.
    screen = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    try:
        assert browser.run("innerWidth") == width
        assert browser.run("document.documentElement.scrollWidth") <= width
    finally:
        browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_dark_where_the_reader_has_it_dark(browser, page):
    def lightness(what):
        value = browser.run(f"getComputedStyle(document.body).{what}")
        return sum(int(part) for part in value[4:-1].split(",")) / 3

    assert lightness("backgroundColor") > 200 > 100 > lightness("color")
    browser.emulate(prefers_color_scheme="dark")
    assert lightness("backgroundColor") < 50 < 150 < lightness("color")


def test_on_paper_the_still_waveform_stands_in(browser, page):
    shown = "getComputedStyle(document.querySelector('figure.{}')).display != 'none'"
    assert browser.run(shown.format("interactive"))
    assert not browser.run(shown.format("still"))
    browser.emulate(media="print")
    assert not browser.run(shown.format("interactive"))
    assert browser.run(shown.format("still"))


def hostile(kind, payload, folder):
    """A record that says it wherever a file of its kind can; how it is to be read."""
    rng = np.random.default_rng(2)
    samples = rng.normal(0, 1e-3, 5000)
    samples[500::1000] += 1.0
    name = payload[:100].replace("/", "\N{DIVISION SLASH}")
    if kind == "wav":
        path = folder / f"{name}.wav"
        with soundfile.SoundFile(path, "w", 5000, 1, "PCM_24") as file:
            for tag in ("title", "artist", "comment", "software", "album", "copyright"):
                setattr(file, tag, payload)
            file.write(samples / 2)
        return path, {}
    if kind == "tdms":
        from nptdms import ChannelObject, RootObject, TdmsWriter

        path = folder / "a.tdms"
        said = {"NI_ChannelName": payload, "unit_string": payload, payload: payload}
        channel = ChannelObject(payload, payload, samples, {"wf_increment": 2e-4, **said})
        with TdmsWriter(path) as writer:
            writer.write_segment([RootObject({"Author": payload, "name": payload}), channel])
        return path, {}
    path = folder / f"{name}.csv"
    quoted = payload.replace('"', '""')
    path.write_text(f'"time [s]","{quoted} [{payload[:20]}]"\n')
    with path.open("a") as file:
        np.savetxt(file, np.column_stack([np.arange(5000) / 5000, samples]), "%.9g", ",")
    return path, {"unit": payload}


@pytest.mark.parametrize("kind", ["wav", "tdms", "csv"])
def test_what_a_file_says_is_never_run(kind, browser, tmp_path):
    path, options = hostile(kind, " ".join(PAYLOADS), tmp_path)
    page = write_report(path, tmp_path / "page.html", **options)
    told, asked = browser.open(page)
    assert browser.run("window.canary === undefined")
    assert asked == {page.as_uri()}
    assert told == []


def test_the_canary_would_be_heard(browser, tmp_path):
    """What the test above looks for does happen on a page that lets it."""
    page = tmp_path / "page.html"
    for payload in PAYLOADS[:4]:
        page.write_text(f"<!doctype html><title></title><p title='{payload}'>{payload}</p>")
        browser.driver.get(page.as_uri())
        browser.driver.execute_async_script("setTimeout(arguments[0], 200)")
        assert browser.run("window.canary === 1"), payload
