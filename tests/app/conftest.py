"""A server of `simgap open`."""

import tempfile
from pathlib import Path

import pytest
from app.commands import end, start


@pytest.fixture(scope="session")
def served():
    with tempfile.TemporaryDirectory() as temporary:
        one = start(Path(temporary))
        yield one
        end(one)
