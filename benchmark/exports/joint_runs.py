"""joint.json, which stands beside the file of a robot simulator, and the run of a record in MuJoCo."""

from __future__ import annotations

import importlib.util
import json
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.exports.folders import About
from simgap.exports.joint_models import drives, start_of
from simgap.exports.joints import Joint, numbers_of
from simgap.exports.ranges import spread
from simgap.exports.subjects import CheckRecord, Subject
from simgap.records import UnusableInput

FILE = "joint.json"
# Simulator steps per sample: for linear joints, and for those with constraints or terms that depend on the motion.
SUBSTEPS = (16, 64)
# The difference that passes where the two integrate in steps of their own.
ROUGH_LIMIT = 1e-2
GAP_LIMIT = 3e-2  # where a second joint stands for backlash
STIFF = "0.9999 0.9999 0.001 0.5 2"  # impedance of a constraint that hardly gives way


def missing() -> str:
    """Say what is missing to run it: MuJoCo."""
    return "" if importlib.util.find_spec("mujoco") else "MuJoCo is not installed; pip install 'simgap[export]'"


def limit(joint: Joint) -> float:
    """The largest difference that passes as the same free run."""
    if any(one.get("gap") for one in joint.inputs):
        return GAP_LIMIT
    return ROUGH_LIMIT if joint.rough else 1e-6


def timestep(subject: Subject, joint: Joint) -> float:
    """The step of the simulator in s."""
    return subject.fitted_on.dt / SUBSTEPS[joint.rough]


def write(root: ET.Element, file: Path, subject: Subject, joint: Joint, remake: Callable[[Subject], Joint]) -> None:
    """Write the simulator's file, and joint.json: units, gains, which output is which, where each record starts.

    The ranges of what `remake` makes of other parameters stand in joint.json, and as a comment in the file.
    """
    ranges = spread(subject, lambda one: numbers_of(remake(one)))
    listed = "; ".join(f"{name} {low:.6g} to {high:.6g}" for name, (low, high) in ranges.items())
    if listed:
        root.insert(1, ET.Comment(f" to draw at random, in SI units: {listed} "))
    ET.indent(root)
    file.write_text(ET.tostring(root, encoding="unicode") + "\n", encoding="utf-8")
    fitted = subject.model.plants[0]
    plant, theta = fitted.forecast.plant, fitted.forecast.theta
    about: dict[str, Any] = {
        "kind": joint.kind, "si_per_unit": joint.scale, "inertia": joint.inertia, "gains": joint.gains,
        "effort": [one.get("clip") for one in joint.inputs], "substeps": SUBSTEPS[joint.rough],
        "inputs": list(drives(plant)), "of_velocity": plant.kind == "velocity", "outputs": list(fitted.outputs),
        "ranges": {name: list(both) for name, both in ranges.items()},
        "velocity_gain": float(theta[plant.layout.velocity][0]) if plant.two_outputs else 1.0,
        "starts": {record.name: asdict(start_of(subject, joint, record)) for record in subject.records},
    }  # fmt: skip
    (file.parent / FILE).write_text(json.dumps(about, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_joint(folder: Path) -> dict[str, Any]:
    """Read joint.json. Raises UnusableInput."""
    try:
        about: dict[str, Any] = json.loads((folder / FILE).read_text(encoding="utf-8"))
        return about
    except (OSError, ValueError) as error:
        raise UnusableInput(f"{folder / FILE} cannot be read; export once more") from error


def engine() -> Any:
    """Return MuJoCo; its functions are compiled, and a checker does not see them."""
    import mujoco

    return mujoco


def load(file: Path) -> Any:
    """Have MuJoCo read a model. Raises UnusableInput with what it says."""
    mujoco = engine()
    try:
        return mujoco.MjModel.from_xml_string(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UnusableInput(f"MuJoCo cannot read the model: {' '.join(str(error).split())}") from error


def run(
    model: Any, joint: Mapping[str, Any], about: About, record: CheckRecord, effort: bool
) -> Float[np.ndarray, "N ny"]:
    """Step MuJoCo through a record; `effort`: the inputs become a force on the joint, else they are the controls."""
    mujoco = engine()
    start, substeps, inputs = joint["starts"][record.name], joint["substeps"], record.u[:, joint["inputs"]]
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = start["position"], start["velocity"]
    for i, follower in enumerate(start["followers"]):
        data.qpos[1 + 2 * i] = follower  # the stem in the middle of the gap; it moves to the input at once
    if model.na:
        data.act[:] = [lag for lag, dynamics in zip(start["lags"], model.actuator_dyntype, strict=True) if dynamics]
    row, history = start["row"], 0 if effort else model.nu
    for i in range(history):
        if n := int(model.actuator_history[i][0]):
            times = model.opt.timestep * np.arange(-n, 0)
            rows = row + np.floor(times / about.dt + 1e-9).astype(int)
            mujoco.mj_initCtrlHistory(model, data, i, times, inputs[np.maximum(rows, 0), i])
    motion = []
    for u in inputs[row:]:
        motion.append((float(data.qpos[0]), float(data.qvel[0])))
        if effort:
            data.qfrc_applied[0] = force(joint, u)
        else:
            data.ctrl[:] = u
        for _ in range(substeps):
            mujoco.mj_step(model, data)
    x, v = np.array(motion).T
    columns = (v if joint["of_velocity"] else x, joint["velocity_gain"] * v)
    y = np.empty_like(record.y_hat)
    for output, values in zip(joint["outputs"], columns, strict=False):
        y[:, output] = values[record.n - row :] / joint["si_per_unit"]
    return y


def force(joint: Mapping[str, Any], u: Float[np.ndarray, " nu"]) -> float:
    """What the inputs make of force: gain u, each clipped to its effort."""
    clipped = [np.clip(one, *ends) if ends else one for one, ends in zip(u, joint["effort"], strict=True)]
    return float(np.dot(joint["gains"], clipped))
