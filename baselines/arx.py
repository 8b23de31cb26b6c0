"""ARX: least squares on the equation error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from simgap.baselines.estimation.equation_error import estimate_arx
from simgap.baselines.estimation.gram import lagged_gram, rough_means
from simgap.baselines.estimation.linear import Criterion, Estimator, LinearModel, check_together
from simgap.baselines.estimation.orders import Order, Orders
from simgap.records import Experiment
from simgap.registry import MODELS


@MODELS.register("arx")
@dataclass
class Arx(LinearModel):
    """A(q) y(t) = B(q) u(t) + e(t), by least squares over all experiments (Ljung 1999, section 4.2).

    na, nb, nk in the toolbox convention, a number or a matrix per pair of channels; without them the order is taken
    that, estimated on train, runs best on train and valid (or that of the least AIC or BIC), up to max_order. offset
    estimates a constant along, for data that do not have mean zero.
    """

    by_prediction: ClassVar[bool] = True

    na: Order | None = None
    nb: Order | None = None
    nk: Order = 1
    select: Criterion = "valid"
    max_order: int = 10
    offset: bool = True

    def given_orders(self, ny: int, nu: int) -> Orders | None:
        check_together("arx", na=self.na, nb=self.nb)
        if self.na is None or self.nb is None:
            return None
        return Orders.of(ny, nu, na=self.na, nb=self.nb, nk=self.nk)

    def candidates(self, ny: int, nu: int) -> list[Orders]:
        # With nk = 0 one more coefficient of B reaches equally far back.
        return [
            Orders.of(ny, nu, na=n, nb=n + (nk == 0), nk=nk) for n in range(1, self.max_order + 1) for nk in range(4)
        ]

    def estimator(self, experiments: Sequence[Experiment], n_init: int, max_lag: int) -> Estimator:
        gram = lagged_gram(experiments, rough_means(experiments, self.offset), max_lag)
        return lambda orders, start: estimate_arx(gram, orders, self.offset)
