"""Fitted grey boxes: one plant with its effects, and the model of a whole data set made of such plants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.greybox.baseline import TOLERANCE, Baseline
from simgap.greybox.effects.scales import SignalScales
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.initial_states import UsualStart, initial_states, usual_start
from simgap.greybox.machine import Machine
from simgap.greybox.noise import Noise, white
from simgap.greybox.outliers import Outliers, flag, without_outliers
from simgap.greybox.past import Past
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records, pieces_of
from simgap.greybox.simulation import Simulator
from simgap.greybox.terms import PlantScales, Term
from simgap.greybox.uncertainty import Uncertainty, uncertainty
from simgap.known_plant import Known, KnownPlant
from simgap.records import LARGEST_VALUE, Experiment

OWN_STEPS = 5  # of the numbers of one experiment; one is enough where the output is linear in them


@dataclass(frozen=True, eq=False)
class FittedPlant:
    """One plant with its effects, fitted to all training data; `noise` weighs its outputs against each other."""

    estimate: Estimate
    noise: Noise
    outputs: tuple[int, ...]  # of the data set
    records: Records
    experiments: tuple[Experiment, ...]
    outliers: tuple[Outliers, ...] = ()
    usual: UsualStart | None = None
    known_uncertainty: Uncertainty | None = None  # of a plant without its training data, or fitted to pieces of them

    @classmethod
    def fit(cls, start: Estimate, baseline: Baseline, experiments: Sequence[Experiment]) -> FittedPlant:
        """Fit a model that was found on excerpts to all of the experiments.

        A plant that carries errors on is fitted to pieces of long records, as its effects were found: over a whole one
        the least offset leads away from the readings, and what else is fitted would make up for it.
        """
        plant, noise, theta = start.plant, baseline.noise, start.theta
        everything = np.ones(len(theta), dtype=bool)
        tolerance = 1e-3 if plant.machine is None else TOLERANCE  # its many runs tell more than enough

        def usable(experiments: Sequence[Experiment]) -> tuple[Problem, np.ndarray]:
            problem = Problem(plant, Records.of(experiments, baseline.outputs), noise)
            first = descend(problem, theta, fixed=everything)
            records = problem.records
            if baseline.outliers:
                records = without_outliers(records, first.errors, baseline.outliers)
            return Problem(plant, replace(records, soft=baseline.train.soft), noise), first.local

        problem, local = usable(experiments)
        fixed, told = None, None
        if baseline.cut and baseline.keeps_errors:
            pieces, of_pieces = usable(pieces_of(experiments))
            found = descend(pieces, theta, of_pieces, tolerance=tolerance)
            theta, fixed, told = found.theta, everything, uncertainty(found, noise, pieces.records)
        estimate = descend(problem, theta, local, fixed, tolerance=tolerance)
        usual = usual_start(estimate.of_all, problem.records, noise, baseline.n_init)
        return cls(
            estimate, noise, baseline.outputs, problem.records, tuple(experiments), baseline.outliers, usual, told
        )

    def saved_state(self) -> dict[str, Any]:
        """What simulates; the training data and their errors stay behind."""
        return {"plant": self.estimate.plant, "theta": self.estimate.theta, "noise": self.noise,
                "outputs": self.outputs, "outliers": self.outliers, "usual": self.usual,
                "uncertainty": self.uncertainty}  # fmt: skip

    @cached_property
    def uncertainty(self) -> Uncertainty | None:
        """The covariance of theta; None where it is not known."""
        if self.known_uncertainty or not self.experiments:
            return self.known_uncertainty
        return uncertainty(self.estimate, self.noise, self.records)

    @classmethod
    def from_saved(cls, state: dict[str, Any]) -> FittedPlant:
        """Build a plant without training data. Raises ValueError for parameters that are not those of the plant."""
        plant, theta, noise = state["plant"], np.asarray(state["theta"], dtype=np.float64), state["noise"]
        if theta.shape != (len(plant.free),) or len(noise.deviations) != plant.ny or len(state["outputs"]) != plant.ny:
            raise ValueError("the parameters are not those of such a plant")
        if state["usual"] is not None and len(state["usual"].mean) != plant.order:
            raise ValueError("the usual start is not that of such a plant")
        known = state.get("uncertainty")  # files of before have none
        if known is not None and known.covariance.shape != 2 * theta.shape:
            raise ValueError("the covariance is not that of such parameters")
        nothing = Records.measured(np.empty((0, 0, plant.nu)), np.empty((0, 0, plant.ny)), plant.dt)
        estimate = Estimate(plant, theta, np.empty((0, plant.n_local)), nothing.y, np.nan, True)
        return cls(
            estimate, noise, tuple(state["outputs"]), nothing, (), tuple(state["outliers"]), state["usual"], known
        )

    @cached_property
    def forecast(self) -> Estimate:
        """The model without what belongs to single experiments and cannot be forecast."""
        return self.estimate.of_all

    def simulate_whole(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"],
        past: Past | None = None,
    ) -> Float[np.ndarray, "B T ny"]:  # fmt: skip
        """Simulate all rows, from the initial state that suits the n measured samples best."""
        plant, theta = self.forecast.plant, self.forecast.theta
        return Simulator(plant, u, past).run(theta, self.start(u, y_init, past))

    def simulate_training(self) -> Float[np.ndarray, "E T ny"]:
        """Simulate the training records from the initial states that suit all of each best."""
        one = self.forecast
        return Simulator(one.plant, self.records.u, self.records.past).run(one.theta, one.local)

    def start(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"],
        past: Past | None = None,
    ) -> Float[np.ndarray, "B q"]:  # fmt: skip
        """Find the initial states: from the first n samples, and from where the training records start."""
        plant, theta, n = self.forecast.plant, self.forecast.theta, y_init.shape[1]
        beginning = Problem(plant, Records.measured(u[:, :n], y_init, plant.dt, past), self.noise)
        found = initial_states(beginning, theta)
        return self.usual.beside(beginning, theta, found) if self.usual else found

    def contributions(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T e"]:
        """Simulate what each effect does to the first output: all effects less all but it, from the same start."""
        plant, theta = self.forecast.plant, self.forecast.theta
        if not plant.terms:
            return np.zeros((*u.shape[:2], 0))
        start = self.start(u, y_init)
        whole = Simulator(plant, u).run(theta, start)
        contributions = []
        for term in plant.terms:
            rest = plant.having([other for other in plant.terms if other != term])
            of_rest, local = rest.carry(plant, theta, start)
            contributions.append(whole[:, :, 0] - Simulator(rest, u).run(of_rest, local)[:, :, 0])
        return np.stack(contributions, axis=2)

    def simulate_anew(self, experiment: Experiment, n_init: int) -> Float[np.ndarray, "N ny"]:
        """Simulate rows n_init .. T-1 with what belongs to this experiment alone estimated from all of it."""
        plant, outputs = self.estimate.plant, list(self.outputs)
        u, y, past = experiment.u[None], experiment.y[None][:, :, outputs], Past.of([experiment])
        start = self.start(u, y[:, :n_init], past)
        y_hat = Simulator(self.forecast.plant, u, past).run(self.forecast.theta, start)[0, n_init:]
        if not np.max(np.abs(y_hat), initial=0.0) < LARGEST_VALUE:
            return y_hat  # it grew without bound, which nothing of this experiment can mend
        if plant.per_experiment:
            y_hat = self._with_own(Records.measured(u, y, experiment.dt, past), start, n_init)
        if self.outliers:
            error = y[0, n_init:] - y_hat
            flags = flag(error[None], np.ones((1, len(error)), dtype=bool), self.outliers)[0]
            for j in (outliers.output for outliers in self.outliers):
                y_hat[flags[:, j], j] += error[flags[:, j], j]
        return y_hat

    def _with_own(self, record: Records, start: np.ndarray, n_init: int) -> Float[np.ndarray, "N ny"]:
        """Simulate with the numbers of this experiment that suit all of it best (Gauss-Newton), from the same start."""
        plant, theta = self.estimate.plant, self.estimate.theta
        _, local = plant.carry(self.forecast.plant, self.forecast.theta, start)
        later = np.arange(record.mask.shape[1])[None] >= n_init
        problem = Problem(plant, replace(record, mask=later), white(self.noise.deviations))
        own, of_none = slice(plant.n_start, plant.n_local), np.zeros(plant.size, dtype=bool)
        errors = problem.errors(theta, local)
        for _ in range(OWN_STEPS):
            slopes = problem.jacobian(theta, local, of_none)
            if not slopes.finite:
                break
            step = np.linalg.lstsq(slopes.local[own, 0].T, problem.noise.whiten(errors).ravel(), rcond=None)[0]
            attempt = local.copy()
            attempt[0, own] += step
            left = problem.errors(theta, attempt)
            if not np.sum(left**2) < np.sum(errors**2):
                break
            local, errors = attempt, left
        return problem.simulator.run(theta, local)[0, n_init:]

    def sizes_of_own(self, term: Term) -> Float[np.ndarray, " E"]:
        """Measure what a term has anew in every training experiment."""
        plant, measured = self.estimate.plant, self.records.mask
        own = self.estimate.local[:, plant.own_part_of(term)]
        middles = self.records.dt * (np.arange(measured.shape[1]) + 0.5)
        shapes = term.effect.shapes(middles, self.records.duration, self.estimate.theta[plant.part_of(term)])
        return term.effect.size(own, own @ shapes, measured)

    def log_likelihood(self) -> float:
        """Compute the log-likelihood of the errors as white noise, up to a constant."""
        e = self.estimate.errors[self.records.mask]
        return float(-0.5 * len(e) * np.sum(np.log(np.maximum(np.mean(e * e, axis=0), self.records.resolution**2))))


@dataclass(eq=False)
class GreyBoxModel:
    """A model of a data set: one fitted plant for each of its outputs, or for a position with its velocity."""

    parts: ClassVar = (  # records in a saved model
        FittedPlant, Known, KnownPlant, Machine, Noise, Outliers, Plant, PlantScales, SignalScales, Term, Uncertainty,
        UsualStart,
    )  # fmt: skip
    saved_as: ClassVar = "greybox"
    takes_known: ClassVar = True  # what is known of the machine

    plants: list[FittedPlant] = field(default_factory=list, repr=False)

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"],
        past: Past | None = None,
    ) -> Float[np.ndarray, "B T-n ny"]:  # fmt: skip
        """Simulate from the state found in the n measured samples; what belongs to one experiment is not forecast.

        The records begin where their runs do if nothing is said of their past.
        """
        return self.simulate_whole(u, y_init, past)[:, y_init.shape[1] :]

    def simulate_whole(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"],
        past: Past | None = None,
    ) -> Float[np.ndarray, "B T ny"]:  # fmt: skip
        """Simulate all rows from that state, those of the measured samples too."""
        y_hat = np.empty((*u.shape[:2], y_init.shape[2]))
        for plant in self.plants:
            outputs = list(plant.outputs)
            y_hat[:, :, outputs] = plant.simulate_whole(u, y_init[:, :, outputs], past)
        return y_hat

    def simulate_anew(self, experiment: Experiment, n_init: int) -> Float[np.ndarray, "N ny"]:
        """Simulate one experiment, with the parameters that belong to it alone estimated from it."""
        y_hat = np.empty((len(experiment) - n_init, experiment.y.shape[1]))
        for plant in self.plants:
            y_hat[:, list(plant.outputs)] = plant.simulate_anew(experiment, n_init)
        return y_hat

    def log_likelihood(self) -> float:
        """Compute that of the training errors, as white noise on each output, up to a constant."""
        return sum(plant.log_likelihood() for plant in self.plants)

    @property
    def own_numbers(self) -> tuple[int, ...]:
        """Numbers that `simulate_anew` fits to an experiment, of each output."""
        of_output = {output: plant.estimate.plant.n_own for plant in self.plants for output in plant.outputs}
        return tuple(of_output[output] for output in sorted(of_output))

    @property
    def n_params(self) -> int:
        """Numbers that a simulation uses."""
        return sum(int(plant.forecast.plant.free.sum()) for plant in self.plants)

    @property
    def fitted(self) -> dict[str, Any]:
        """Order of each plant and its effects."""
        plants = [plant.estimate.plant for plant in self.plants]
        return {
            "order": [plant.order for plant in plants],
            "effects": [[term.effect.name for term in plant.terms] for plant in plants],
        }
