"""Kernel-regularised FIR: a long impulse response that is smooth and decays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simgap.baselines.estimation.gram import lagged_gram, rough_means
from simgap.baselines.estimation.kernel_prior import estimate_regularised
from simgap.baselines.estimation.linear import Criterion, Estimator, LinearModel
from simgap.baselines.estimation.orders import Order, Orders
from simgap.records import Experiment
from simgap.registry import MODELS


@MODELS.register("fir-regularised")
@dataclass
class FirRegularised(LinearModel):
    """y(t) = B(q) u(t) + e(t), nb coefficients from delay nk under a TC or stable-spline prior.

    Scale, decay and noise by empirical Bayes (Pillonetto and De Nicolao, Automatica 46, 2010; Chen, Ohlsson and Ljung,
    Automatica 48, 2012). Without nb the length is selected from 40 to 160; the prior does the rest.
    """

    nb: Order | None = None
    nk: Order = 0
    select: Criterion = "valid"

    def given_orders(self, ny: int, nu: int) -> Orders | None:
        return None if self.nb is None else Orders.of(ny, nu, nb=self.nb, nk=self.nk)

    def candidates(self, ny: int, nu: int) -> list[Orders]:
        return [Orders.of(ny, nu, nb=length, nk=self.nk) for length in (40, 80, 160)]

    def estimator(self, experiments: Sequence[Experiment], n_init: int, max_lag: int) -> Estimator:
        gram = lagged_gram(experiments, rough_means(experiments), max_lag)
        return lambda orders, start: estimate_regularised(gram, orders)
