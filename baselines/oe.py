"""Output error: least squares on the simulation itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from simgap.baselines.estimation.gram import rough_means
from simgap.baselines.estimation.linear import Criterion, Estimator, LinearModel, check_together
from simgap.baselines.estimation.oe_search import estimate_oe
from simgap.baselines.estimation.orders import Order, Orders
from simgap.records import Experiment
from simgap.registry import MODELS


@MODELS.register("oe")
@dataclass
class Oe(LinearModel):
    """y(t) = B(q)/F(q) u(t) + e(t), by minimising the simulation error (Ljung 1999, sections 4.2, 10.2).

    nb, nf, nk in the toolbox convention; without them nf = nb is selected up to max_order, nk from 0 and 1.
    start names what is done about the unknown state at the start of each experiment: "n_init" finds it from the
    first n_init samples, as the bench will, and minimises the free run after them; "free" estimates it along.
    """

    nb: Order | None = None
    nf: Order | None = None
    nk: Order = 1
    start: Literal["n_init", "free"] = "n_init"
    select: Criterion = "valid"
    max_order: int = 6
    offset: bool = True

    def given_orders(self, ny: int, nu: int) -> Orders | None:
        check_together("oe", nb=self.nb, nf=self.nf)
        if self.nb is None or self.nf is None:
            return None
        return Orders.of(ny, nu, nb=self.nb, nk=self.nk, nf=self.nf)

    def candidates(self, ny: int, nu: int) -> list[Orders]:
        return [
            Orders.of(ny, nu, nb=n + (nk == 0), nk=nk, nf=n) for n in range(1, self.max_order + 1) for nk in range(2)
        ]

    def estimator(self, experiments: Sequence[Experiment], n_init: int, max_lag: int) -> Estimator:
        shift = rough_means(experiments, self.offset)
        n_start = n_init if self.start == "n_init" else None
        return lambda orders, start: estimate_oe(experiments, shift, orders, self.offset, n_start, start)
