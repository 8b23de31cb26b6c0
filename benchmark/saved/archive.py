"""A saved model: one file of arrays and JSON. Nothing in it is executed."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import safetensors.numpy
from safetensors import SafetensorError, safe_open

from simgap.protocol import Model
from simgap.records import Channel, Channels, Dataset, UnusableInput
from simgap.registry import MODELS
from simgap.saved.codec import Encoder, build_record, decode_model

VERSION = 1
KEY = "simgap"


@dataclass(frozen=True)
class FittedOn:
    """What a model was fitted on: its input and output columns, the sampling time dt in s, and n_init."""

    dataset: str
    sha256: str
    dt: float
    n_init: int
    channels: Channels

    @classmethod
    def of(cls, dataset: Dataset) -> FittedOn:
        """What a later simulation must know of a data set."""
        return cls(
            dataset.name, dataset.sha256, dataset.training.dt, dataset.n_init, replace(dataset.channels, plant=None)
        )

    @classmethod
    def read(cls, text: dict[str, Any]) -> FittedOn:
        """Read what `asdict` made of one."""
        columns = text["channels"]
        inputs, outputs = (tuple(build_record(Channel, one) for one in columns[part]) for part in ("inputs", "outputs"))
        dt, n_init = float(text["dt"]), int(text["n_init"])
        if not (inputs and outputs and dt > 0 and n_init > 0):
            raise ValueError("it does not say what it was fitted on")
        return cls(str(text["dataset"]), str(text["sha256"]), dt, n_init, Channels(inputs, outputs))


@dataclass(frozen=True, eq=False)
class SavedModel:
    """A model that was read from a file, its registered name, and what it was fitted on."""

    name: str
    model: Model
    fitted_on: FittedOn


def save_model(model: Any, file: str | Path, dataset: Dataset) -> None:
    """Write a model that was fitted on that data set into one file; `load_model` reads it.

    Raises UnusableInput for a model that is not registered, or that could not be read again.
    """
    encoder = Encoder()
    encoded = encoder.model(model)
    try:
        decode_model(encoded, encoder.arrays)
    except Exception as error:  # as below
        raise UnusableInput(f"the model cannot be saved: {_one_line(error)}") from error
    fitted_on = asdict(FittedOn.of(dataset))
    about = {"version": VERSION, "simgap": version("simgap"), **encoded, "fitted_on": fitted_on}
    text = json.dumps(about, allow_nan=False)
    Path(file).write_bytes(safetensors.numpy.save(encoder.arrays, {KEY: text}))


def load_model(file: str | Path) -> Any:
    """Load the model that `save_model`, `simgap fit --save` or `simgap diagnose --save` wrote; it simulates as before.

    Nothing in the file is executed. Raises UnusableInput for a file that holds no model that this simgap can read.
    """
    return read_saved(file).model


def read_saved(file: str | Path) -> SavedModel:
    """Read a saved model and what it was fitted on. Raises UnusableInput."""
    file = Path(file)
    try:
        if not file.is_file():
            raise UnusableInput(f"{file} is no file; a model is saved with `simgap fit MODEL DATA --save FILE`")
        with safe_open(file, framework="numpy") as archive:
            about = json.loads((archive.metadata() or {})[KEY])
            if about["version"] != VERSION:
                raise UnusableInput(
                    f"{file} has version {about['version']!r} of the format, this simgap reads version {VERSION}; "
                    f"it was written by simgap {about.get('simgap', '?')}"
                )
            if str(about["model"]) not in MODELS:
                raise UnusableInput(
                    f"{file} was saved by the model {about['model']!r}, which is not registered here; "
                    f"install the package that registers it"
                )
            arrays = {name: archive.get_tensor(name) for name in archive.keys()}  # noqa: SIM118
        return SavedModel(about["model"], decode_model(about, arrays), FittedOn.read(about["fitted_on"]))
    except UnusableInput:
        raise
    except SafetensorError as error:  # its words are about headers
        raise UnusableInput(f"{file} is no saved model; give a file that --save of fit or diagnose wrote") from error
    except Exception as error:  # a model that is built of what is none may raise anything
        raise UnusableInput(
            f"{file} is no saved model, such as --save of fit and diagnose writes: {_one_line(error)}"
        ) from error


def _one_line(error: BaseException) -> str:
    text = " ".join(str(error).split())[:200]
    return text if text and not isinstance(error, KeyError) else f"{type(error).__name__} {text}".rstrip()
