"""A small data set on disk, and models that misbehave; both as a user would have them."""

from pathlib import Path

import numpy as np
import pytest

from simgap.data import save
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet

MODELS = Path(__file__).parent / "example_models.py"
CHANNELS = Channels((Channel("u", "V"),), (Channel("phi", "deg", "position"), Channel("omega", "deg/s", "velocity")))


def _experiment(name: str, seed: int, length: int = 90) -> Experiment:
    rng = np.random.default_rng(seed)
    return Experiment(name, rng.normal(size=(length, 1)), rng.normal(size=(length, 2)), 0.1)


@pytest.fixture
def dataset() -> Dataset:
    """Noise: two outputs, two test experiments."""
    training = TrainingSet((_experiment("a", 0), _experiment("b", 1)), (_experiment("c", 2),), 4, CHANNELS)
    return Dataset("noise", training, (_experiment("first", 3), _experiment("second", 4, 60)), 4, CHANNELS)


@pytest.fixture
def folder(dataset: Dataset, tmp_path: Path) -> Path:
    """The same as a folder."""
    save(dataset, tmp_path / "noise")
    return tmp_path / "noise"


@pytest.fixture
def example():
    """`example("Mean")` is the reference of that model."""
    return lambda name: f"{MODELS}:{name}"


@pytest.fixture
def suite(folder: Path, tmp_path: Path):
    """`suite("Mean", "Hangs", timeout=5)` writes a suite of example models on the small data set."""

    def write(*models: str, timeout: float = 60, seeds: int = 1, datasets: str = '["noise"]', memory: float = 8) -> str:
        path = tmp_path / "mine.toml"
        tables = "".join(f'[[models]]\nname = "{MODELS.as_posix()}:{model}"\n' for model in models)
        limits = f"timeout = {timeout}\nmemory = {memory}\nseeds = {seeds}\n"
        path.write_text(f'title = "Mine"\ndatasets = {datasets}\n{limits}{tables}')
        return str(path)

    return write
