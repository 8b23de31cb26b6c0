"""FIR: the output as a weighted sum of past inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simgap.baselines.estimation.equation_error import estimate_arx
from simgap.baselines.estimation.gram import lagged_gram, rough_means
from simgap.baselines.estimation.linear import Criterion, Estimator, LinearModel
from simgap.baselines.estimation.orders import Order, Orders
from simgap.records import Experiment
from simgap.registry import MODELS


@MODELS.register("fir")
@dataclass
class Fir(LinearModel):
    """y(t) = B(q) u(t) + e(t), nb coefficients from delay nk, by least squares (Ljung 1999, eq. 4.46 with F = 1).

    Without nb the length is selected from 5 to 160. A plant that integrates has no finite response; see arx, oe.
    """

    nb: Order | None = None
    nk: Order = 0
    select: Criterion = "valid"
    offset: bool = True

    def given_orders(self, ny: int, nu: int) -> Orders | None:
        return None if self.nb is None else Orders.of(ny, nu, nb=self.nb, nk=self.nk)

    def candidates(self, ny: int, nu: int) -> list[Orders]:
        return [Orders.of(ny, nu, nb=length, nk=self.nk) for length in (5, 10, 20, 40, 80, 160)]

    def estimator(self, experiments: Sequence[Experiment], n_init: int, max_lag: int) -> Estimator:
        gram = lagged_gram(experiments, rough_means(experiments, self.offset), max_lag)
        return lambda orders, start: estimate_arx(gram, orders, self.offset)
