"""A server of `simgap open`, and a Chromium to look at it."""

import os
import shutil
import tempfile
from pathlib import Path

import pytest
from app.commands import end, start

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def served():
    with tempfile.TemporaryDirectory() as temporary:
        one = start(Path(temporary))
        yield one
        end(one)


@pytest.fixture(scope="session")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed; make dev installs it")
    chromium = os.environ.get("SIMGAP_CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), "")
    if not chromium:
        pytest.skip("no Chromium here; on Debian: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        # A root user, as in a container, cannot have Chromium's sandbox; the pages are our own.
        running = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield running
        running.close()
