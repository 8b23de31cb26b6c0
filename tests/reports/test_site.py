"""The site is whole, loads nothing from elsewhere, says what is not at hand, and takes nothing from a user's disk."""

import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import simgap
from simgap.cli import main
from simgap.data import save
from simgap.records import UnusableInput
from simgap.reports.collection import DataCopy
from simgap.reports.site.names import file_names
from simgap.reports.site.residuals import bound, correlations
from simgap.results import artefacts, store

LOADING = ("src", "href", "data-signals", "data-run", "data-charts", "data-plotly")
HOSTILE = "</script><img src=x onerror=alert(1)>{{7*7}}"


class Links(HTMLParser):
    """What a page names in attributes that load or lead somewhere, and the tables without heading or caption."""

    def __init__(self, page: Path):
        super().__init__()
        self.targets, self.tables, self.captions, self.scopes = [], 0, 0, []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        known = dict(attrs)
        self.targets += [known[name] for name in LOADING if name in known]
        self.tables += tag == "table"
        self.captions += tag == "caption"
        self.scopes += [known.get("scope")] if tag == "th" else []


def pages(site: Path) -> list[Path]:
    return sorted(site.rglob("*.html"))


def test_every_link_and_every_script_of_every_page_is_there(site):
    assert len(pages(site)) >= 10
    for page in pages(site):
        for target in Links(page).targets:
            if target.startswith("#") or target == "data:,":
                continue
            assert "://" not in target, f"{page}: {target}"
            assert (page.parent / target).is_file(), f"{page}: {target}"


def test_every_table_has_a_caption_and_every_heading_a_scope(site):
    for page in set(pages(site)) - {site / "diagnoses" / "cart.html"}:  # whose tables stand under headings of their own
        links = Links(page)
        assert links.tables == links.captions, page
        assert set(links.scopes) <= {"col", "row"}, page


def test_there_is_one_copy_of_plotly_for_all_pages(site):
    large = [path for path in site.rglob("*") if path.is_file() and path.stat().st_size > 1_000_000]
    assert large == [site / "assets" / "plotly.js"]


def test_the_figures_are_those_of_the_tables(site, results_on_disk):
    from simgap.reports.tables import overview

    table = overview(store.read(results_on_disk / "smoke"))
    page = (site / "index.html").read_text()
    for row in table.rows:
        assert row[0].text in page
        assert row[1].text in page


def test_simulations_and_errors_of_a_run_add_up_to_the_measurement(site):
    def values(curve):
        import base64

        return np.frombuffer(base64.b64decode(curve["y"]["bdata"]), "<f4")

    def content(file):
        return json.loads(file.read_text().partition(", ")[2].removesuffix(");\n"))

    measured = content(site / "data" / "signals" / "gimbal_short.js")
    run = content(site / "data" / "runs" / "smoke" / "gimbal_short" / "arx.js")
    assert len(measured["records"]) == len(run["records"]) == 2
    for record, simulated in zip(measured["records"], run["records"], strict=True):
        for y, y_hat, error in zip(record["y"], simulated["y"], simulated["e"], strict=True):
            np.testing.assert_allclose(values(y), values(y_hat) + values(error), atol=2e-4)
    titles = [chart["title"] for chart in run["charts"]]
    assert {"Poles", "Gain", "Phase", "Error of phi with its own past", "Error of phi with input voltage"} <= set(
        titles
    )
    assert "Error of phi against the horizon" in titles


def test_a_diagnosis_shares_plotly_and_one_that_is_json_only_has_a_page_too(site):
    page = (site / "diagnoses" / "cart.html").read_text()
    assert len(page) < 300_000
    assert 'data-plotly="../assets/plotly.js"' in page
    assert "Coulomb friction" in (site / "diagnoses" / "only_json.html").read_text()
    assert (site / "diagnoses.html").read_text().count("<tr>") == 3


def test_the_pages_of_an_older_site_are_no_diagnoses(site, results_on_disk, tmp_path):
    again = simgap.write_site(results_on_disk, tmp_path / "second").parent
    assert (again / "diagnoses.html").read_text() == (site / "diagnoses.html").read_text()


def test_the_confusion_matrix_counts_what_was_named(site):
    page = (site / "recovery.html").read_text()
    assert re.search(r'dead zone \(8\)</th><td class="shade" style="--share: 12">1</td>'
                     r'<td class="shade" style="--share: 88"><strong>7</strong>', page)  # fmt: skip


def test_without_artefacts_or_data_the_pages_say_so(results_on_disk, tmp_path, make_row):
    store.append(tmp_path, "full", [make_row("arx"), make_row("gru", seed=1)])
    simgap.write_site(tmp_path)
    assert "Its files are not known here" in (tmp_path / "site" / "datasets" / "tanks.html").read_text()
    assert "Simulated outputs are not at hand" in (tmp_path / "site" / "models" / "gru.html").read_text()


def test_an_artefact_of_other_data_or_code_is_not_shown(results_on_disk, tmp_path):
    shutil.copytree(results_on_disk, tmp_path / "copy", ignore=shutil.ignore_patterns("site"))
    row = next(row for row in store.read(tmp_path / "copy" / "smoke") if row.model == "arx")
    path = artefacts.path_of(tmp_path / "copy", "smoke", row)
    artefacts.write(path, replace(artefacts.read(path), model_sha256="other"))
    simgap.write_site(tmp_path / "copy")
    page = (tmp_path / "copy" / "site" / "datasets" / "gimbal_short.html").read_text()
    assert "smoke/gimbal_short/mean.js" in page
    assert "smoke/gimbal_short/arx.js" not in page


def test_names_from_a_data_set_are_text(tmp_path, make_row):
    store.append(tmp_path, "full", [replace(make_row("arx"), model=HOSTILE, dataset="tanks")])
    simgap.write_site(tmp_path)
    for page in pages(tmp_path / "site"):
        assert "<img src=x" not in page.read_text(), page
    for file in (tmp_path / "site" / "data").rglob("*.js"):
        assert "</script>" not in file.read_text(), file


def test_a_public_site_shows_signals_of_simulated_sets_only(dataset, tmp_path):
    save(dataset, tmp_path / "noise")
    out = tmp_path / "out"
    simgap.run("smoke", models=["mean"], datasets=[str(tmp_path / "noise")], out=out)
    simgap.write_site(out)
    assert (out / "site" / "data" / "signals" / "noise.js").exists()
    assert (out / "site" / ".gitignore").read_text() == "*\n"
    simgap.write_site(out, public=True)
    assert not (out / "site" / "data" / "signals").exists()
    assert not (out / "site" / ".gitignore").exists()
    assert "no licence" in (out / "site" / "datasets" / "noise.html").read_text()
    assert DataCopy("gimbal", None).may_be_shown
    assert not DataCopy("cascaded_tanks", None).may_be_shown
    assert not DataCopy("servo", None).may_be_shown


def test_a_folder_with_other_files_is_refused_and_a_site_replaced(tmp_path, make_row, capsys):
    store.append(tmp_path, "full", [make_row("arx")])
    mine = tmp_path / "docs" / "mine.txt"
    mine.parent.mkdir()
    mine.write_text("mine")
    with pytest.raises(UnusableInput, match="holds other files"):
        simgap.write_site(tmp_path, tmp_path / "docs")
    assert main(["report", str(tmp_path), "--site", str(mine)]) == 2
    assert "there is a file of that name" in capsys.readouterr().err
    assert mine.read_text() == "mine"
    site = simgap.write_site(tmp_path, tmp_path / "pages").parent
    (site / "models" / "old.html").write_text("of an earlier run")
    simgap.write_site(tmp_path, tmp_path / "pages")
    assert not (site / "models" / "old.html").exists()
    assert {path.name for path in tmp_path.iterdir()} == {".lock", "docs", "full", "pages"}


def test_the_command_writes_the_site_unless_told_otherwise(tmp_path, make_row, capsys):
    store.append(tmp_path, "full", [make_row("arx")])
    assert main(["report", str(tmp_path), "--no-site"]) == 0
    assert not (tmp_path / "site").exists()
    assert main(["report", str(tmp_path)]) == 0
    assert "index.html" in capsys.readouterr().out
    assert (tmp_path / "site" / "index.html").is_file()


def test_file_names_are_different_where_labels_are():
    names = file_names(["arx", "ARX", "a/b", "a b", "..", "é"])
    assert len({name.lower() for name in names.values()}) == 6
    assert all(re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9_.-]*", name) for name in names.values())


@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_one_lag_in_twenty_is_outside_the_bounds_where_nothing_is_related(colour):
    from scipy.signal import lfilter

    rng = np.random.default_rng(0)
    outside = []
    for _ in range(60):
        pairs = [tuple(lfilter([1], [1, -colour], rng.normal(size=(2, 600)))) for _ in range(3)]
        outside.append(np.abs(correlations(pairs, 25)) > bound(pairs))
    assert 0.02 < np.mean(outside) < 0.09


def test_a_correlation_finds_the_lag_of_what_it_is_made_of():
    rng = np.random.default_rng(1)
    u = rng.normal(size=500)
    values = correlations([(np.roll(u, 3) * 2, u)], 10)
    assert np.argmax(values) == 10 + 3
    assert values[13] == pytest.approx(1, abs=0.02)
