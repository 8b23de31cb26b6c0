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
WEIGHTS = "weights.safetensors"
# Larger files are no models of this kind.
LARGEST_FILE = 1 << 30


def save(model: Any, folder: Path) -> None:
    """Write a fitted network into a folder, which is made if it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    about = {
        "schema": SCHEMA, "model": MODELS.name_of(type(model)), "params": model.hyper_parameters(), "dt": model.dt,
        "features": asdict(model.of_x), "outputs": asdict(model.of_y), "fitted": model.fitted,
        "inputs": model.inputs,
    }  # fmt: skip
    save_file({name: value.contiguous() for name, value in model.trained.state_dict().items()},
              folder / WEIGHTS)  # fmt: skip
    (folder / "model.json").write_text(json.dumps(about, indent=1), encoding="utf-8")


def load(kind: type, folder: Path, about: dict[str, Any]) -> Any:
    """Read the network of that class that was saved into a folder. Raises UnusableInput for anything else."""
    try:
        if about["schema"] != SCHEMA:
            raise UnusableInput(f"{folder}: schema {about['schema']!r} is unknown; this simgap reads schema {SCHEMA}")
        if (folder / WEIGHTS).stat().st_size > LARGEST_FILE:
            raise UnusableInput(f"{folder / WEIGHTS} is larger than any model of this kind")
        model = _build(kind, about)
        model.trained.load_state_dict(load_file(folder / WEIGHTS))
    except UnusableInput:
        raise
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, SafetensorError) as error:
        raise UnusableInput(f"{folder} holds no network of simgap: {' '.join(str(error).split())[:200]}") from error
    model.trained.eval()
    return model


def _build(kind: type, about: dict[str, Any]) -> Any:
    model = kind(**(about["params"] | {"device": "cpu", "log": ""}))
    model.check()
    model.dt, model.inputs, model.fitted = float(about["dt"]), int(about["inputs"]), dict(about["fitted"])
    model.of_x, model.of_y = (
        Scaling(tuple(map(float, about[part]["middle"])), tuple(map(float, about[part]["half"])))
        for part in ("features", "outputs")
    )
    outputs = len(model.of_y.middle)
    with torch.device("meta"):  # what it would weigh, before memory is taken for it
        size = sum(p.numel() for p in model.net(model.inputs, outputs).parameters())
    if size > LARGEST_FILE // 4:
        raise UnusableInput(f"a network of {size} weights is larger than any of this kind")
    model.trained = model.net(model.inputs, outputs)
    return model
