"""`control`: system.py, a system of python-control: StateSpace around an operating point, or a nonlinear system."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.exports.folders import About
from simgap.exports.formats import python
from simgap.exports.subjects import CheckRecord, Subject, refusal_of_step
from simgap.exports.texts import heading, numbers, variable_names
from simgap.records import UnusableInput

FILE = "system.py"
LINEAR = '''\
"""{heading}

SYSTEM describes deviations from the operating point: its input is u - U_MEAN, its output y - Y_MEAN.
"""

import control
import numpy as np

{matrices}
U_MEAN = [{u_mean}]
Y_MEAN = [{y_mean}]
START = [{start}]  # the state that record.csv starts from

SYSTEM = control.StateSpace(A, B, C, D, {dt!r}, inputs={inputs!a}, outputs={outputs!a})
'''
NONLINEAR = '''

def after(t, x, u, params):
    """Return the state at the next sample."""
    s, y = [float(value) for value in x], [0.0] * len(OUTPUTS)
    step(s, [float(value) for value in u], y)
    return s


def reading(t, x, u, params):
    """Return the outputs."""
    s, y = [float(value) for value in x], [0.0] * len(OUTPUTS)
    step(s, [float(value) for value in u], y)
    return y


SYSTEM = control.nlsys(after, reading, inputs=INPUTS, outputs=OUTPUTS, states=len(REST), dt=DT, name="plant")
'''

refusal = refusal_of_step


def missing() -> str:
    """Say what is missing to run it: nothing, simgap needs python-control itself."""
    return ""


def write(subject: Subject, folder: Path) -> None:
    """Write system.py."""
    polynomial = getattr(subject.model, "polynomial", None)
    text = _nonlinear(subject) if polynomial is None else _linear(subject, polynomial)
    (folder / FILE).write_text(text, encoding="utf-8")


def _linear(subject: Subject, polynomial: Any) -> str:
    matrices = []
    for name, matrix in zip("ABCD", polynomial.state_space, strict=True):
        rows, columns = matrix.shape
        matrices.append(f"{name} = np.reshape([{numbers(matrix.ravel())}], ({rows}, {columns}))")
    inputs, outputs = variable_names(subject.fitted_on.channels)
    start = subject.records[0].start[: len(polynomial.state_space[0])]
    return LINEAR.format(
        heading=heading(subject), matrices="\n".join(matrices), u_mean=numbers(polynomial.u_mean),
        y_mean=numbers(polynomial.y_mean), start=numbers(start), dt=subject.fitted_on.dt,
        inputs=inputs, outputs=outputs,
    )  # fmt: skip


def _nonlinear(subject: Subject) -> str:
    return python.parts(subject, "import control\n") + "\n\n" + subject.form.source + NONLINEAR


def imported(file: Path) -> Any:
    """Import a file that an export wrote. Raises UnusableInput."""
    if not file.is_file():
        raise UnusableInput(f"{file} is missing; export once more")
    spec = importlib.util.spec_from_file_location(f"simgap_export_{file.stem}", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # an edited file may fail in any way
        raise UnusableInput(f"{file} does not import: {error!r}") from error
    finally:
        sys.dont_write_bytecode = writes
    return module


def run(folder: Path, about: About, record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Have python-control compute the response."""
    import control

    respond: Any = control.input_output_response  # annotated for numbers, and takes arrays
    respond_linearly: Any = control.forced_response
    module = imported(folder / FILE)
    u = record.u[record.n :]
    t = about.dt * np.arange(len(u))
    if hasattr(module, "U_MEAN"):
        start = record.start[: module.SYSTEM.nstates]
        done = respond_linearly(module.SYSTEM, t, (u - module.U_MEAN).T, start, squeeze=False)
        return np.asarray(done.outputs).T + module.Y_MEAN
    done = respond(module.SYSTEM, t, u.T, record.start, squeeze=False)
    return np.asarray(done.outputs).T
