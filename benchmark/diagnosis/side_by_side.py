"""One plant fitted to a machine and to somebody's simulation of it, to compare their numbers."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from simgap.diagnosis.gains import LARGEST_ERROR
from simgap.greybox.evidence import Evidence
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.identification import identify
from simgap.greybox.intervals import intervals
from simgap.greybox.model import FittedPlant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records
from simgap.greybox.simulation import Simulator
from simgap.greybox.terms import Term
from simgap.records import Dataset, Experiment
from simgap.their_simulation import Holds

# Shares of the simulation's squared error: what a model of the simulation may leave of it without a search for more,
# what one effect less may cost that the simulation then does without, and what is worth a word.
NEGLIGIBLE = 0.01
REPEATED = 0.002
MATTERS = 0.02


@dataclass(frozen=True, eq=False)
class SideBySide:
    """A machine's plant, with the effects of the machine and of the simulation, fitted to both.

    `own` are the effects that the machine was found to have, `theirs` those that the simulation cannot do without.
    """

    machine: FittedPlant
    own: tuple[Term, ...]
    simulation: Estimate
    theirs: tuple[Term, ...]
    error: Float[np.ndarray, "E T ny"]  # of the simulation on training data, in units of the noise; 0 where unknown
    variance: Float[np.ndarray, " ny"]  # of what was simulated there

    @classmethod
    def of(cls, machine: FittedPlant, dataset: Dataset, simulated: Dataset, seed: int) -> SideBySide:
        """Fit the machine's plant to the simulation too; where it does not fit, with the effects found there."""
        training = simulated.training.without_mere_starts()
        experiments = (*training.train, *training.valid)
        error = _error(machine, experiments, dataset.n_init)
        own, squares = machine.estimate.plant.terms, float(np.vdot(error, error))
        simulation = _fit(machine, experiments)
        if simulation.squares > NEGLIGIBLE * squares:
            found = _found(machine, simulated, seed)
            more = [t for t in found if not any(t.key == o.key or t.replaces(o) or o.replaces(t) for o in own)]
            if more:
                machine = _with_more(machine, more)
                simulation = min(simulation, _fit(machine, experiments), key=lambda fit: fit.squares)
        simulation = _without_superfluous(machine, simulation, experiments, own, REPEATED * squares)
        simulated_y = Records.of(experiments, machine.outputs).y[machine.records.mask]
        return cls(machine, own, simulation, simulation.plant.terms, error, np.var(simulated_y, axis=0))

    @property
    def terms(self) -> tuple[Term, ...]:
        """All effects, of the machine or of the simulation."""
        return self.machine.estimate.plant.terms

    def share(self, part: Term | None) -> float:
        """Compute the squared error that an effect (None: the linear part) makes when it is as in the simulation.

            |y_hat(machine) - y_hat(machine, but this part as in the simulation)|^2 / |y - y_sim|^2

        On training data, from the machine's initial states, each output in units of its noise.
        """
        wrong = self.corrected([one for one in (*self.terms, None) if one != part])
        change = _training_run(self.machine) - _training_run(wrong)
        change = self.machine.noise.whiten(np.clip(np.nan_to_num(change), -LARGEST_ERROR, LARGEST_ERROR))
        change = np.where(self.machine.records.mask[:, :, None], change, 0.0)
        return float(np.vdot(change, change) / max(np.vdot(self.error, self.error), 1e-300))

    def holds(self, term: Term) -> Holds | None:
        """Tell how the simulation has an effect; None where it has it as the machine does, or it matters little."""
        if term not in self.theirs:
            return "missing" if term in self.own else None
        if not self._outside(self.machine.estimate.plant.part_of(term), self.simulation.plant.part_of(term)):
            return None
        if self.share(term) < MATTERS:
            return None
        return "other size" if term in self.own else "not in the machine"

    def linear_differs(self) -> bool:
        """Tell whether numbers of the linear part lie outside the machine's intervals, and this matters."""
        return self._outside(self.linear, self.linear) and self.share(None) > MATTERS

    @property
    def linear(self) -> slice:
        """Where the numbers of the linear part stand, in either theta."""
        return slice(0, self.machine.estimate.plant.n_linear)

    def _outside(self, of_machine: slice, of_simulation: slice) -> bool:
        _, low, high = self.numbers(of_machine)
        theirs = self.simulation.theta[of_simulation]
        return bool(np.any((theirs < low) | (theirs > high)))

    def numbers(self, part: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return numbers of the machine with the ends of their intervals."""
        low, high = self._intervals
        return self.machine.estimate.theta[part], low[part], high[part]

    @cached_property
    def _intervals(self) -> tuple[np.ndarray, np.ndarray]:
        return intervals(self.machine)

    @property
    def unlike(self) -> float:
        """Share of the simulation's variance that its model does not repeat."""
        records, errors = self.machine.records, self.simulation.errors
        return float(np.max(np.mean(errors[records.mask] ** 2, axis=0) / np.maximum(self.variance, 1e-300)))

    def corrected(self, parts: Collection[Term | None]) -> FittedPlant:
        """Return the simulation's plant with some effects, and the linear part (None), as the machine has them."""
        machine, simulation = self.machine.estimate, self.simulation
        plant = machine.plant.having([term for term in self.terms if term in parts or term in self.theirs])
        theta, local = plant.carry(machine.plant, machine.theta, machine.local)
        of_simulation, _ = plant.carry(simulation.plant, simulation.theta, simulation.local)
        if None not in parts:
            theta[self.linear] = of_simulation[self.linear]
        for term in self.theirs:
            if term not in parts:
                theta[plant.part_of(term)] = of_simulation[plant.part_of(term)]
        return replace(self.machine, estimate=replace(machine, plant=plant, theta=theta, local=local))


def _training_run(fitted: FittedPlant) -> Float[np.ndarray, "E T ny"]:
    estimate = fitted.estimate
    return Simulator(estimate.plant, fitted.records.u, fitted.records.past).run(estimate.theta, estimate.local)


def _error(machine: FittedPlant, simulated: Sequence[Experiment], n_init: int) -> Float[np.ndarray, "E T ny"]:
    theirs = Records.of(simulated, machine.outputs)
    error = np.where(machine.records.mask[:, :, None], machine.records.y - theirs.y, 0.0)
    error[:, :n_init] = 0.0
    return machine.noise.whiten(error)


def _fit(machine: FittedPlant, simulated: Sequence[Experiment], terms: Sequence[Term] | None = None) -> Estimate:
    """Fit the machine's plant, or with some of its effects only, to the simulation."""
    estimate = machine.estimate
    plant = estimate.plant.having(estimate.plant.terms if terms is None else terms).of_all
    theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
    records = replace(Records.of(simulated, machine.outputs), soft=machine.records.soft)
    return descend(Problem(plant, records, machine.noise), theta, local)


def _without_superfluous(
    machine: FittedPlant, fit: Estimate, simulated: Sequence[Experiment], own: Sequence[Term], enough: float
) -> Estimate:
    """Take out effects that the simulation is repeated without, as well or nearly so; first what the machine lacks."""
    while fit.plant.terms:
        smaller = [
            (term, _fit(machine, simulated, [t for t in fit.plant.terms if t != term])) for term in fit.plant.terms
        ]
        least = min(one.squares for _, one in smaller)
        if least > max(enough, fit.squares + enough):
            break
        alike = [one for one in smaller if one[1].squares <= max(enough, least)]
        fit = min(alike, key=lambda one: (one[0] in own, one[1].squares))[1]
    return fit


def _found(machine: FittedPlant, simulated: Dataset, seed: int) -> list[Term]:
    """Search the simulation for effects, under noise as large as the machine's, so that only what could show does."""
    training, outputs = simulated.training, list(machine.outputs)
    errors = machine.estimate.errors[machine.records.mask]
    rng = np.random.default_rng(seed)

    def noisy(x: Experiment) -> Experiment:
        y = x.y.copy()
        y[:, outputs] += np.sqrt(np.mean(errors**2, axis=0)) * rng.standard_normal((len(x), len(outputs)))
        return replace(x, y=y)

    data = replace(training, train=tuple(map(noisy, training.train)), valid=tuple(map(noisy, training.valid)))
    for one in identify(data):
        if one.selection.baseline.outputs == machine.outputs:
            return Evidence(one, simulated.channels).terms
    return []


def _with_more(machine: FittedPlant, terms: Sequence[Term]) -> FittedPlant:
    """Fit the machine with effects of the simulation beside its own."""
    estimate = machine.estimate
    plant = estimate.plant.having([*estimate.plant.terms, *terms])
    theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
    for term in terms:
        starts, common = plant.starts_of(term), len(plant.common_of(term))
        if starts:
            theta[plant.part_of(term)] = starts[0].values[len(starts[0].values) - common :]
    fitted = descend(Problem(plant, machine.records, machine.noise), theta, local)
    return replace(machine, estimate=fitted)
