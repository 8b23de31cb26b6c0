"""What all linear models share: order given or selected, estimation, simulation, and what they say of themselves."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import stack
from simgap.baselines.estimation.fitted import LinearFit
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.estimation.polynomial import Polynomial
from simgap.baselines.estimation.residuals import residual_analysis
from simgap.records import Experiment, TrainingSet, UnusableInput

Criterion = Literal["valid", "aic", "bic"]
Estimator = Callable[[Orders], LinearFit]


class LinearModel(ABC):
    """A model A(q) y = B(q) u + C(q) e, or B(q)/F(q), whose order is given or selected.

    A final class names its fields and says how one order is estimated. After `fit`, `result` holds the coefficients
    with their standard errors, and `polynomial` what simulates.
    """

    result: LinearFit
    select: Criterion

    @abstractmethod
    def given_orders(self, ny: int, nu: int) -> Orders | None:
        """The orders that the user gave, or None where they are to be selected."""

    @abstractmethod
    def candidates(self, ny: int, nu: int) -> list[Orders]:
        """What a selection chooses from."""

    @abstractmethod
    def estimator(self, experiments: Sequence[Experiment], n_init: int, max_lag: int) -> Estimator:
        """A function from orders to a fit on these experiments, for orders up to max_lag."""

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Estimate on train and valid together; a selection by validation compares fits on train alone.

        The estimate has no randomness, so the seed changes nothing.
        """
        ny, nu = len(data.channels.outputs), len(data.channels.inputs)
        orders = self.given_orders(ny, nu)
        if orders is None:
            orders = self._selected(data, self.candidates(ny, nu))
        everything = data.train + data.valid
        self.result = self.estimator(everything, data.n_init, orders.max_lag)(orders)
        self._seen = everything
        self.result.warn()

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Free run from the state that the first n samples show."""
        return self.polynomial.simulate(u, y_init)

    @property
    def polynomial(self) -> Polynomial:
        """The identified difference equation."""
        return self.result.polynomial

    @property
    def n_params(self) -> int:
        """How many coefficients were estimated."""
        return self.result.n_params

    @property
    def fitted(self) -> dict[str, Any]:
        """The orders, as chosen or given."""
        return self.result.orders.as_dict()

    def summary(self) -> str:
        """Coefficients with standard errors, poles, and the residual analysis."""
        poles = ", ".join(f"{pole:.4g}" for pole in sorted(self.polynomial.poles, key=abs, reverse=True)[:8])
        tests = residual_analysis(self.result, self._seen)
        lines = [f"output {i + 1}: {found.text()}" for i, row in enumerate(tests) for found in row]
        return "\n".join((self.result.table(), f"poles of the simulation: {poles}", *lines))

    def _selected(self, data: TrainingSet, candidates: list[Orders]) -> Orders:
        """The candidate with the best free run on valid, or the least AIC or BIC on everything."""
        valid = [e for e in data.valid if len(e) > data.n_init]
        by_simulation = self.select == "valid" and bool(valid)
        experiments = data.train if by_simulation else data.train + data.valid
        longest = max(map(len, experiments))
        candidates = [orders for orders in candidates if orders.max_lag < longest // 4]
        if not candidates:
            raise UnusableInput(
                f"too few samples to select an order: the longest training experiment has {longest}; record more"
            )
        estimate = self.estimator(experiments, data.n_init, max(orders.max_lag for orders in candidates))
        scores = []
        for orders in candidates:
            try:
                fit = estimate(orders)
            except UnusableInput:  # too few samples for this one
                scores.append(np.inf)
                continue
            if by_simulation:
                scores.append(free_run_error(fit.polynomial, valid, data.n_init))
            else:
                scores.append(fit.criterion(2.0 if self.select == "aic" else float(np.log(fit.samples))))
        if not np.isfinite(scores).any():
            raise UnusableInput(
                "no order could be estimated from so few samples; record more or give a lower order"
            )
        return candidates[int(np.argmin(scores))]


def free_run_error(model: Polynomial, experiments: Sequence[Experiment], n_init: int) -> float:
    """Mean over the outputs of mse / variance, over all experiments; infinite when the run diverges."""
    squares, spread = 0.0, 0.0
    measured = np.concatenate([e.y[n_init:] for e in experiments])
    with np.errstate(over="ignore", invalid="ignore"):
        for u, y in stack(experiments):
            error = model.simulate(u, y[:, :n_init]) - y[:, n_init:]
            squares = squares + np.sum(error**2, axis=(0, 1))
    spread = np.sum((measured - measured.mean(axis=0)) ** 2, axis=0)
    score = float(np.mean(squares / np.where(spread > 0, spread, 1.0)))
    return score if np.isfinite(score) else np.inf


def require_both(model: str, **orders: Any) -> bool:
    """Whether orders were given. Raises UnusableInput when some were and others not."""
    given = [name for name, value in orders.items() if value is not None]
    if given and len(given) < len(orders):
        raise UnusableInput(f"{model}: {', '.join(orders)} belong together; only {', '.join(given)} given")
    return bool(given)
