"""One set of effects, fitted and judged."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simgap.greybox.fitting import Estimate
from simgap.greybox.plant import Term


@dataclass(frozen=True, eq=False)
class Trial:
    """One set of terms, fitted: log-likelihoods of training and held-out errors, and the numbers they cost."""

    terms: tuple[Term, ...]
    estimate: Estimate
    train: float
    valid: float
    k: int  # numbers estimated for all experiments
    k_train: int  # numbers estimated for single training experiments
    k_valid: int
    blocks: np.ndarray  # held-out squares over the variance of the plain model, block by block

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the effects."""
        return tuple(term.effect.name for term in self.terms)

    @property
    def score(self) -> float:
        """Log-likelihood of all data less what its parameters cost (Schwarz 1978 for those of all experiments)."""
        n = self.estimate.errors.shape[0] * self.estimate.errors.shape[1]
        per_record = math.log(self.estimate.errors.shape[1])
        return self.train + self.valid - 0.5 * self.k * math.log(n) - 0.5 * (self.k_train + self.k_valid) * per_record


def replaces(new: Term, old: Term) -> bool:
    """Stribeck friction contains Coulomb friction."""
    return new.effect.name == "stribeck_friction" and old.effect.name == "coulomb_friction"
