import json
import re
import runpy
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from simgap.findings import Gain, Trace
from simgap.reports.diagnosis.figures import label
from simgap.reports.diagnosis.page import diagnosis_page
from simgap.reports.diagnosis.traces import axis_range, choose, thin

EXAMPLES = runpy.run_path(str(Path(__file__).with_name("example_findings.py")))
named, suspected, nothing_found, unexplained, hostile = (
    EXAMPLES[name] for name in ("named", "suspected", "nothing_found", "unexplained", "hostile")
)

VOID = {"meta", "br", "link", "img", "input", "hr"}
LOADS = {"src", "href", "srcset", "data", "action", "poster", "background"}


class Page(HTMLParser):
    """The elements of a page, its visible text, and its scripts without plotly.js."""

    def __init__(self, text: str):
        super().__init__()
        self.open, self.tags, self.text, self.scripts = [], [], [], []
        self.feed(text)
        self.close()
        assert not self.open, f"never closed: {self.open}"
        self.text = " ".join(" ".join(self.text).split())
        self.plots = [script for script in self.scripts if "Plotly.newPlot(" in script]

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            if len(data) < 1_000_000:
                self.scripts.append(data)
        elif not self.open or self.open[-1] != "style":
            self.text.append(data)


def test_a_page_says_what_was_found_and_how_sure_it_is(named):
    page = Page(diagnosis_page(named))
    for told in (
        "The simulation errs because of Coulomb friction (or backlash); with it", "falls by 38 % (33 to 43 %).",
        "1.24 mm", "0.768 mm", "-38 %", "friction force", "6.84 mm/s^2", "6.71 to 6.97",
        "These data do not tell it from", "stop and start again in the same direction", "Viscous drag",
        "Only 150 training samples", "seed 0", "Coulomb friction 61.7 %",
        "learnable from the input, without a name 13.0 %", "floor: what repeated runs differ by 10.0 %",
    ):  # fmt: skip
        assert told in page.text


def test_experiments_profiles_and_views_are_plotted_once_each(named):
    page = Page(diagnosis_page(named))
    assert len(page.plots) == 1 + 3 + 1 + 2  # budget, experiments, profile, views
    ids = [attrs["id"] for _, attrs in page.tags if "plotly-graph-div" in attrs.get("class", "")]
    assert len(set(ids)) == len(page.plots)
    assert page.text.count("when moving forwards") == 1


def test_views_stand_beside_the_cause_that_they_show(named):
    text = Page(diagnosis_page(named)).text
    assert text.index("when moving forwards") < text.index("What else the plain model gets wrong")
    assert text.index("at high speed") > text.index("What else the plain model gets wrong")


def test_nothing_found_has_no_section_of_a_cause(nothing_found):
    page = Page(diagnosis_page(nothing_found))
    assert "Nothing found" in page.text
    assert "cause" not in {attrs.get("class") for tag, attrs in page.tags if tag == "section"}
    assert "with the causes" not in page.text
    assert "What the plain model gets wrong" in page.text
    assert len(page.plots) == 1 + 3 + 2


def test_a_suspect_is_called_a_suspect_and_its_simulation_is_shown(suspected):
    page = Page(diagnosis_page(suspected))
    for told in (
        "Suspected, not shown: Coulomb friction. The training data ask for it", "Suspect 1 of 1", "with the suspects",
        "1.1 mm", "-11 %", "To decide: record more and longer test experiments",
    ):  # fmt: skip
        assert told in page.text
    assert "with the causes" not in page.text
    assert "Cause 1" not in page.text
    assert len(page.plots) == 1 + 3 + 1 + 2
    assert all('"name":"after"' in plot for plot in page.plots[1:4])


def test_an_offer_is_called_an_offer(unexplained):
    text = Page(diagnosis_page(unexplained)).text
    assert "nothing in the catalogue explains it: 27 %" in text
    assert text.index("An offer to look at, not a finding") < text.index("force ~ +1 x^3 -0.2 v")


@pytest.mark.parametrize("example", ["named", "suspected", "nothing_found", "unexplained", "hostile"])
def test_nothing_is_loaded_from_anywhere(example, request):
    page = Page(diagnosis_page(request.getfixturevalue(example)))
    assert not [(tag, name) for tag, attrs in page.tags for name in attrs if name in LOADS]
    policy = next(attrs["content"] for tag, attrs in page.tags if "http-equiv" in attrs)
    assert policy.startswith("default-src 'none';")
    assert "http" not in policy


def test_hostile_names_are_shown_and_not_obeyed(hostile, named):
    text = diagnosis_page(hostile)
    page, harmless = Page(text), Page(diagnosis_page(named))
    assert "<script>alert(1)</script>" in page.text  # as text
    assert "{{7*7}}" in page.text
    assert "<script>alert" not in text
    assert "<img" not in text
    assert not {"img", "a"} & {tag for tag, _ in page.tags}
    assert not [name for _, attrs in page.tags for name in attrs if name.startswith("on")]
    count = [sum(tag == "script" for tag, _ in p.tags) for p in (page, harmless)]
    assert count[0] - len(page.plots) == count[1] - len(harmless.plots)
    assert "\x1b" not in text
    assert "\u202e" not in text


def test_names_in_plots_hold_no_markup_that_plotly_would_obey(hostile):
    for script in Page(diagnosis_page(hostile)).plots:
        for text in re.findall(r'"text":("(?:[^"\\]|\\.)*")', script):
            assert "<" not in json.loads(text)
    assert label("<b>a&b</b>\x1b", "m<") == "&lt;b&gt;a&amp;b&lt;/b&gt;  [m&lt;]"
    assert len(label("n" * 500)) == 32


def test_a_page_of_long_records_stays_small(named):
    t = np.arange(65_000) / 1000.0
    wide = np.sin(t)[:, None] * np.ones(3)
    traces = tuple(Trace(str(i), t, wide[:, :2], wide, wide + 0.5, wide + 0.1 * i) for i in range(3))
    names = {"a": "V", "b": "V", "c": "V"}
    gain = Gain(dict.fromkeys(names, 1.0), dict.fromkeys(names, 0.5), 0.5, 0.4, 0.6)
    page = diagnosis_page(replace(named, traces=traces, units=names, inputs=(("u", "V"), ("w", "V")), gain=gain))
    assert len(page.encode()) < 6_000_000


def test_the_same_findings_give_the_same_page(named):
    assert diagnosis_page(named) == diagnosis_page(named)


def test_a_simulation_that_diverges_leaves_the_measurement_readable(named):
    first = named.traces[0]
    huge = np.where(first.t[:, None] > 10, np.inf, first.y * 1e90)
    page = Page(diagnosis_page(replace(named, traces=(replace(first, before=huge),))))
    assert len(page.plots) == 1 + 1 + 1 + 2
    assert axis_range(first.y[:, 0], [huge[:, 0]])[1] < 10 * np.abs(first.y).max()
    assert axis_range(first.y[:, 0], []) is not None


def test_a_page_without_experiments_and_views_is_whole(nothing_found):
    page = Page(diagnosis_page(replace(nothing_found, traces=(), wrong=(), checks=())))
    assert len(page.plots) == 1  # the budget
    assert "Nothing found" in page.text


def test_thinning_keeps_peaks_and_order_and_leaves_short_records_alone():
    t = np.arange(65_001.0)
    y = np.sin(t / 5000)
    y[40_123], y[50_321], y[7] = 9.0, -9.0, np.nan
    kept, values = thin(t, y, 2000)
    assert len(kept) <= 2000
    assert np.all(np.diff(kept) > 0)
    assert kept[np.nanargmax(values)] == 40_123
    assert kept[np.nanargmin(values)] == 50_321
    np.testing.assert_array_equal(values, y[kept.astype(int)])
    np.testing.assert_array_equal(thin(t[:50], y[:50], 2000)[1], y[:50])


def test_what_is_not_finite_becomes_a_gap():
    y = np.concatenate([np.zeros(5000), np.full(5000, np.inf)])
    values = thin(np.arange(10_000.0), y, 100)[1]
    assert not np.isinf(values).any()
    assert np.isnan(values[-25:]).all()


def test_the_experiments_shown_are_the_most_improved_a_middling_and_the_worst(named):
    reasons = {trace.experiment: why for trace, why in choose(named.traces, True)}
    assert reasons["test_1"].startswith("improved most")
    assert len(reasons) == 3
    worse = replace(named.traces[2], after=named.traces[2].y + np.inf)
    many = [*named.traces, *named.traces[:2], worse]
    assert choose(many, True)[-1] == (worse, "largest error left")
    assert choose(named.traces[:1], True) == [(named.traces[0], "the only test experiment")]
    assert choose([], False) == []


def test_plotting_libraries_are_loaded_only_for_a_page():
    code = "import sys, simgap.reports.diagnosis.page; sys.exit(bool({'plotly', 'jinja2'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0
