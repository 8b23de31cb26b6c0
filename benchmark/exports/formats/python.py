"""`python`: one file without a dependency, model.py."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
from jaxtyping import Float

from simgap.exports.folders import About
from simgap.exports.subjects import CheckRecord, Subject, refusal_of_step
from simgap.exports.texts import heading, numbers, variable_names
from simgap.records import UnusableInput

FILE = "model.py"
REST_OF_FILE = '''

def simulate(u, start=None):
    """Run free over rows of inputs, from a state (at rest unless given); give the rows of outputs."""
    s, rows = list(REST if start is None else start), []
    for row in u:
        y = [0.0] * len(OUTPUTS)
        step(s, [float(value) for value in row], y)
        rows.append(y)
    return rows


if __name__ == "__main__":  # python model.py < lines: the state, then the inputs of each sample; prints the outputs
    import sys

    start, *rows = [[float(value) for value in line.split()] for line in sys.stdin]
    for outputs in simulate(rows, start):
        print(*map(repr, outputs))
'''

refusal = refusal_of_step


def missing() -> str:
    """Say what is missing to run it: nothing."""
    return ""


def parts(subject: Subject, imports: str = "") -> str:
    """Write what comes before the functions: the heading, imports, names of the channels, and numbers."""
    form, about = subject.form, subject.fitted_on
    inputs, outputs = variable_names(about.channels)
    lines = [f'"""{heading(subject)}', "", "step(s, u, y) fills the outputs y of a sample from its inputs u and takes",
             "the state s from before the sample to before the next one; all three are lists of floats.", '"""', "",
             "import math", *(["", imports] if imports else [""]),
             f"DT = {about.dt!r}  # s, the time from sample to sample",
             f"INPUTS = {inputs!a}", f"OUTPUTS = {outputs!a}"]  # fmt: skip
    lines += [f"{name} = [{numbers(value)}]" for name, value in form.constants.items()]
    lines.append(f"REST = [{numbers(form.rest)}]  # the state at rest")
    lines.append(f"START = [{numbers(subject.records[0].start)}]  # the state that record.csv starts from")
    return "\n".join(lines) + "\n"


def write(subject: Subject, folder: Path) -> None:
    """Write model.py."""
    (folder / FILE).write_text(parts(subject) + "\n\n" + subject.form.source + REST_OF_FILE, encoding="utf-8")


def run(folder: Path, about: About, record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Run model.py in a Python that sees no installed package."""
    return run_program([sys.executable, "-I", "-S", str((folder / FILE).resolve())], record)


def run_program(command: list[str], record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Run a program that reads the state and the inputs, and prints the outputs. Raises UnusableInput if it fails."""
    lines = [record.start, *record.u[record.n :]]
    given = "".join(" ".join(map(repr, row.tolist())) + "\n" for row in lines)
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=False)
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or [f"it ended with {done.returncode}"])[-1]
        raise UnusableInput(f"{command[-1]} does not run: {reason}")
    try:
        rows = [[float(value) for value in line.split()] for line in done.stdout.splitlines()]
        return np.array(rows).reshape(len(rows), -1)
    except ValueError as error:
        raise UnusableInput(f"{command[-1]} prints something else than its outputs: {error}") from error
