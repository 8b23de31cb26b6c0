"""Shapes and types of every public function are checked while the tests run, and only then."""

import math
import os
import shutil
import time
from pathlib import Path

import pytest
from floor_plan import ROOT, modules
from jaxtyping import install_import_hook

BEGUN = time.monotonic()
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
# Called a hundred thousand times by one search or one report; checks would make them several times as slow. Where a
# search calls often, what is checked must define no function inside another: it is compiled anew at every call.
CALLED_OFTEN = (
    "greybox.drive", "greybox.dynamics", "greybox.effects.absolute_sensor", "greybox.effects.curve",
    "greybox.effects.curved_sensor", "greybox.effects.effect", "greybox.effects.fine_curve", "greybox.fitting",
    "greybox.levenberg", "greybox.machine", "greybox.noise", "greybox.normal_equations", "greybox.plant",
    "greybox.problem", "greybox.samples", "greybox.simulation", "greybox.terms", "greybox.two_masses",
    "baselines.estimation.block_error", "baselines.estimation.block_search", "baselines.estimation.blocks",
    "baselines.estimation.box_jenkins_error", "baselines.estimation.filters", "baselines.estimation.gram",
    "baselines.estimation.levenberg", "baselines.estimation.monomials", "baselines.estimation.narx_error",
    "baselines.estimation.output_error", "baselines.estimation.polynomial", "baselines.estimation.prediction_error",
    "baselines.estimation.state_space_error", "baselines.estimation.thresholding", "subspace.state_space",
    "results.store", "reports.pooling",
)  # fmt: skip
# Compare the sizes of all attributes of a saved model; with each of their calls checked, each would stand alone.
CHECKS_ITSELF = ("saved.codec", "running.annotations")


def _modules() -> list[str]:
    """Every module but the command line, numba kernels (a checked function cannot be compiled) and those above."""
    unchecked = {f"simgap.{name}" for name in (*CALLED_OFTEN, *CHECKS_ITSELF)}
    return [
        name for name, path in modules().items()
        if not (path.stem.endswith("kernels") or path.stem == "__init__" or name in unchecked or ".cli." in name)
    ]  # fmt: skip


install_import_hook(_modules(), "beartype.beartype")


def pytest_addoption(parser):
    parser.addoption("--minutes", type=float, default=math.inf, help="skip what has not begun by then")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    minutes = item.config.getoption("minutes")
    if time.monotonic() - BEGUN > 60 * minutes:
        pytest.skip(f"{item.path.name}: left out, {minutes:g} minutes are over")


@pytest.fixture(scope="session")
def measured() -> Path:
    """The folder of measured data sets, which are not part of the repository."""
    folder = Path(os.environ.get("SIMGAP_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("no measured data here: set SIMGAP_DATA to the folder that holds them")
    return folder


@pytest.fixture(scope="session")
def browser():
    """One Chromium for all pages: playwright runs once in a process."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed; make dev installs it")
    chromium = os.environ.get("SIMGAP_CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), "")
    if not chromium:
        pytest.skip("no Chromium here; on Debian: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        # A root user, as in a container, cannot have Chromium's sandbox; the pages are our own.
        running = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield running
        running.close()
