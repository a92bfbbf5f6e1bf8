"""The report in headless Chromium: drawn whole, linked, asks for nothing, runs no foreign text."""

from __future__ import annotations

import base64
import importlib.util
import io
import re

import numpy as np
import pytest
import soundfile
from matplotlib.image import imread

from impactsig import Impacts, LoadCell, scenes, simulate, synthesize
from impactsig.report import Entry, analyse, write_page, write_report
from impactsig.report.batches import _index

from ..browser import MISSING

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
    drawn = "[...document.querySelectorAll('.drawing')].map(d => [d.role, d.ariaLabel.length])"
    assert all(role == "img" and words > 10 for role, words in browser.run(drawn))
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


def test_a_telephone_pushes_no_drawing_along(browser, page):
    """Those of one drawing are there a second time, drawn for a narrow screen."""
    pushed = "[...document.querySelectorAll('figure')].filter(f => f.scrollWidth > f.clientWidth)"
    screen = {"width": 420, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    try:
        assert browser.run(f"{pushed}.length") == 0
        assert browser.run("document.querySelectorAll('.wide picture img').length") == 2
        reach = "img => img.currentSrc == img.parentElement.querySelector('source').srcset"
        assert browser.run(f"[...document.querySelectorAll('.wide picture img')].every({reach})")
        if importlib.util.find_spec("axe_core_python"):
            from axe_core_python.selenium import Axe

            found = Axe().run(browser.driver)
            assert [(one["id"], one["nodes"][0]["html"]) for one in found["violations"]] == []
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


def corner(browser, element):
    """Where the plotting area of a chart begins on the screen, in view."""
    browser.run(f"{element}.scrollIntoView({{block: 'center'}})")
    box = browser.run(f"(b => [b.left, b.top])({element}.chart.over.getBoundingClientRect())")
    return np.array(box)


def click(browser, x, y):
    for kind in ("mousePressed", "mouseReleased"):
        browser.mouse(kind, x, y)


WAVEFORM = "document.querySelector('#waveform .drawing')"
SEEN = f"[{WAVEFORM}.chart.scales.x.min, {WAVEFORM}.chart.scales.x.max]"
CHOSEN = "document.querySelector('tr[aria-current]')?.querySelector('button').textContent"


def test_a_row_leads_to_the_pulse_by_its_samples_and_to_the_return_map(browser, long_page, page):
    """The 0.3 ms of contact hold 15 samples, each drawn where the recording has it."""
    samples, rate = soundfile.read(long_page.parent / "long.wav")
    row = "document.querySelector('tbody.live tr[data-impact=\"6\"]')"
    browser.run(f"{row}.click()")
    start, stop = browser.run(SEEN)
    assert stop - start < 2.5e-3
    held = browser.run(
        f"(([x, , y], [a, b]) => x.map((t, i) => [t, y[i]]).filter(([t, v]) => t >= a && t <= b))"
        f"({WAVEFORM}.chart.data, {SEEN})"
    )
    time, drawn = np.array(held, float).T
    first = round(time[0] * rate)
    np.testing.assert_allclose(time, (first + np.arange(len(time))) / rate, atol=1e-9)
    np.testing.assert_allclose(drawn, samples[first : first + len(time)], atol=1e-5)
    assert np.count_nonzero(drawn > 0.01) >= 14
    # and they are seen: a dot of the line's colour at each
    left, top = corner(browser, WAVEFORM)
    places = browser.run(
        f"{held}.map(([t, v]) => [{WAVEFORM}.chart.valToPos(t, 'x'),"
        f" {WAVEFORM}.chart.valToPos(v, 'y')])"
    )
    screen = imread(io.BytesIO(browser.driver.get_screenshot_as_png()))[:, :, :3] * 255
    for x, y in places[2:-2]:
        near = screen[round(top + y) - 1 : round(top + y) + 2, round(left + x)]
        assert (np.abs(near - (0x00, 0x72, 0xB2)).max(axis=1) < 60).any()
    # the return map rings the same impact, and a click there leads back to the waveform
    chart = "document.getElementById('return-map').chart"
    left, top = corner(browser, "document.getElementById('return-map')")
    x, y = browser.run(
        f"(u => [u.valToPos(1e3 * {{0}}, 'x'), u.valToPos(1e3 * {{1}}, 'y')])({chart})".format(
            *np.diff(_times(browser)[99:102])
        )
    )
    click(browser, left + x, top + y)
    number = int(browser.run(CHOSEN))
    assert f"Impact {number}:" in browser.run("document.getElementById('chosen').textContent")
    start, stop = browser.run(SEEN)
    assert start < _times(browser)[number - 1] < stop
    pair = np.diff(_times(browser)[number - 2 : number + 1])
    np.testing.assert_allclose(pair, np.diff(_times(browser)[99:102]), atol=1e-6)


def _times(browser):
    """All times of impacts, from the table to take away."""
    text = browser.run("atob(document.querySelector('a[download]').href.split(',')[1])")
    lines = [line for line in text.splitlines() if line[:1].isdigit()]
    return np.array([float(line.split(",")[0]) for line in lines])


def test_a_click_in_waveform_or_intervals_chooses_the_impact(browser, page):
    times = _times(browser)
    left, top = corner(browser, WAVEFORM)
    browser.run(f"{WAVEFORM}.chart.setSelect({{left: 0, width: 8, top: 0, height: 9}})")
    x = browser.run(f"{WAVEFORM}.chart.valToPos({times[3]}, 'x')")
    click(browser, left + x, top + 20)
    assert int(browser.run(CHOSEN)) == 4
    left, top = corner(browser, "document.getElementById('intervals')")
    chart = "document.getElementById('intervals').chart"
    x, y = browser.run(f"(u => [u.valToPos({times[700]}, 'x'), u.valToPos(45.2, 'y')])({chart})")
    click(browser, left + x, top + y)
    assert abs(int(browser.run(CHOSEN)) - 701) <= 2  # two impacts share a pixel


def test_a_drag_and_the_wheel_zoom_in_time(browser, page):
    whole = np.array(browser.run(SEEN))
    left, top = corner(browser, WAVEFORM)
    ends = [browser.run(f"{WAVEFORM}.chart.posToVal({x}, 'x')") for x in (200, 400)]
    browser.mouse("mousePressed", left + 200, top + 50)
    browser.mouse("mouseMoved", left + 300, top + 60)
    browser.mouse("mouseMoved", left + 400, top + 60)
    browser.mouse("mouseReleased", left + 400, top + 60)
    np.testing.assert_allclose(browser.run(SEEN), ends, rtol=0.02)
    # a turn of the wheel holds the time under it
    under = browser.run(f"{WAVEFORM}.chart.posToVal(300, 'x')")
    browser.mouse("mouseWheel", left + 300, top + 60, deltaX=0, deltaY=-100)
    near = np.array(browser.run(SEEN))
    assert np.diff(near) == pytest.approx(0.8 * np.diff(ends), rel=0.03)
    assert browser.run(f"{WAVEFORM}.chart.posToVal(300, 'x')") == pytest.approx(under, rel=0.01)
    browser.run("document.querySelector('[data-do=whole]').click()")
    np.testing.assert_allclose(browser.run(SEEN), whole)


def test_the_return_map_zooms_by_drag_and_wheel(browser, page):
    place = "document.getElementById('return-map')"
    scales = "['x', 'y'].map(s => [{0}.scales[s].min, {0}.scales[s].max])".format(f"{place}.chart")
    whole, seen = np.array(browser.run(scales)), browser.run(SEEN)
    left, top = corner(browser, place)
    (low, high), (bottom, upper) = (
        [browser.run(f"{place}.chart.posToVal({at}, '{axis}')") for at in ends]
        for axis, ends in (("x", (100, 200)), ("y", (150, 60)))
    )
    browser.mouse("mousePressed", left + 100, top + 60)
    browser.mouse("mouseMoved", left + 150, top + 100)
    browser.mouse("mouseMoved", left + 200, top + 150)
    browser.mouse("mouseReleased", left + 200, top + 150)
    near, pixel = np.array(browser.run(scales)), np.diff(whole) / 100
    assert np.all(np.abs(near - [[low, high], [bottom, upper]]) < pixel)
    under = browser.run(f"['x', 'y'].map(s => {place}.chart.posToVal(80, s))")
    browser.mouse("mouseWheel", left + 80, top + 80, deltaX=0, deltaY=-100)
    nearer = np.array(browser.run(scales))
    np.testing.assert_allclose(np.diff(nearer), 0.8 * np.diff(near), rtol=1e-6)
    held = browser.run(f"['x', 'y'].map(s => {place}.chart.posToVal(80, s))")
    assert np.all(np.abs(np.subtract(held, under)) < pixel[:, 0])
    np.testing.assert_array_equal(browser.run(SEEN), seen)  # time stays as it was
    browser.run("document.querySelector('[data-do=whole]').click()")
    np.testing.assert_allclose(browser.run(scales), whole)


def test_the_table_sorts_by_every_column_and_keys_go_through_it(browser, page):
    heads = browser.run("[...document.querySelectorAll('table.impacts thead th')].map(h => "
                        "h.textContent)")  # fmt: skip
    shown = "[...document.querySelectorAll('tbody.live tr[data-impact]')].map(r => "
    for k, head in enumerate(heads[:-1]):
        button = f"document.querySelectorAll('table.impacts thead button')[{k}]"
        browser.run(f"{button}.click()")
        browser.run(f"{button}.getAttribute('x')")
        rising = browser.run(f"{button}.parentElement.getAttribute('aria-sort')") == "ascending"
        cells = [one for one in browser.run(f"{shown} r.cells[{k}].textContent)") if one != "–"]
        values = np.array([float(one) for one in cells])
        assert len(values) > 15, head
        assert (np.diff(values) * (1 if rising else -1) >= 0).all(), head
    numbers = "document.querySelectorAll('table.impacts thead button')[0]"
    browser.run(f"{numbers}.click()")
    if browser.run(f"{numbers}.parentElement.getAttribute('aria-sort')") != "ascending":
        browser.run(f"{numbers}.click()")
    browser.run("document.querySelector('tbody.live button[tabindex=\"0\"]').focus()")
    keys = browser.driver.switch_to.active_element.send_keys
    keys("\ue015" * 3)  # arrow down
    assert int(browser.run(CHOSEN)) == 4
    browser.driver.switch_to.active_element.send_keys("\ue010")  # end
    assert int(browser.run(CHOSEN)) == 1326
    assert browser.run("document.activeElement.textContent") == "1326"
    start, stop = browser.run(SEEN)
    assert start < _times(browser)[-1] < stop


def test_ten_thousand_impacts_are_all_in_the_table(browser, tmp_path):
    from dataclasses import replace

    time = np.cumsum(np.random.default_rng(1).uniform(0.01, 0.1, 10_000))
    path = tmp_path / "x.wav"
    soundfile.write(path, np.zeros(5000), 5000)
    found = analyse(path, sensor="force")
    many = Impacts(time, start=0.0, duration=time[-1] + 1, peak=time % 1)
    page = write_page(replace(found, impacts=many, excerpts=()), tmp_path / "page.html")
    assert page.stat().st_size < 3_000_000
    told, _ = browser.open(page)
    assert told == []
    assert int(browser.run("document.querySelector('table.impacts').ariaRowCount")) == 10_001
    assert browser.run("document.querySelectorAll('table.impacts tr').length") < 100
    browser.run("document.querySelector('table.impacts').parentElement.scrollTo(0, 1e7)")
    browser.driver.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0]))")
    last = browser.run("[...document.querySelectorAll('tbody.live button')].at(-1).textContent")
    assert last == "10000"


@pytest.mark.skipif(
    not importlib.util.find_spec("axe_core_python"), reason='pip install "impactsig[test]"'
)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_violation(scheme, browser, page):
    from axe_core_python.selenium import Axe

    browser.emulate(prefers_color_scheme=scheme)
    browser.run("document.querySelector('tbody.live tr[data-impact]').click()")
    found = Axe().run(browser.driver)
    assert len(found["passes"]) > 20
    assert [(one["id"], one["nodes"][0]["html"]) for one in found["violations"]] == []


def test_few_pages_are_printed(browser, page):
    sheet = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": True}
    printed = browser.driver.execute_cdp_cmd("Page.printToPDF", sheet)["data"]
    assert len(re.findall(rb"/Type /Page\b", base64.b64decode(printed))) <= 3


def test_the_page_of_many_files_is_not_cut_at_1400_pixels(browser, tmp_path):
    """With a column for every key figure that there can be."""
    figures = tuple(
        (name, value, "")
        for name, value in {
            "impacts": "12,116", "period": "(12, 11)", "motion": "chaotic or irregular",
            "median interval": "138.78 ms", "interval CV": "0.000486",
            "contact time": "0.33467 ms", "time in contact": "0.434 %",
            "median peak": "over 0.08192 V", "dimension": "1.13",
            "slope between two scales": "1.03", "Lyapunov exponent": "0.542 per impact",
        }.items()
    )  # fmt: skip
    path = tmp_path / "loadcell_chaotic_20.1Hz_short.wav"
    (tmp_path / "index.html").write_text(_index((Entry(path, path, "", figures),)))
    browser.driver.set_window_size(1400, 900)
    assert browser.open(tmp_path / "index.html")[0] == []
    assert browser.run("(s => s.scrollWidth <= s.clientWidth)(document.querySelector('.scroll'))")


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
