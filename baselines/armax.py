"""ARMAX: the prediction-error method for a plant and its disturbance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from simgap.baselines.estimation.armax_search import estimate_armax
from simgap.baselines.estimation.gram import rough_means
from simgap.baselines.estimation.linear import Criterion, Estimator, LinearModel, check_together
from simgap.baselines.estimation.orders import Order, Orders
from simgap.records import Experiment
from simgap.registry import MODELS


@MODELS.register("armax")
@dataclass
class Armax(LinearModel):
    """A(q) y(t) = B(q) u(t) + C(q) e(t), by minimising one-step prediction errors (Ljung 1999, sections 4.2, 10.2).

    na, nb, nc, nk in the toolbox convention; without them na = nb = nc is selected up to max_order, nk from 0 and 1.
    """

    by_prediction: ClassVar[bool] = True

    na: Order | None = None
    nb: Order | None = None
    nc: Order | None = None
    nk: Order = 1
    select: Criterion = "valid"
    max_order: int = 4
    offset: bool = True

    def given_orders(self, ny: int, nu: int) -> Orders | None:
        check_together("armax", na=self.na, nb=self.nb, nc=self.nc)
        if self.na is None or self.nb is None or self.nc is None:
            return None
        return Orders.of(ny, nu, na=self.na, nb=self.nb, nk=self.nk, nc=self.nc)

    def candidates(self, ny: int, nu: int) -> list[Orders]:
        return [
            Orders.of(ny, nu, na=n, nb=n + (nk == 0), nk=nk, nc=n)
            for n in range(1, self.max_order + 1)
            for nk in range(2)
        ]

    def estimator(self, experiments: Sequence[Experiment], n_init: int, max_lag: int) -> Estimator:
        shift = rough_means(experiments, self.offset)
        return lambda orders, start: estimate_armax(experiments, shift, orders, self.offset, start)
