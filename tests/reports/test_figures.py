"""Pictures and LaTeX tables of stored results: all are written, the same each time, and no name is obeyed."""

import json
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET

import pytest

import simgap
from simgap.diagnosis.recovery import FILE
from simgap.reports.latex import to_latex
from simgap.reports.tables import Cell, Table
from simgap.results import store


@pytest.fixture(scope="module")
def written(results_on_disk, tmp_path_factory):
    return simgap.write_figures(results_on_disk, tmp_path_factory.mktemp("figures"))


def test_each_table_and_each_picture_is_there_in_each_format(written):
    assert sorted(file.name for file in written) == [
        "recovery-confusion.pdf", "recovery-confusion.svg", "smoke-Free-run-fit-in-percent.tex",
        "smoke-The-row-that-validation-data-choose.tex", "smoke-gimbal_short-free-run.pdf",
        "smoke-gimbal_short-free-run.svg", "smoke-gimbal_short-horizon.pdf", "smoke-gimbal_short-horizon.svg",
        "smoke-gimbal_short.tex",
    ]  # fmt: skip
    for file in written:
        if file.suffix == ".pdf":
            assert file.read_bytes().startswith(b"%PDF")
        if file.suffix == ".svg":
            assert ET.parse(file).getroot().tag.endswith("svg")
    assert (written[0].parent / ".gitignore").read_text() == "*\n"


def test_the_same_results_give_the_same_files(written, results_on_disk, tmp_path):
    again = {file.name: file.read_bytes() for file in simgap.write_figures(results_on_disk, tmp_path)}
    assert again == {file.name: file.read_bytes() for file in written}


def test_a_public_folder_and_one_without_forecasts_or_artefacts_hold_what_they_may(make_row, tmp_path):
    store.append(tmp_path, "full", [make_row("arx")])
    files = simgap.write_figures(tmp_path, public=True)
    assert {file.suffix for file in files} == {".tex"}
    assert not (tmp_path / "figures" / ".gitignore").exists()


def test_the_confusion_matrix_is_that_of_the_stored_cases(written, results_on_disk):
    cases = [json.loads(line) for line in (results_on_disk / FILE).read_text().splitlines()]
    assert len(cases) == 8
    svg = next(file for file in written if file.name == "recovery-confusion.svg").read_text()
    assert re.search(r"dead zone \(8\)", svg)


def test_marks_and_special_characters_stand_in_a_latex_table():
    rows = [
        [Cell("a_b & 50 % of $x^2$ {\\x} #~"), Cell("1.5", 1.5, best=True)],
        [Cell("[1] first"), Cell("2", 2.0, second=True)],
    ]
    text = to_latex(Table("50 %", ["model", "MSE [deg²]"], rows, ["why_not"]))
    assert (
        r"a\_b \& 50 \% of \$x\textasciicircum{}2\$ \{\textbackslash{}x\} \#\textasciitilde{} & \textbf{1.5} \\" in text
    )
    assert r"{[1] first} & \underline{2} \\" in text
    assert r"MSE [deg\textsuperscript{2}]" in text
    assert r"[1] why\_not" in text


def test_latex_takes_the_tables(written, tmp_path):
    if not shutil.which("pdflatex"):
        pytest.skip("no pdflatex here; on Debian: apt-get install texlive-latex-base")
    body = "".join(file.read_text() for file in written if file.suffix == ".tex")
    rules = r"\let\toprule\hline\let\midrule\hline\let\bottomrule\hline"  # booktabs is in another Debian package
    package = rf"\IfFileExists{{booktabs.sty}}{{\usepackage{{booktabs}}}}{{{rules}}}"
    document = rf"\documentclass{{article}}{package}\begin{{document}}" + f"\n{body}" + r"\end{document}"
    (tmp_path / "all.tex").write_text(document)
    done = subprocess.run(["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "all.tex"], cwd=tmp_path,
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stdout[-1000:]
