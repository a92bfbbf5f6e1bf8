"""The report: self-contained, escaped, bounded in size, true to what was found."""

import base64
import csv
import gzip
import hashlib
import html
import io
import json
import re
import shlex
from html.parser import HTMLParser

import numpy as np
import pytest
import soundfile

from impactsig import (
    Impacts,
    ImpactsigWarning,
    InvalidInput,
    Recording,
    UnreadableFile,
    UnwritableFile,
    cli,
    read,
    write_report,
)
from impactsig._trains.impact_columns import columns
from impactsig.detect import files as _files
from impactsig.report import Analysis, analyse, write_page
from impactsig.report.analysing.analysis import mean_and_spread
from impactsig.report.analysing.channels import overview_of, typical
from impactsig.report.analysing.samples import by_interest, windows
from impactsig.report.cards import tiles
from impactsig.report.contents import notes, printable
from impactsig.report.interactive import MARKED, marked, numbers, script_safe
from impactsig.report.tables import download, table

RATE = 50_000
TOUCH = 0.02 + 0.05 * np.arange(19)
CONTACT = 4e-4


def pulses(path, touches=TOUCH, duration=1.0, noise=0.001):
    t = np.arange(round(duration * RATE)) / RATE
    samples = noise * np.random.default_rng(0).standard_normal(len(t))
    for touch in touches:
        u = (t - touch) / CONTACT
        samples += 0.5 * np.where((u > 0) & (u < 1), np.sin(np.pi * u), 0)
    soundfile.write(path, samples, RATE, subtype="PCM_24")
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return pulses(tmp_path_factory.mktemp("rig") / "rig.wav")


@pytest.fixture(scope="module")
def found(recording):
    return analyse(recording, sensor="force", unit="V", forcing_period=1 / 20.0)


@pytest.fixture(scope="module")
def page(found, tmp_path_factory):
    path = write_page(found, tmp_path_factory.mktemp("page") / "page.html")
    return path.read_text(encoding="utf-8")


class Page(HTMLParser):
    """Tags with their attributes, the text of scripts, and the text that is seen."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.scripts, self.seen, self._inside = [], [], [], None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self._inside = tag
        if tag == "script":
            self.scripts.append((dict(attributes), ""))

    def handle_endtag(self, tag):
        self._inside = None

    def handle_data(self, data):
        if self._inside == "script":
            kind, text = self.scripts[-1]
            self.scripts[-1] = (kind, text + data)
        elif self._inside != "style":
            self.seen.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.seen).split())

    def attributes(self, name):
        return [attributes[name] for _, attributes in self.tags if name in attributes]

    def policy(self):
        content = next(a["content"] for t, a in self.tags if a.get("http-equiv"))
        return dict(part.strip().split(" ", 1) for part in content.split(";"))


# -- the analysis ----------------------------------------------------------------------------


def test_the_summary_says_period_count_and_contact_time_in_words(found):
    summary = found.summary()
    assert summary.startswith(found.periodicity.describe())
    assert f"{len(TOUCH)} impacts in 1 s" in summary
    mean, spread = re.search(r"contact time ([\d.]+) ms ± ([\d.]+)\.", summary).groups()
    contacts = found.impacts.contact_time
    assert float(mean) == pytest.approx(1e3 * contacts.mean(), abs=0.5e-3)
    assert float(mean) == pytest.approx(1e3 * CONTACT, rel=0.03)
    assert float(spread) == pytest.approx(1e3 * contacts.std(ddof=1), rel=0.06)
    assert (found.periodicity.impacts, found.periodicity.periods) == (1, 1)


def test_what_is_analysed_is_what_was_made(found):
    np.testing.assert_allclose(found.impacts.time, TOUCH, atol=40e-6)
    np.testing.assert_allclose(found.impacts.contact_time, CONTACT, rtol=0.03)
    assert (found.rates, found.overviews[0].unit) == ((RATE,), "V")


def test_excerpts_hold_their_impact_at_full_rate(found):
    assert len(found.excerpts) == 3
    for index, excerpt in found.excerpts:
        touch = found.impacts.time[index]
        assert excerpt.start < touch
        assert excerpt.stop > touch + found.impacts.contact_time[index]
        assert excerpt.rate == RATE


def test_blocks_give_what_the_whole_gives(recording, found, monkeypatch):
    monkeypatch.setattr(_files, "WHOLE_BELOW", 1000)
    blockwise = analyse(recording, sensor="force", unit="V", forcing_period=1 / 20.0)
    for name in ("time", "contact_time", "peak"):
        np.testing.assert_array_equal(
            getattr(blockwise.impacts, name), getattr(found.impacts, name)
        )
    for (i, a), (j, b) in zip(found.excerpts, blockwise.excerpts, strict=True):
        assert i == j
        np.testing.assert_array_equal(a.samples, b.samples)


def test_warnings_are_kept_and_passed_on(recording, monkeypatch):
    import warnings

    from impactsig import io as readers

    def warn(path, **options):
        warnings.warn("channel b was left out", ImpactsigWarning, stacklevel=2)
        return original(path, **options)

    original = readers.read
    monkeypatch.setattr(readers, "read", warn)
    with pytest.warns(ImpactsigWarning, match="left out"):
        result = analyse(recording, sensor="force")
    assert result.warnings == ("channel b was left out",)


def test_warnings_are_passed_on_although_the_analysis_failed(tmp_path, monkeypatch):
    import warnings

    from impactsig import io as readers

    def warn(path, raw):
        warnings.warn("the header lies", ImpactsigWarning, stacklevel=2)
        raise UnreadableFile(path, "cannot be read")

    monkeypatch.setattr(readers, "info", warn)
    with pytest.warns(ImpactsigWarning, match="lies"), pytest.raises(UnreadableFile):
        analyse(tmp_path / "x.wav")


def test_channels_are_offered_under_the_numbers_by_which_they_are_chosen(tmp_path):
    path = tmp_path / "rig.csv"
    path.write_text("a,b,c\n" + "".join(f"{i},{i},\n" for i in range(50)))
    with pytest.warns(ImpactsigWarning, match="not clear which of them.* 0: 'a', 1: 'b'"):
        shown = analyse(path, rate=100.0)
    assert (len(shown.overviews), shown.searched, len(shown.impacts)) == (2, 0, 0)
    assert tiles(shown) == []
    assert analyse(path, rate=100.0, channel="1").overviews[0].channels == ("b",)


@pytest.mark.parametrize("period", [0.0, -1.0, float("nan"), float("inf"), "20"])
def test_a_forcing_period_is_positive(recording, period):
    with pytest.raises(InvalidInput, match="forcing_period"):
        analyse(recording, forcing_period=period)


def test_the_overview_keeps_every_spike_at_its_time():
    samples = np.zeros(2_000_000, np.float32)
    samples[123_456], samples[1_999_999] = 4.0, -3.0
    whole = Recording(samples, RATE, "V")
    blocks = [whole.between(a, a + 7.0) for a in np.arange(0, whole.duration, 7.0)]
    for source in (whole, blocks):
        seen = overview_of(source, whole.duration)
        assert len(seen) <= 20_100
        assert seen.duration == pytest.approx(whole.duration)
        assert (seen.samples.max(), seen.samples.min()) == (4.0, -3.0)
        where = seen.time[np.argmax(seen.samples)]
        assert where == pytest.approx(123_456 / RATE, abs=2 * whole.duration / 10_000)


def test_a_short_recording_is_its_own_overview():
    short = Recording(np.arange(100.0), 10.0)
    assert overview_of(short, short.duration) is short


def test_typical_impacts_are_the_weakest_the_middle_and_the_strongest():
    assert typical(Impacts.from_times([1, 2, 3, 4, 5], peak=[3.0, 9.0, 1.0, 5.0, 4.0])) == [2, 4, 1]
    assert typical(Impacts.from_times([1, 2, 3, 4])) == [0, 2, 3]
    assert typical(Impacts.from_times([1.0])) == [0]
    assert typical(Impacts.from_times([], start=0, duration=1)) == []


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        # Standard deviation of (a - d, a, a + d) is d.
        ([0.29, 0.30, 0.31], ("0.300", "0.010")),
        ([100.0, 112.0, 124.0], ("112", "12")),
        ([0.3, 0.3], ("0.3", "0")),
        ([0.3], ("0.3", "")),
    ],
)
def test_mean_and_spread_show_the_digits_that_mean_something(values, shown):
    assert mean_and_spread(np.array(values)) == shown


# -- the page --------------------------------------------------------------------------------


def test_nothing_is_fetched(page):
    parsed = Page(page)
    for name in ("src", "href"):
        assert all(value.startswith("data:") for value in parsed.attributes(name))
    assert not {"link", "iframe", "object", "embed", "base", "form"} & {t for t, _ in parsed.tags}
    assert "url(" not in page[: page.index("</style>")]


def test_only_the_page_s_own_scripts_may_run(page):
    parsed = Page(page)
    policy = parsed.policy()
    assert policy["default-src"] == "'none'"
    assert "unsafe" not in policy["script-src"]
    for kind, text in parsed.scripts:
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        allowed = f"'sha256-{digest}'" in policy["script-src"]
        assert allowed is (kind.get("type") != "application/json")
    assert not [name for _, attributes in parsed.tags for name in attributes if name[:2] == "on"]


def test_the_numbers_drawn_are_those_of_the_recording(page, recording, found):
    held = json.loads(next(t for kind, t in Page(page).scripts if kind))
    [panel] = held["panels"]
    assert len(unpacked(panel["overview"][2], "<u2")) <= 20_000
    samples, _ = soundfile.read(recording)
    spans = {name: unpacked(panel["spans"][name], kind) for name, kind in SPAN_KINDS.items()}
    np.testing.assert_array_equal(spans["impact"], np.arange(len(found.impacts)))
    ends = np.cumsum(spans["count"])
    for k, touch in enumerate(found.impacts.time):
        drawn = spans["codes"][ends[k] - spans["count"][k] : ends[k]]
        first = round(spans["start"][k] * RATE)
        assert first / RATE < touch - CONTACT / 2
        assert (first + len(drawn)) / RATE > touch + 2 * CONTACT
        expected = samples[first : first + len(drawn)]
        values = spans["low"][k] + spans["step"][k] * drawn.astype(float)
        np.testing.assert_allclose(values, expected, atol=np.ptp(expected) / 65_534)
    impacts = held["impacts"]
    np.testing.assert_array_equal(unpacked(impacts["time"], "<f8"), found.impacts.time)
    before = unpacked(impacts["before"], "<f4")[1:]
    np.testing.assert_allclose(before, 1e3 * np.diff(found.impacts.time), rtol=1e-6)
    np.testing.assert_array_equal(unpacked(impacts["after"], "<f4")[:-1], before)


SPAN_KINDS = {
    "impact": "<u4", "start": "<f8", "count": "<u4", "low": "<f8", "step": "<f8", "codes": "<u2"
}  # fmt: skip


def unpacked(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def test_every_figure_says_what_it_shows(page):
    images = [attributes for tag, attributes in Page(page).tags if tag == "img"]
    assert len(images) >= 9
    assert all(image["alt"] for image in images)
    assert all(image["src"].startswith("data:image/svg+xml;base64,") for image in images)


def test_the_page_is_small_and_names_its_input(page, recording):
    assert len(page.encode()) < 3_000_000
    assert hashlib.sha256(recording.read_bytes()).hexdigest() in page


@pytest.mark.usefixtures("without_figures")
def test_the_hash_is_of_the_samples_where_settings_stand_in_another_file(recording, tmp_path):
    signal = read(recording)
    samples, settings = tmp_path / "run.Wfm.csv", tmp_path / "run.csv"
    samples.write_text("".join(f"{one:.6e}\n" for one in signal.samples))
    settings.write_text(
        f"SignalResolution:{1 / signal.rate}:\nXStart:0:\nVerticalUnit:V:\n"
        f"SignalHardwareRecordLength:{len(signal.samples)}:\n"
    )
    page = write_report(settings, tmp_path / "page.html").read_text(encoding="utf-8")
    assert hashlib.sha256(samples.read_bytes()).hexdigest() in page


def test_the_command_shown_makes_the_same_page_again_but_for_the_time_of_day(page, tmp_path):
    line = html.unescape(re.findall(r"<pre><code>(.*?)</code></pre>", page, re.S)[0])
    words = shlex.split(line)
    assert words[0] == "impactsig"
    assert cli.main([*words[1:], "-o", str(tmp_path / "again.html")]) == 0
    again = (tmp_path / "again.html").read_text(encoding="utf-8")

    def still(text):
        text = re.sub(r"Made \S+ \S+ UTC", "", text)
        return re.sub(r"<script type=\"application/json\".*?</script>", "", text, flags=re.S)

    assert still(again) == still(page)


def test_the_python_shown_finds_the_same_impacts(page, found):
    lines = html.unescape(re.findall(r"<pre><code>(.*?)</code></pre>", page, re.S)[1])
    names = {}
    exec(lines, names)
    np.testing.assert_array_equal(names["impacts"].time, found.impacts.time)


def _csv(page):
    source = re.search(r'href="data:text/csv;base64,([^"]*)"', page).group(1)
    return base64.b64decode(source).decode()


def test_the_table_inside_holds_every_impact(page, found):
    rows = list(csv.DictReader(io.StringIO(_csv(page))))
    assert [float(row["time"]) for row in rows] == pytest.approx(found.impacts.time, abs=1e-9)
    assert [float(row["peak"]) for row in rows] == pytest.approx(found.impacts.peak, rel=1e-6)


# -- bad and hostile input -------------------------------------------------------------------

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>'\"&{{7*7}}$x$"


@pytest.fixture
def hostile(found, tmp_path):
    """An analysis whose every text from outside tries to break out of its place."""
    from dataclasses import replace

    path = tmp_path / "</title><img src=x onerror=alert(3)>.wav".replace("/", "\N{DIVISION SLASH}")
    path.write_bytes(b"")
    channel = type(found.file.channels[0])
    return replace(
        found,
        file=replace(
            found.file,
            path=path,
            format=HOSTILE,
            channels=tuple(
                channel(name=HOSTILE, unit=HOSTILE, rate=1.0, length=1) for _ in range(2)
            ),
        ),
        overviews=(
            replace(found.overviews[0], units=(HOSTILE,), channels=(HOSTILE,), source=HOSTILE),
        ),
        impacts=replace(found.impacts, unit=HOSTILE, source=HOSTILE, settings={HOSTILE: HOSTILE}),
        reading={"channel": HOSTILE},
        warnings=(HOSTILE,),
    )


def test_text_from_outside_stays_text(hostile, page, tmp_path):
    plain = Page(page)
    parsed = Page(write_page(hostile, tmp_path / "page.html").read_text(encoding="utf-8"))
    assert len(parsed.scripts) == len(plain.scripts) == 3
    for tag in ("img", "script", "title", "a"):
        assert [t for t, _ in parsed.tags].count(tag) == [t for t, _ in plain.tags].count(tag)
    assert not parsed.attributes("onerror")
    assert HOSTILE in parsed.text
    drawing = next(text for kind, text in parsed.scripts if kind)
    assert "<" not in drawing
    assert json.loads(drawing)


def test_script_safe_json_reads_back():
    held = {"a": "</script><!--\u2028&"}
    safe = script_safe(json.dumps(held, ensure_ascii=False))
    assert not re.search("[<>&\u2028\u2029]", safe)
    assert json.loads(safe) == held


def test_a_name_that_is_no_utf8_is_written_visibly():
    assert printable("rig\udcff.wav") == "rig\\udcff.wav"


def test_zero_impacts_make_a_page_that_says_why(tmp_path):
    path = pulses(tmp_path / "silent.wav", touches=())
    result = analyse(path, sensor="force")
    assert len(result.impacts) == 0
    assert result.impacts.reason
    text = Page(write_page(result, tmp_path / "page.html").read_text(encoding="utf-8")).text
    assert f"No impacts in 1 s: {result.impacts.reason}" in " ".join(text.split("\u00a0"))


@pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.slow), 3])
def test_few_impacts_make_a_page_without_a_period(count, tmp_path):
    path = pulses(tmp_path / "few.wav", touches=TOUCH[:count])
    result = analyse(path, sensor="force")
    assert len(result.impacts) == count
    assert result.periodicity.kind == "too few impacts"
    text = Page(write_page(result, tmp_path / "page.html").read_text(encoding="utf-8")).text
    assert "period unknown" in text


def test_several_channels_ask_for_a_choice(tmp_path):
    path = tmp_path / "stereo.wav"
    soundfile.write(path, np.zeros((1000, 2)), 8000)
    with pytest.warns(ImpactsigWarning, match="Choose with --channel"):
        page = write_report(path, tmp_path / "page.html")
    text = Page(page.read_text(encoding="utf-8")).text
    assert "No impacts were looked for in 0.125 s" in text
    assert "Choose with --channel" in text


def test_a_missing_recording_leaves_nothing_behind(tmp_path):
    with pytest.raises(UnreadableFile, match=r"none\.wav") as caught:
        write_report(tmp_path / "none.wav", tmp_path / "page.html")
    assert caught.type is UnreadableFile
    assert not list(tmp_path.iterdir())


def test_a_page_that_cannot_be_written_is_found_before_the_analysis(tmp_path):
    with pytest.raises(UnwritableFile):
        write_report(tmp_path / "none.wav", tmp_path / "no" / "page.html")


# -- size ------------------------------------------------------------------------------------


def many(count):
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(0.01, 0.1, count))
    values = {name: rng.uniform(0.1, 1.0, count) for name in ("contact_time", "peak", "impulse")}
    return Impacts(time, start=0.0, duration=float(time[-1]) + 1, **values)


def test_many_impacts_are_held_compressed():
    impacts = many(12_000)
    held = download(impacts, "rig")
    assert held.filename == "rig-impacts.csv.gz"
    rows = gzip.decompress(base64.b64decode(held.source.split(",")[1])).decode().splitlines()
    assert len(rows) == 12_001


def test_very_many_impacts_are_left_to_the_command():
    assert download(many(60_000), "rig").source == ""


def test_the_shown_table_is_cut_and_in_readable_units():
    impacts = Impacts(
        [0.5, 0.7], contact_time=[3e-4, 4e-4], peak=[1.0, 2.0], flags=[0, 4], unit="N"
    )
    shown = table(impacts, 1)
    assert shown.heads == (
        "impact", "time [s]", "interval before [ms]", "contact time [ms]", "peak [N]", "flags"
    )  # fmt: skip
    assert shown.rows == (("1", "0.500000", "–", "0.3000", "1", ""),)
    assert table(impacts, 9).rows[1][2] == "200.0000"
    assert table(impacts, 9).rows[1][-1] == "clipped"


def test_standard_errors_stand_beside_what_they_are_of_to_one_digit():
    impacts = Impacts(
        [0.5, 0.7], contact_time=[3e-4, 4e-4], peak=[1.0, 2.0], impulse=[2e-4, 5e-4], unit="N",
        time_error=[1.23e-6, 0.0], contact_time_error=[2.51e-5, np.inf],
        peak_error=[0.0478, 0.31], impulse_error=[1.6e-6, np.inf],
    )  # fmt: skip
    shown = table(impacts, 2)
    assert shown.heads == (
        "impact", "time [s]", "± [µs]", "interval before [ms]", "contact time [ms]", "± [µs]",
        "peak [N]", "±", "impulse [N s]", "±", "flags",
    )  # fmt: skip
    assert [row[2] for row in shown.rows] == ["1", "0"]
    assert [row[5] for row in shown.rows] == ["30", "–"]
    assert [row[7] for row in shown.rows] == ["0.05", "0.3"]
    assert [row[9] for row in shown.rows] == ["2e-06", "–"]


def test_the_downloaded_table_has_every_column_that_was_measured(found):
    held = download(found.impacts, "rig")
    lines = base64.b64decode(held.source.split(",")[1]).decode().splitlines()
    assert lines[0].split(",") == list(columns(found.impacts))
    held = dict(zip(lines[0].split(","), np.array(list(csv.reader(lines[1:]))).T, strict=True))
    np.testing.assert_allclose(
        held["time_error"].astype(float), found.impacts.time_error, rtol=0.01
    )
    np.testing.assert_allclose(
        held["peak_error"].astype(float), found.impacts.peak_error, rtol=0.01
    )


def test_marks_are_thinned_evenly(found):
    chosen = marked(many(25_000))
    assert len(chosen) <= MARKED
    assert set(np.diff(chosen)) == {3}
    assert len(marked(many(MARKED))) == MARKED
    assert isinstance(found, Analysis)


def test_one_gap_is_one(tmp_path):
    path = tmp_path / "x.csv"
    samples = np.random.default_rng(0).normal(size=1000)
    samples[400:410] = np.nan
    np.savetxt(path, samples)
    told = notes(analyse(path, rate=1000.0, gaps="split"))
    assert any(text.startswith("1 gap, 0.01 s in all, without valid") for text in told)


# -- what of the samples is held ---------------------------------------------------------------


def test_samples_of_the_impacts_most_worth_a_look_are_held_first():
    rng = np.random.default_rng(3)
    peak = rng.uniform(0.9, 1.1, 1000)
    peak[700] = 3.0
    flags = np.zeros(1000, int)
    flags[123] = 4
    time = 0.05 * np.arange(1, 1001)
    impacts = Impacts(
        time, start=0.0, duration=51.0, peak=peak, contact_time=np.full(1000, 3e-4), flags=flags
    )
    order = by_interest(impacts)
    assert sorted(order) == list(range(1000))
    assert set(order[:3]) == set(typical(impacts))
    assert order[3] == 123
    room = 20_000
    index, low, high = windows(impacts, RATE, room)
    assert set(order[: len(index)]) == set(index)
    assert 100 < len(index) < 1000
    assert np.ceil((high - low) * RATE).sum() <= room
    assert (low < time[index]).all()
    assert (high > time[index] + 3e-4).all()


def test_spans_of_impacts_close_by_share_the_time_between_them():
    impacts = Impacts([0.5, 0.5002, 0.9], start=0.0, duration=1.0, contact_time=[1e-4, 1e-4, 1e-4])
    _, low, high = windows(impacts, RATE, 10_000)
    assert high[0] == low[1] == pytest.approx(0.5001)
    assert (low < impacts.time).all()
    assert (high > impacts.time).all()


def test_samples_around_impacts_fill_what_a_page_leaves(found):
    whole, held = numbers(found, 3_000_000)
    assert held == len(found.impacts)
    none, held = numbers(found, 0)
    assert held == 0
    room = (len(whole) + len(none)) // 2
    some, held = numbers(found, room)
    assert 0 < held < len(found.impacts)
    assert len(some) <= room


# -- cards -------------------------------------------------------------------------------------


def test_cards_show_only_what_is_sure(found):
    from dataclasses import replace

    cards = {name: (value, word) for name, value, word in tiles(found)}
    assert cards["period"] == ("(1, 1)", "probability over 0.99")
    assert cards["median interval"][1] == "20 Hz"
    doubted = replace(found, periodicity=replace(found.periodicity, confidence=0.6))
    assert "period" not in {name for name, *_ in tiles(doubted)}
    twice = replace(found, periodicity=replace(found.periodicity, impacts=2))
    assert "Hz" not in next(word for name, _, word in tiles(twice) if name == "median interval")


def test_a_card_counts_the_impacts_of_each_stop(found):
    from dataclasses import replace

    assert "impacts by stop" not in {name for name, *_ in tiles(found)}
    count = len(found.impacts)
    stop, sure = np.zeros(count, np.int64), np.ones(count)
    stop[2:5], sure[3] = 1, 0.6
    both = replace(found.impacts, stop_index=stop, stop_probability=sure)
    cards = {name: (value, word) for name, value, word in tiles(replace(found, impacts=both))}
    assert cards["impacts by stop"] == (f"{count - 3} and 3", "stop 0, stop 1; 1 in doubt")


def test_the_peak_of_clipped_pulses_is_a_lower_bound(found):
    from dataclasses import replace

    clipped = replace(found, impacts=replace(found.impacts, flags=np.full(len(TOUCH), 4)))
    value = next(value for name, value, _ in tiles(clipped) if name == "median peak")
    assert value.startswith("over ")
    assert not next(v for name, v, _ in tiles(found) if name == "median peak").startswith("over")
