"""`simgap.choose_record`: which of the records that could be taken to take next."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.cores import all_cores
from simgap.data.formats.plant_table import with_known
from simgap.data.kinds import with_kinds
from simgap.data.loading import read
from simgap.diagnosis import doubts
from simgap.experiment_design.candidates import read_candidates
from simgap.experiment_design.separation import CHUNK
from simgap.greybox.identification import Identified, identify
from simgap.greybox.model import FittedPlant
from simgap.greybox.normal_equations import LARGEST_SLOPE, Jacobian, NormalEquations
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records
from simgap.records import Dataset, Experiment, UnusableInput
from simgap.wording import percent

SHOWN = 5


@dataclass(frozen=True, eq=False)
class Choice:
    """The candidates, the best one to take next first.

    `left` is the share of the expected squared error over all candidates that is left once the numbers of the model
    are fitted to that one too; it counts what uncertain numbers bring, not what the model lacks.
    """

    dataset: str
    effects: tuple[str, ...]
    names: tuple[str, ...]
    left: tuple[float, ...]
    taken: tuple[str, ...]

    @property
    def best(self) -> str:
        """The candidate to take next."""
        return self.names[0]

    def to_json(self) -> dict[str, Any]:
        """Return the same as JSON."""
        ranked = [{"name": name, "left": left} for name, left in zip(self.names, self.left, strict=True)]
        return {"schema": 1, "dataset": self.dataset, "effects": list(self.effects), "candidates": ranked,
                "taken": list(self.taken)}  # fmt: skip

    def __str__(self) -> str:
        model = f"the linear model with {', '.join(self.effects)}" if self.effects else "the plain linear model"
        told = (
            f"{self.dataset}: Take {self.best} next. The parameters of {model} are not certain yet, so it would err on "
            f"the candidates; a fit to this record too leaves {percent(self.left[0])} of that squared error."
        )
        width = max(map(len, self.names[:SHOWN]))
        rows = [f"  {name:{width}}  {percent(left):>8}" for name, left in zip(self.names, self.left, strict=True)]
        title = "Squared error that is left after a fit to each, too"
        parts = [textwrap.fill(told, 100), "\n".join([title, *rows[:SHOWN]])]
        if self.taken:
            several = "candidates have" if len(self.taken) > 1 else "candidate has"
            parts.append(f"{len(self.taken)} {several} the inputs of an existing record: left out.")
        parts.append(textwrap.fill(
            "What the model lacks is not counted: an effect that none of the records shows has no parameters yet. "
            "Diagnose again with the new record before the next choice.", 100))  # fmt: skip
        return "\n\n".join(parts)


def choose_record(
    data: Any,
    candidates: str | Path | Mapping[str, np.ndarray],
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
    kind: str | Mapping[str, str] | None = None,
    known: Mapping[str, Any] | None = None,
) -> Choice:
    """Rank records that could be taken by how well all of them could be simulated afterwards.

        min over k of sum_i tr(A_i (H + H_k + P)^-1)

    H is the information of the records at hand about the numbers of the model, H_k that of candidate k, its initial
    state unknown, A_i the mean square of the slopes of candidate i, in noise, and P holds each number within its own
    size (I-optimality, one record after the other: Fedorov, Theory of Optimal Experiments, 1972, ch. 2 and 4).
    `candidates` is a file or a folder of files with the input columns of the data, or inputs [T, nu] by name; outputs
    are not read. `data`, `inputs`, `outputs`, `dt`, `kind` and `known` as in `simgap.diagnose`. Raises
    UnusableInput.
    """
    dataset = data if isinstance(data, Dataset) else read(data, inputs, outputs, dt).dataset
    dataset = with_known(with_kinds(dataset, kind), known)
    given = candidates if isinstance(candidates, Mapping) else read_candidates(Path(candidates), dataset)
    training = dataset.training
    if doubt := doubts.of_records(training, dataset.channels):
        raise UnusableInput(f"{dataset.name}: {doubt}")
    with all_cores():
        return ranked(dataset, identify(training), given)


def ranked(dataset: Dataset, identified: Sequence[Identified], candidates: Mapping[str, np.ndarray]) -> Choice:
    """Rank candidates by a model that is identified already. Raises UnusableInput where none is new."""
    channels, dt = dataset.channels, dataset.training.dt
    records = [Experiment(name, u, np.zeros((len(u), len(channels.outputs))), dt) for name, u in candidates.items()]
    if wrong := [x.name for x in records if x.u.shape[1] != len(channels.inputs) or len(x) < 2]:
        raise UnusableInput(f"candidate {wrong[0]} has to hold two samples or more of {len(channels.inputs)} inputs")
    at_hand = dataset.training.train + dataset.training.valid
    new = [k for k, x in enumerate(records) if not any(np.array_equal(x.u, old.u) for old in at_hand)]
    if not new:
        raise UnusableInput("there is no candidate whose inputs are not those of a record at hand")
    before, after = 0.0, np.zeros(len(new))
    for one in identified:
        now, then = _expected(one.plant, records, new)
        before, after = before + now, after + then
    order = np.argsort(after, kind="stable")
    left = after[order] / before if before > 0 else np.ones(len(new))
    effects = dict.fromkeys(term.effect.title for one in identified for term in one.plant.forecast.plant.terms)
    names = tuple(records[new[k]].name for k in order)
    taken = tuple(x.name for x in records if x.name not in names)
    return Choice(dataset.name, tuple(effects), names, tuple(map(float, left)), taken)


def _expected(fitted: FittedPlant, candidates: Sequence[Experiment], new: Sequence[int]) -> tuple[float, np.ndarray]:
    """Compute the expected squared error over the candidates, in noise: today, and with each new one."""
    plant, theta, local = fitted.forecast.plant, fitted.forecast.theta, fitted.forecast.local
    sizes = Problem(plant, fitted.records, fitted.noise).sizes(theta)[plant.free]
    held, _ = _of_each(fitted, Records.of(fitted.experiments, fitted.outputs), theta, local, sizes)
    records = Records.of(candidates, fitted.outputs)
    start = np.repeat(local.mean(axis=0, keepdims=True), len(candidates), axis=0)
    if plant.machine is not None and plant.machine.controlled:
        goal = records.u[:, 0, plant.machine.of_drive]
        start[:, 0] = goal * plant.machine.known.goal_factor  # where its controller holds it
    more, slopes = _of_each(fitted, records, theta, start, sizes)
    total, known = slopes.sum(axis=0), held.sum(axis=0) + np.eye(len(sizes))
    after = [float(np.trace(total @ np.linalg.inv(known + more[k]))) for k in new]
    return float(np.trace(total @ np.linalg.inv(known))), np.array(after)


def _of_each(
    fitted: FittedPlant, records: Records, theta: np.ndarray, start: np.ndarray, sizes: np.ndarray
) -> tuple[Float[np.ndarray, "E f f"], Float[np.ndarray, "E f f"]]:
    """Compute the information of each record, its start unknown, and the mean square of its slopes.

    Both are of the free numbers, each in units of its own size.
    """
    plant, at_once = fitted.forecast.plant, max(1, CHUNK // records.u.shape[1])
    information, slopes = np.empty((2, len(records.u), len(sizes), len(sizes)))
    for first in range(0, len(records.u), at_once):
        some = np.arange(first, min(first + at_once, len(records.u)))
        jacobian = Problem(plant, records.only(some), fitted.noise).jacobian(theta, start[some], plant.free)
        of_theta, of_start = _numbers(jacobian.theta[plant.free]) * sizes[:, None, None], _numbers(jacobian.local)
        for i, k in enumerate(some):
            of_one = Jacobian.of(of_theta[:, [i]], of_start[:, [i]])
            normal = NormalEquations.of(of_one, np.zeros_like(of_one.slopes[0]))
            information[k], _ = normal.reduced(0.0)
            slopes[k] = normal.h / (plant.ny * records.mask[k].sum())
    return information, slopes


def _numbers(slopes: Float[np.ndarray, "p E M"]) -> Float[np.ndarray, "p E M"]:
    """Take a simulation that grows without bound for one that tells nothing."""
    return np.where(np.all(np.abs(slopes) < LARGEST_SLOPE, axis=(0, 2), keepdims=True), slopes, 0.0)
