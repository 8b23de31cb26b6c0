"""`onnx`: model.onnx, which takes a record and its first samples and gives the rest, as our models do."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
from jaxtyping import Float

from simgap.exports.folders import About, file_in
from simgap.exports.subjects import CheckRecord, Subject

FILE = "model.onnx"


def refusal(kind: type) -> str:
    """Say why models of a class have no graph; empty where they have one."""
    return "" if callable(getattr(kind, "to_onnx", None)) else "only linear models and networks have a graph of ONNX"


def missing() -> str:
    """Say what is missing to write and to run it: onnx and onnxruntime."""
    missing = [name for name in ("onnx", "onnxruntime") if importlib.util.find_spec(name) is None]
    return f"{' and '.join(missing)} not installed; pip install 'simgap[export]'" if missing else ""


def write(subject: Subject, folder: Path) -> None:
    """Write model.onnx."""
    graph = subject.model.to_onnx(subject.fitted_on.n_init)
    graph.producer_name = "simgap"
    (folder / FILE).write_bytes(graph.SerializeToString())


def run(folder: Path, about: About, record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Run it by onnxruntime."""
    import onnxruntime

    file = file_in(folder, FILE)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    (y_hat,) = session.run(["y_hat"], {"u": record.u[None], "y_init": record.y_init[None]})
    return np.asarray(y_hat)[0]
