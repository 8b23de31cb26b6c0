"""The plain linear model of one plant with the records it was fitted to: what a selection of effects starts from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from simgap.greybox import dynamics
from simgap.greybox.fitting import Estimate, best_descent
from simgap.greybox.held_out import block_errors, squares_of_blocks
from simgap.greybox.noise import Noise, white_as_large_as
from simgap.greybox.outliers import Outliers
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records
from simgap.greybox.terms import Term

MAX_STEPS = 40
# Of the variance of the errors: what a fit of the search may leave to gain. It moves no comparison of two models.
TOLERANCE = 0.1
ENOUGH_EXPERIMENTS = 3
PIECE = 20  # samples: enough to find a state, too few for an error to grow


@dataclass(frozen=True, eq=False)
class Baseline:
    """A plain linear model, with excerpts of the training and validation records."""

    train: Records
    valid: Records
    outputs: tuple[int, ...]  # of the data set
    estimate: Estimate
    n_init: int  # samples from which a record is simulated
    cut: bool = False  # long records were cut in pieces, so that nothing can be said of single experiments
    outliers: tuple[Outliers, ...] = ()  # found in the readings, and left out of both records
    orders: tuple[Estimate, ...] = ()  # plain models of all orders that were tried; none where the kind gives the order

    def __post_init__(self) -> None:
        """Weigh the errors of the plain model as those of all models that it is compared with."""
        weighed = replace(self.estimate, squares=self.problem(self.plant).squares(self.estimate.errors))
        object.__setattr__(self, "estimate", weighed)

    @property
    def plant(self) -> Plant:
        """The plant without effects."""
        return self.estimate.plant

    @property
    def repeated(self) -> bool:
        """Whether enough whole experiments are at hand to tell what changes from one to the next."""
        return not self.cut and len(self.train.u) >= ENOUGH_EXPERIMENTS

    @property
    def keeps_errors(self) -> bool:
        """Whether an error of the state stays to the end of a held-out record, as where the plant integrates."""
        return dynamics.keeps_errors(self.plant, self.estimate.theta, self.valid.duration)

    @property
    def resolution(self) -> Float[np.ndarray, " ny"]:
        """The smallest spread of each output that may count as likely, in training and in held-out data."""
        return self.train.resolution

    @cached_property
    def noise(self) -> Noise:
        """White noise as large as the errors of the plain model; it weighs the outputs against each other."""
        return white_as_large_as(self.estimate.errors, self.train.mask, self.train.resolution)

    @cached_property
    def blocks_of_mean(self) -> Float[np.ndarray, " K"]:
        """Squared errors of a model that knows the mean of each held-out record and no more, block by block."""
        return self.squares_of_mean(self.valid)

    def squares_of_mean(self, records: Records) -> Float[np.ndarray, " K"]:
        """Sum the squared errors of the mean of each of these records, block by block."""
        known = records.mask[:, :, None]
        counted = np.maximum(1, known.sum(axis=1, keepdims=True))  # every reading of a record may be left out
        means = np.sum(np.where(known, records.y, 0.0), axis=1, keepdims=True) / counted
        return squares_of_blocks(Problem(self.plant, records, self.noise), records.y - means)

    @property
    def n_errors(self) -> int:
        """Number of errors in training: measured samples times outputs."""
        return self.train.samples * self.plant.ny

    def held_out_errors(self, fit: Estimate) -> Float[np.ndarray, " K"]:
        """Average the squared errors of held-out free runs of a model, block by block; see `block_errors`."""
        return block_errors(fit, self.valid, self.n_init, self.train)

    def problem(self, plant: Plant) -> Problem:
        """Set up the fit of a plant to the training records."""
        return Problem(plant, self.train, self.noise)

    def in_pieces(self, plant: Plant, samples: int = PIECE) -> Problem:
        """Set up the fit of a plant to pieces of the training records, short ones, each from a start of its own."""
        return Problem(plant, self.train.pieces(min(samples, self.train.mask.shape[1])), self.noise)

    def fit(
        self, terms: Sequence[Term], starts: Iterable[tuple[np.ndarray, np.ndarray | None]], max_steps: int = MAX_STEPS
    ) -> Estimate:
        """Fit a set of terms from several starts and return the best."""
        return best_descent(self.problem(self.plant.having(terms)), starts, max_steps, TOLERANCE)
