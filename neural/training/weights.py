"""A trained network on disk: weights.safetensors, and model.json with everything else. Nothing in them is executed."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from simgap.neural.training.scaling import Scaling
from simgap.records import UnusableInput
from simgap.registry import MODELS

SCHEMA = 1
# Larger files are no models of this kind.
LARGEST_FILE = 1 << 30
LARGEST_JSON = 1 << 20


def save(model: Any, folder: Path) -> None:
    """Write a fitted network into a folder, which is made if it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    about = {
        "schema": SCHEMA, "model": MODELS.name_of(type(model)), "params": model.hyper_parameters(), "dt": model.dt,
        "features": asdict(model.of_x), "outputs": asdict(model.of_y), "fitted": model.fitted,
        "inputs": model.inputs,
    }  # fmt: skip
    save_file({name: value.contiguous() for name, value in model.trained.state_dict().items()},
              folder / "weights.safetensors")  # fmt: skip
    (folder / "model.json").write_text(json.dumps(about, indent=1), encoding="utf-8")


def load_model(folder: str | Path) -> Any:
    """The network that was saved into a folder. Raises UnusableInput for anything else."""
    folder = Path(folder)
    try:
        for name, most in (("model.json", LARGEST_JSON), ("weights.safetensors", LARGEST_FILE)):
            if (folder / name).stat().st_size > most:
                raise UnusableInput(f"{folder / name} is larger than any model of this kind")
        about = json.loads((folder / "model.json").read_text(encoding="utf-8"))
        if about["schema"] != SCHEMA:
            raise UnusableInput(f"{folder}: schema {about['schema']!r} is unknown; this simgap reads schema {SCHEMA}")
        model = _build(about)
        model.trained.load_state_dict(load_file(folder / "weights.safetensors"))
    except UnusableInput:
        raise
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, RecursionError, SafetensorError) as error:
        raise UnusableInput(f"{folder} holds no network of simgap: {' '.join(str(error).split())[:200]}") from error
    model.trained.eval()
    return model


def _build(about: dict[str, Any]) -> Any:
    from simgap.neural.training.network import Network

    kind = MODELS[str(about["model"])]
    if not (isinstance(kind, type) and issubclass(kind, Network)):
        raise UnusableInput(f"{about['model']} is no network")
    model = kind(**(about["params"] | {"device": "cpu", "log": ""}))
    model.check()
    model.dt, model.fitted = float(about["dt"]), dict(about["fitted"])
    model.of_x, model.of_y = (
        Scaling(tuple(map(float, about[part]["middle"])), tuple(map(float, about[part]["half"])))
        for part in ("features", "outputs")
    )
    model.inputs = int(about["inputs"])
    with torch.device("meta"):  # what it would weigh, before memory is taken for it
        size = sum(p.numel() for p in model.net(model.inputs, len(model.of_y.middle)).parameters())
    if size > LARGEST_FILE // 4:
        raise UnusableInput(f"a network of {size} weights is larger than any of this kind")
    model.trained = model.net(model.inputs, len(model.of_y.middle))
    return model
