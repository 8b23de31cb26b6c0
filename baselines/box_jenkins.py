"""Box-Jenkins: the prediction-error method for a plant and a disturbance that share no poles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from simgap.baselines.estimation.box_jenkins_search import estimate_box_jenkins
from simgap.baselines.estimation.gram import rough_means
from simgap.baselines.estimation.linear import Criterion, Estimator, LinearModel, check_together
from simgap.baselines.estimation.orders import Order, Orders
from simgap.records import Experiment
from simgap.registry import MODELS


@MODELS.register("box-jenkins")
@dataclass
class BoxJenkins(LinearModel):
    """y(t) = B(q)/F(q) u(t) + C(q)/D(q) e(t), by minimising one-step prediction errors (Ljung 1999, eq. 4.31).

    nb, nc, nd, nf, nk in the toolbox convention; without them nf = nb is selected up to max_order, nc = nd from 1 and
    2, nk from 0 and 1. A free run is that of B/F; what the start shows of the disturbance dies away as C/D says.
    """

    by_prediction: ClassVar[bool] = True

    nb: Order | None = None
    nc: Order | None = None
    nd: Order | None = None
    nf: Order | None = None
    nk: Order = 1
    select: Criterion = "valid"
    max_order: int = 4
    offset: bool = True

    def given_orders(self, ny: int, nu: int) -> Orders | None:
        check_together("box-jenkins", nb=self.nb, nc=self.nc, nd=self.nd, nf=self.nf)
        if self.nb is None or self.nc is None or self.nd is None or self.nf is None:
            return None
        return Orders.of(ny, nu, nb=self.nb, nk=self.nk, nc=self.nc, nd=self.nd, nf=self.nf)

    def candidates(self, ny: int, nu: int) -> list[Orders]:
        return [
            Orders.of(ny, nu, nb=n + (nk == 0), nk=nk, nc=noise, nd=noise, nf=n)
            for n in range(1, self.max_order + 1)
            for nk in range(2)
            for noise in (1, 2)
        ]

    def estimator(self, experiments: Sequence[Experiment], n_init: int, max_lag: int) -> Estimator:
        shift = rough_means(experiments, self.offset)
        return lambda orders, start: estimate_box_jenkins(experiments, shift, orders, self.offset, start)
