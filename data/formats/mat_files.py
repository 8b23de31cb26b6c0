"""A MATLAB file as a table: its named vectors are the columns, rows are counted from 1."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.data.formats.headings import find, listed
from simgap.data.formats.tables import Table
from simgap.records import UnusableInput

# SciPy raises what it likes at a broken file; NotImplementedError is for version 7.3.
READ = """
import pickle, sys, warnings
from scipy.io import loadmat
warnings.simplefilter("ignore")
try:
    held = {name: value for name, value in loadmat(sys.argv[1]).items() if not name.startswith("__")}
    answer = {name: value for name, value in held.items() if value.dtype.kind in "fiu"}
except NotImplementedError:
    answer = None
except Exception as error:
    answer = str(error) or type(error).__name__
pickle.dump(answer, sys.stdout.buffer)
"""


def read_mat(path: Path, wanted: Sequence[str]) -> Table:
    """Read the vectors of a MATLAB file that are as long as those wanted; rows and columns are told by their shape.

    Raises UnusableInput for a broken file, and where the wanted ones are of different lengths.
    """
    found = {name: value.reshape(-1) for name, value in _arrays(path).items() if _is_vector(value)}
    if not found:
        raise UnusableInput(f"{path} holds no vectors; save time, inputs and outputs in it as one vector each")
    names = tuple(found)
    asked = [names[i] for name in wanted for i in find(names, name)]
    lengths = {len(found[name]) for name in asked or names}
    if len(lengths) > 1:
        told = ", ".join(f"{name} {len(found[name])}" for name in (asked or names)[:10])
        raise UnusableInput(f"{path} holds vectors of different lengths ({told}); name those of one record")
    (length,) = lengths
    names = tuple(name for name in names if len(found[name]) == length)
    missing = [name for name in wanted if not find(names, name)]
    if missing:
        raise UnusableInput(f"{path} has no vector {missing[0]!r}; there are {listed(names)}; name one of them")
    return Table(str(path), names, tuple(found[name] for name in names), first_row=1, parse=_parse)


def _arrays(path: Path) -> dict[str, Any]:
    """Read all arrays, in a process of its own: the compiled reader crashes on some broken files.

    With -P no module of the folder that it is called in stands in the place of one that it imports.
    """
    ran = subprocess.run([sys.executable, "-P", "-c", READ, str(path)], capture_output=True, check=False)
    if ran.returncode:
        raise _broken(path, "its content makes no sense")
    answer = pickle.loads(ran.stdout)
    if isinstance(answer, str):
        raise _broken(path, answer)
    return _arrays_of_7_3(path) if answer is None else answer


def _arrays_of_7_3(path: Path) -> dict[str, Any]:
    try:
        import h5py  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise UnusableInput(
            f"{path} is a MATLAB file of version 7.3, which needs h5py; `pip install h5py`, or save it with '-v7'"
        ) from None
    try:
        with h5py.File(path) as file:
            return {name: np.asarray(held) for name, held in file.items() if isinstance(held, h5py.Dataset)}
    except Exception as error:  # h5py raises what it likes at a broken file
        raise _broken(path, str(error)) from None


def _broken(path: Path, error: str) -> UnusableInput:
    why = " ".join(error.split())[:200]
    return UnusableInput(f"{path} cannot be read as a MATLAB file ({why}); save it anew with '-v7'")


def _is_vector(value: Any) -> bool:
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "fiu":
        return False
    return value.size == max(value.shape, default=0) > 1


def _parse(column: np.ndarray) -> Float[np.ndarray, " T"]:
    return np.array(column, dtype=np.float64)
