"""What a fit leaves besides its rows: its free runs, and its matrices if it is linear; never a measured sample.

`<folder>/artefacts/<suite>/<model>/<data set>-<seed>-<digest>.safetensors`, in a folder that Git ignores.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.records import Result
from simgap.results.store import file_name, plain

FOLDER = "artefacts"
MATRICES = ("A", "B", "C", "D")
SCHEMA = "1"


@dataclass(frozen=True, eq=False)
class Artefact:
    """The free run [N, ny] of each test experiment, rows n_init .. T-1, and what it was made of.

    `state_space` are A, B, C, D of the deviations from an operating point, empty where the model is not linear.
    `source` is how the data were loaded: the arguments of `simgap.load`.
    """

    runs: dict[str, Float[np.ndarray, "N ny"]]
    n_init: int
    dt: float
    model_sha256: str = ""
    data_sha256: str = ""
    state_space: tuple[np.ndarray, ...] = ()
    source: dict[str, Any] = field(default_factory=dict)

    def belongs_to(self, row: Result) -> bool:
        """Tell whether a row came from the same data and code of the model."""
        wanted = row.provenance.get("model_sha256", ""), row.provenance.get("data_sha256", "")
        return (self.model_sha256, self.data_sha256) == wanted


def path_of(folder: Path, suite: str, row: Result) -> Path:
    """Name the file of the fit that a row belongs to."""
    about = json.dumps([row.model, plain(row.params), row.dataset, row.seed], sort_keys=True)
    digest = hashlib.sha256(about.encode()).hexdigest()[:12]
    name = f"{file_name(row.dataset)}-{row.seed}-{digest}.safetensors"
    return Path(folder) / FOLDER / file_name(suite) / file_name(row.model) / name


def write(path: Path, artefact: Artefact) -> None:
    """Write the file, all or nothing; runs in single precision. Raises OSError, on a full disk say."""
    from safetensors.numpy import save

    names = list(artefact.runs)
    arrays = {f"run.{i}": _single(artefact.runs[name]) for i, name in enumerate(names)}
    arrays |= {
        name: np.ascontiguousarray(matrix, dtype=np.float64)
        for name, matrix in zip(MATRICES, artefact.state_space, strict=False)
    }
    about = {
        "experiments": names, "n_init": artefact.n_init, "dt": artefact.dt, "model_sha256": artefact.model_sha256,
        "data_sha256": artefact.data_sha256, "source": plain(artefact.source),
    }  # fmt: skip
    content = save(arrays, {"simgap": SCHEMA, "about": json.dumps(about)})
    path.parent.mkdir(parents=True, exist_ok=True)
    ignore = next(parent for parent in path.parents if parent.name == FOLDER) / ".gitignore"
    if not ignore.exists():
        ignore.write_text("*\n", encoding="utf-8")
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=".", delete=False) as file:
        try:
            file.write(content)
            file.close()
            Path(file.name).replace(path)
        except BaseException:
            Path(file.name).unlink(missing_ok=True)
            raise


def read(path: Path) -> Artefact | None:
    """Read an artefact; None where there is none, or what is there is none."""
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(str(path), "np") as file:
            about = json.loads((file.metadata() or {})["about"])
            held = set(file.keys())
            return Artefact(
                runs={name: file.get_tensor(f"run.{i}") for i, name in enumerate(about["experiments"])},
                n_init=int(about["n_init"]), dt=float(about["dt"]), model_sha256=str(about["model_sha256"]),
                data_sha256=str(about["data_sha256"]), source=dict(about["source"]),
                state_space=tuple(file.get_tensor(name) for name in MATRICES if name in held),
            )  # fmt: skip
    except (OSError, SafetensorError, KeyError, ValueError, TypeError):
        return None


def _single(run: Float[np.ndarray, "N ny"]) -> np.ndarray:
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(run, dtype=np.float32)
