"""README.md and the pages of docs/ do what they say: their blocks are run in a folder with the files that they name.

A comment above a block says what the block is: `<!-- file NAME -->` is the content of a file, `<!-- not run -->` is for
make, which would run these tests again. Other blocks of sh and python are run as they stand, those of docs/ by
make test-slow; those under `<!-- measured -->` need measured data.
"""

import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from simgap.registry import MODELS

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>[^\n]*) -->\n)?^```(?P<language>\w+)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL
)


class Block(NamedTuple):
    page: Path
    mark: str | None
    language: str
    text: str


README, *DOCS = PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCKS = [Block(page, *match.groups()) for page in PAGES for match in BLOCK.finditer(page.read_text(encoding="utf-8"))]
FILES = {mark.removeprefix("file "): text for _, mark, _, text in BLOCKS if mark and mark.startswith("file ")}


def to_run(language: str, pages: list[Path], mark: str | None = None) -> list[str]:
    found = (x.text for x in BLOCKS if (x.language, x.mark) == (language, mark) and x.page in pages)
    return list(dict.fromkeys(found))


def write_record(path: Path, output: str, seed: int, samples: int = 300) -> None:
    """A first-order plant under a random square wave."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], size=samples // 10), 10)
    y = np.zeros(samples)
    for t in range(1, samples):
        y[t] = 0.9 * y[t - 1] + 0.2 * u[t - 1]
    columns = np.column_stack((0.1 * np.arange(samples), u, y + rng.normal(scale=0.02, size=samples)))
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, columns, fmt="%.6g", delimiter=",", header=f"t,u,{output}", comments="")


def write_simulated_record(path: Path, samples: int = 1200) -> None:
    """A first-order plant with a dead zone in y (m/s), and in y_sim a simulation without it and with less gain."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, samples // 10), 10)
    y, y_sim = np.zeros((2, samples))
    for t in range(1, samples):
        y[t] = 0.9 * y[t - 1] + 0.2 * (max(u[t - 1] - 0.3, 0.0) + min(u[t - 1] + 0.3, 0.0))
        y_sim[t] = 0.9 * y_sim[t - 1] + 0.18 * u[t - 1]
    columns = np.column_stack((0.1 * np.arange(samples), u, y + rng.normal(scale=0.02, size=samples), y_sim))
    np.savetxt(path, columns, fmt="%.6g", delimiter=",", header="t,u (V),y (m/s),y_sim (m/s)", comments="")


@pytest.fixture
def folder(tmp_path):
    """The reader's folder: three CSV files, a folder of experiments, and every file that a page shows."""
    write_record(tmp_path / "my.csv", "y", 0, 600)
    write_record(tmp_path / "new.csv", "y", 1)
    write_simulated_record(tmp_path / "log.csv")
    for seed, split in enumerate(("train", "train", "valid", "test")):
        write_record(tmp_path / "my_data" / split / f"{seed}.csv", "phi", seed)
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def run(folder: Path, *command: str) -> str:
    """What a command prints; it must end well and have nothing to complain about."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    done = subprocess.run(
        command, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=False, timeout=900
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    return done.stdout


@pytest.mark.parametrize("script", to_run("sh", [README]))
def test_the_commands_run(script, folder):
    assert run(folder, "bash", "-euo", "pipefail", "-c", script)


@pytest.mark.slow
@pytest.mark.parametrize("script", [text for text in to_run("sh", DOCS) if "--save arm.simgap" not in text])  # below
def test_the_commands_of_the_other_pages_run(script, folder):
    assert run(folder, "bash", "-euo", "pipefail", "-c", script)


@pytest.mark.slow
@pytest.mark.parametrize("script", to_run("python", PAGES))
def test_the_python_runs(script, folder):
    assert "# Leaderboard" in run(folder, sys.executable, "-W", "error", "-c", script)


@pytest.mark.slow
def test_the_way_from_a_log_to_a_better_simulator_ends_with_the_numbers_that_it_shows(folder):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    (script,) = (text for text in to_run("sh", DOCS) if "--save arm.simgap" in text)
    said = run(folder, "bash", "-euo", "pipefail", "-c", script)
    assert "The simulation errs because of Coulomb friction and gravity" in said
    assert said.count("the same free run") == 2
    joint = ET.parse(folder / "arm_mjcf" / "model.xml").find(".//joint")
    assert float(joint.get("frictionloss")) == pytest.approx(0.05 * 3.0, rel=0.02)
    assert float(joint.get("damping")) == pytest.approx(0.05 * 3.0, rel=0.02)


@pytest.mark.slow
def test_the_way_from_measured_records_ends_with_the_numbers_that_it_shows(folder, measured):
    said = "".join(run(folder, "bash", "-euo", "pipefail", "-c", script) for script in to_run("sh", DOCS, "measured"))
    (shown,) = (block.text for block in BLOCKS if block.language == "text" and "square-root share" in block.text)
    assert not [line for line in shown.splitlines() if line != "..." and line not in said]
    assert "0.605 V" in said
    assert "differs by 0 " in said


def test_its_model_in_baselines_is_registered_by_that_one_file(folder):
    script = (
        "import sys, simgap.baselines; simgap.baselines.__path__.append('baselines');"
        "from simgap.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    arguments = ["fit", "static_gain", "my.csv", "--input", "u", "--output", "y"]
    assert "static_gain on my" in run(folder, sys.executable, "-W", "error", "-c", script, *arguments)


def test_what_is_not_run_is_make():
    lines = [line for _, mark, _, text in BLOCKS if mark == "not run" for line in text.splitlines()]
    assert lines
    assert all(line.startswith("make ") or line == "source .venv/bin/activate" for line in lines)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_leads_to_a_file(page):
    links = re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8"))
    assert all((page.parent / link).is_file() for link in links if "://" not in link), links


def test_every_page_is_linked_from_the_readme():
    text = PAGES[0].read_text(encoding="utf-8")
    assert all(f"docs/{page.name}" in text for page in PAGES[1:])


def test_every_model_stands_in_the_table_that_says_when_to_use_it():
    text = (ROOT / "docs" / "models.md").read_text(encoding="utf-8")
    ours = [name for name in MODELS if MODELS.module(name).startswith("simgap.")]  # other tests may register more
    assert ours
    assert not [name for name in ours if f"`{name}`" not in text]


@pytest.mark.parametrize(
    "page", [*PAGES, *sorted(ROOT.glob("[a-z]*/**/README.md"))], ids=lambda page: str(page.relative_to(ROOT))
)
def test_every_make_target_it_names_exists(page):
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    named = re.findall(r"(?:^|`)make ([a-z-]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(named) <= set(targets)


def test_its_folders_exist():
    rows = re.findall(r"^\| `([a-z]+)/` \|", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(rows) == 6
    assert all((ROOT / folder / "README.md").is_file() for folder in rows)
