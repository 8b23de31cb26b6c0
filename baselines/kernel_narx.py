"""Kernel NARX: a difference equation that is a Gaussian process of past outputs and inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import excerpt
from simgap.baselines.estimation.equation_error import check_found, check_length
from simgap.baselines.estimation.kernel_regression import KernelNarx, Regression, scaled, stacked
from simgap.baselines.estimation.narx_error import scales
from simgap.baselines.estimation.orders import check_limits
from simgap.cores import one_thread
from simgap.records import TrainingSet
from simgap.registry import MODELS

EXCERPT, HELD_OUT = 8192, 4096  # samples to compare structures on
POOL = 4096  # rows among which centres are chosen
COARSE = 80  # centres of a first look
FINALISTS = 3
LENGTHS = (1.0, 2.0, 4.0, 8.0)  # length scales, times the root of the number of regressors
NEARBY = (0.7, 1.0, 1.4)
RIDGES = tuple(10.0**k for k in range(-9, 2))  # noise variance over the prior's


@dataclass(frozen=True)
class Structure:
    """How far back the regressors reach, and the length scale of the kernel."""

    lags: int
    nk: int
    length: float


@MODELS.register("kernel-narx")
@dataclass
class KernelNarxModel:
    """y(t) = linear + sum_k w_k exp(-|r(t) - c_k|^2 / (2 l^2)), r = y(t-1) .. y(t-lags), u(t-nk) .. u(t-lags).

    The posterior mean of a Gaussian process on up to max_centres of the training points (Kocijan 2016, chapter 2;
    Rasmussen and Williams 2006, section 8.3). Lags, nk, length scale l and noise are chosen by the free run over
    held-out records.
    """

    parts: ClassVar = (KernelNarx,)  # records in a saved model

    max_lags: int = 8
    max_centres: int = 400
    model: KernelNarx = field(init=False, repr=False)

    @one_thread()
    def fit(self, data: TrainingSet, seed: int) -> None:
        """Choose the structure on train and valid, then estimate on both together; nothing here is random."""
        check_limits(self)
        check_length(sum(len(x) - 1 for x in data.train), 3, 1)
        means, sizes, bound = scales(data.train)
        train = scaled(excerpt(data.train, EXCERPT), means, sizes)
        longest = max(len(x) for x in data.train)
        held_out = data.held_out

        def solved(regression: Regression, structure: Structure, ridge: float) -> KernelNarx:
            linear, weights = regression.solution(ridge)
            return KernelNarx(
                regression.centres, weights, linear, regression.gamma, structure.lags, structure.nk, means, sizes, bound
            )

        def error(model: KernelNarx) -> float:
            squares = samples = 0.0
            for x in excerpt(held_out, HELD_OUT):
                if len(x) > data.n_init:
                    y_hat = model.simulate(x.u[None], x.y[None, : data.n_init])[0]
                    squares += float(np.sum(((y_hat - x.y[data.n_init :]) / sizes[1]) ** 2))
                    samples += y_hat.size
            return squares / samples if samples else np.inf

        def best_ridge(structure: Structure, centres: int) -> tuple[float, float, Structure]:
            regression = _regression(train, structure, centres)
            found = ((error(solved(regression, structure, ridge)), ridge) for ridge in RIDGES)
            return *min(found), structure

        structures = [s for s in self._structures() if s.lags < longest // 4]
        check_found(structures, data)
        _, ridge, structure = _search(best_ridge, structures, self.max_centres)
        self._chosen = solved(_regression(train, structure, self.max_centres), structure, ridge)
        everything = scaled([*data.train, *data.valid], means, sizes)
        self.model = solved(_regression(everything, structure, self.max_centres), structure, ridge)

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free after the n measured samples."""
        return self.model.simulate(u, y_init)

    def as_chosen(self) -> KernelNarx:
        """Return the model of the training data alone."""
        return self._chosen

    @property
    def n_params(self) -> int:
        """How many weights were estimated."""
        return self.model.weights.size + self.model.linear.size

    @property
    def fitted(self) -> dict[str, Any]:
        """The lags, the delay, how many centres there are, and the length scale [standard deviations]."""
        length = round(float(np.sqrt(0.5 / self.model.gamma)), 3)
        return {"lags": self.model.lags, "nk": self.model.nk, "centres": len(self.model.centres), "length": length}

    def _structures(self) -> Iterator[Structure]:
        lags = [k for k in (1, 2, 3, 4, 6, 8, 12, 16) if k <= self.max_lags]
        yield from (Structure(k, nk, length) for k in lags for nk in (1, 0) for length in LENGTHS)


def _search(
    best_ridge: Callable[[Structure, int], tuple[float, float, Structure]], structures: list[Structure], centres: int
) -> tuple[float, float, Structure]:
    """Try all structures with few centres, and with all of them the best few and their neighbours in length."""
    found = sorted((best_ridge(structure, min(COARSE, centres)) for structure in structures), key=_error)
    nearby = {
        Structure(s.lags, s.nk, round(s.length * factor, 6)) for _, _, s in found[:FINALISTS] for factor in NEARBY
    }
    return min((best_ridge(s, centres) for s in sorted(nearby, key=repr)), key=_error)


def _regression(records: list[tuple[np.ndarray, np.ndarray]], structure: Structure, centres: int) -> Regression:
    r, y = stacked(records, structure.lags, structure.nk)
    return Regression.of(r, y, 0.5 / (structure.length**2 * r.shape[1]), centres, POOL)


def _error(found: tuple[float, float, Structure]) -> float:
    return found[0]
