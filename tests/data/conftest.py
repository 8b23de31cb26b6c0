"""A good data set to break, and a way to read the sentence with which it is then refused."""

from pathlib import Path

import numpy as np
import pytest

from simgap.data import load
from simgap.records import UnusableInput

TOML = """name = "my_data"
sampling_time = 0.1              # s
time = "t"
n_init = 2

[[inputs]]
name = "u"
unit = "V"

[[outputs]]
name = "phi"
unit = "deg"
kind = "position"

[splits]
train = "train/*.csv"
valid = "valid/*.csv"
test = "test/*.csv"
"""


def csv_text(rows: int = 20, seed: int = 0) -> str:
    values = np.random.default_rng(seed).normal(size=(rows, 2)).tolist()
    lines = [f"{k / 10!r},{u!r},{phi!r}" for k, (u, phi) in enumerate(values)]
    return "\n".join(["t,u,phi", *lines]) + "\n"


@pytest.fixture
def good(tmp_path: Path) -> Path:
    """A folder in the format, with two training experiments and one each to validate and to test on."""
    folder = tmp_path / "my_data"
    for seed, name in enumerate(("train/000.csv", "train/001.csv", "valid/002.csv", "test/003.csv")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(csv_text(seed=seed))
    (folder / "dataset.toml").write_text(TOML)
    return folder


@pytest.fixture
def refused():
    """Call `load` and return the one line with which it refuses."""

    def sentence(*arguments, **named) -> str:
        with pytest.raises(UnusableInput) as caught:
            load(*arguments, **named)
        assert len(str(caught.value).splitlines()) == 1
        return str(caught.value)

    return sentence


@pytest.fixture
def refused_cell(tmp_path: Path, refused):
    """Write a CSV file, load it, check that the refusal names file, row and column, and return it."""

    def sentence(content: str | bytes, row: int | None, column: str | None, **named) -> str:
        file = tmp_path / "log.csv"
        file.write_bytes(content.encode() if isinstance(content, str) else content)
        text = refused(file, **({"inputs": ["u"], "outputs": ["phi"]} | named))
        assert str(file) in text
        assert row is None or f"row {row}" in text
        assert column is None or repr(column) in text
        return text

    return sentence


@pytest.fixture
def no_files(tmp_path: Path, monkeypatch) -> Path:
    """An empty cache, and nothing at hand anywhere else."""
    cache = tmp_path / "cache"
    monkeypatch.setattr("simgap.data.measured.locations.roots", lambda: [cache])
    monkeypatch.setattr("simgap.data.measured.fetching.cache", lambda: cache)
    return cache


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Ten logs of 40 rows: log1.csv to log10.csv."""
    folder = tmp_path / "logs"
    folder.mkdir()
    for k in range(1, 11):
        (folder / f"log{k}.csv").write_text(csv_text(40, k))
    return folder
