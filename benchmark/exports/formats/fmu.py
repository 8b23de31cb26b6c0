"""`fmu`: model.fmu, FMI 2.0 for co-simulation, with its C source and a library for the machine that exports."""

from __future__ import annotations

import importlib.util
import tempfile
import uuid
import zipfile
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float

from simgap.exports.folders import About, file_in
from simgap.exports.formats import c
from simgap.exports.subjects import CheckRecord, Subject, refusal_of_step
from simgap.exports.texts import heading, variable_names

FILE = "model.fmu"
DESCRIPTION = """\
<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName={name} guid="{guid}" description={description}
    generationTool="simgap" variableNamingConvention="flat" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="model" canHandleVariableCommunicationStepSize="false">
    <SourceFiles><File name="model.c"/><File name="fmi2.c"/></SourceFiles>
  </CoSimulation>
  <DefaultExperiment startTime="0" stepSize="{dt}"/>
  <ModelVariables>
{variables}
  </ModelVariables>
  <ModelStructure>
    <Outputs>{unknowns}</Outputs>
    <InitialUnknowns>{unknowns}</InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""

refusal = refusal_of_step


def missing() -> str:
    """Say what is missing to build and to run it: a compiler and FMPy, which brings the headers of FMI."""
    return c.missing() or (
        "" if importlib.util.find_spec("fmpy") else "FMPy is not installed; pip install 'simgap[export]'"
    )


def description(subject: Subject, guid: str) -> str:
    """Write modelDescription.xml: inputs, outputs, and the state before the first step as parameters."""
    form, about = subject.form, subject.fitted_on
    inputs, outputs = variable_names(about.channels)
    units = [channel.unit for channel in about.channels.inputs + about.channels.outputs]
    variables = []
    for i, (name, unit) in enumerate(zip([*inputs, *outputs], units, strict=True)):
        role, start = ("input", ' start="0"') if i < form.nu else ("output", "")
        variables.append((name, unit, f'causality="{role}"', start))
    for i, value in enumerate(form.rest.tolist()):
        role = 'causality="parameter" variability="fixed" initial="exact"'
        variables.append((f"start[{i}]", "", role, f' start="{value!r}"'))
    lines = [
        f'    <ScalarVariable name={quoteattr(name)} valueReference="{i}" {role}'
        f"{f' description={quoteattr(unit)}' if unit else ''}><Real{start}/></ScalarVariable>"
        for i, (name, unit, role, start) in enumerate(variables)
    ]
    unknowns = "".join(f'<Unknown index="{form.nu + i + 1}"/>' for i in range(form.ny))
    return DESCRIPTION.format(
        name=quoteattr(subject.name), guid=guid, description=quoteattr(heading(subject)), dt=repr(about.dt),
        variables="\n".join(lines), unknowns=unknowns,
    )  # fmt: skip


def write(subject: Subject, folder: Path) -> None:
    """Compile the model and pack model.fmu."""
    import fmpy

    sources = c.sources(subject)
    guid = "{" + str(uuid.uuid5(uuid.NAMESPACE_URL, sources["model.c"] + sources["model.h"])) + "}"
    sources["model.h"] += f'#define MODEL_GUID "{guid}"\n'
    sources["fmi2.c"] = (c.C / "fmi2.c").read_text(encoding="utf-8")
    headers = Path(fmpy.__file__).parent / "c-code"
    with tempfile.TemporaryDirectory() as scratch, zipfile.ZipFile(folder / FILE, "w", zipfile.ZIP_DEFLATED) as fmu:
        for name, text in sources.items():
            (Path(scratch) / name).write_text(text, encoding="utf-8")
            fmu.writestr(f"sources/{name}", text)
        library = Path(scratch) / f"model{fmpy.sharedLibraryExtension}"
        files = [Path(scratch) / "model.c", Path(scratch) / "fmi2.c"]
        c.build(files, library, "-shared", "-fPIC", "-fvisibility=hidden", f"-I{headers}")
        fmu.write(library, f"binaries/{fmpy.platform}/{library.name}")
        fmu.writestr("modelDescription.xml", description(subject, guid))


def run(folder: Path, about: About, record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Run it by FMPy: at each sample the inputs are set, the outputs read, and a step is done."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    file = file_in(folder, FILE)
    nu, ny = record.u.shape[1], record.y_hat.shape[1]
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        described: Any = fmpy.read_model_description(file, validate=True)
        fmpy.extract(file, unzipdir=scratch)
        identifier = described.coSimulation.modelIdentifier
        slave = FMU2Slave(
            guid=described.guid, unzipDirectory=scratch, modelIdentifier=identifier, instanceName=identifier
        )
        references = [variable.valueReference for variable in described.modelVariables]
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.setReal(references[nu + ny :], record.start.tolist())
        slave.exitInitializationMode()
        for k, u in enumerate(record.u[record.n :].tolist()):
            slave.setReal(references[:nu], u)
            rows.append(slave.getReal(references[nu : nu + ny]))
            slave.doStep(k * about.dt, about.dt)
        slave.terminate()
        slave.freeInstance()
    return np.array(rows)
