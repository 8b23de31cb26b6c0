"""`c`: model.c and model.h in C99 with one step function, and main.c that runs it."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from jaxtyping import Float

from simgap.exports.c99 import PREAMBLE, translate
from simgap.exports.folders import About
from simgap.exports.formats.python import run_program
from simgap.exports.subjects import CheckRecord, Subject, refusal_of_step
from simgap.exports.texts import heading, numbers
from simgap.records import UnusableInput

# A product and a sum are rounded one after the other, as in our own run.
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
HEADER = """\
/* {heading} */
#ifndef SIMGAP_MODEL_H
#define SIMGAP_MODEL_H

#define MODEL_INPUTS {nu}
#define MODEL_OUTPUTS {ny}
#define MODEL_STATES {ns}
#define MODEL_DT {dt} /* s, the time from sample to sample */

extern const double model_rest[];  /* the state at rest */
extern const double model_start[]; /* the state that record.csv starts from */

/* Fill the outputs y of a sample from its inputs u; take the state s from before the sample to before the next one.
   inputs: {inputs}; outputs: {outputs} */
void model_step(double *s, const double *u, double *y);

#endif
"""
C = Path(__file__).parents[1] / "c"  # what is the same for every model

refusal = refusal_of_step


def missing() -> str:
    """Say what is missing to run it: a compiler, named by CC, else cc."""
    return "" if shutil.which(_compiler()) else "there is no C compiler; install gcc, or name one in CC"


def sources(subject: Subject) -> dict[str, str]:
    """Write model.h and model.c."""
    form, about = subject.form, subject.fitted_on
    names = [[c.name for c in part] for part in (about.channels.inputs, about.channels.outputs)]
    inputs, outputs = (", ".join(ascii(name).replace("*/", "* /") for name in part) for part in names)
    header = HEADER.format(
        heading=heading(subject), nu=form.nu, ny=form.ny, ns=len(form.rest), dt=repr(about.dt), inputs=inputs,
        outputs=outputs,
    )  # fmt: skip
    arrays = {**form.constants}
    constants = "".join(f"static const double {name}[] = {{{numbers(v)}}};\n" for name, v in arrays.items() if len(v))
    states = {"model_rest": form.rest, "model_start": subject.records[0].start}
    # An array of C has a length.
    constants += "".join(
        f"const double {name}[] = {{{numbers(v if len(v) else [0.0])}}};\n" for name, v in states.items()
    )
    body = translate(form.source, [name for name, value in arrays.items() if len(value)])
    entry = "void model_step(double *s, const double *u, double *y) {\n    step(s, u, y);\n}\n"
    head = f'/* {heading(subject)} */\n#include <math.h>\n#include "model.h"\n\n{PREAMBLE}\n'
    return {"model.h": header, "model.c": f"{head}{constants}\n{body}\n{entry}"}


def write(subject: Subject, folder: Path) -> None:
    """Write model.c, model.h and main.c."""
    main = (C / "main.c").read_text(encoding="utf-8")
    for name, text in {**sources(subject), "main.c": main}.items():
        (folder / name).write_text(text, encoding="utf-8")


def _compiler() -> str:
    return os.environ.get("CC", "cc")


def build(files: list[Path], out: Path, *flags: str) -> None:
    """Compile C files. Raises UnusableInput with what the compiler says."""
    command = [_compiler(), *FLAGS, *flags, *map(str, files), "-o", str(out), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise UnusableInput(f"{files[0]} does not compile: {(done.stderr.strip().splitlines() or ['?'])[0]}")


def run(folder: Path, about: About, record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Compile the files outside the folder, and run them."""
    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "model"
        build([folder / "model.c", folder / "main.c"], program)
        return run_program([str(program)], record)
