"""SINDy with control: a sparse difference equation in products of values and differences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import excerpt
from simgap.baselines.estimation.equation_error import check_found, check_length
from simgap.baselines.estimation.monomials import maps, monomials, regressors, values
from simgap.baselines.estimation.narx_error import NarxError, PolynomialNarx, refined, refined_safely, scales
from simgap.baselines.estimation.orders import check_limits
from simgap.baselines.estimation.thresholding import thresholded
from simgap.cores import one_thread
from simgap.records import Experiment, TrainingSet
from simgap.registry import MODELS

EXCERPT = 8192  # samples to select terms on
CANDIDATES = 300  # products among which terms are selected
THRESHOLDS = tuple(np.geomspace(1e-4, 1.0, 17))  # of what a term contributes, root mean square over that of the target
RIDGE = 1e-6  # on the coefficients of terms and a target of size 1
REFINED, STEPS = 8, 30  # structures that are fitted by simulation error, and how long each
ROWS = 20  # of training for each term, or more
WORTH = 0.05  # more terms must lower the held-out mean square error by so much


@MODELS.register("sindy")
@dataclass
class Sindy:
    """d^n y(t) = sum_k theta_k phi_k(t), phi_k products of y, dy, .., d^(n-1) y one sample ago and of u, du, ..

    d is the difference of neighbouring samples. The few terms that are needed are found by sequentially thresholded
    least squares (SINDy: Brunton, Proctor and Kutz, PNAS 113, 2016; with inputs: Kaiser, Kutz and Brunton 2018). The
    free run over held-out records chooses n, the degree, the delay of u and the threshold; the coefficients that are
    left are fitted by simulation error.
    """

    parts: ClassVar = (PolynomialNarx,)  # records in a saved model

    max_order: int = 4
    max_degree: int = 3
    model: PolynomialNarx = field(init=False, repr=False)

    @one_thread()
    def fit(self, data: TrainingSet, seed: int) -> None:
        """Choose the terms on train and valid, then estimate on both together; nothing here is random."""
        check_limits(self)
        check_length(sum(len(x) - 1 for x in data.train), 3, 1)
        held_out = data.held_out
        records = excerpt(data.train, EXCERPT)

        def error(model: PolynomialNarx) -> float:
            return NarxError.of(model, held_out, data.n_init).mean_square

        def strays(model: PolynomialNarx) -> bool:
            return NarxError.of(model, records, data.n_init).strays()

        found = sorted(((error(m), len(m.theta), k, m) for k, m in enumerate(self._sparse(data, records))))
        check_found(found, data)
        safe = list(islice((model for *_, model in found if not strays(model)), REFINED))
        finished = [refined(model, records, data.n_init, STEPS) for model in safe]
        trusted = safe[:1] + [model for model in finished if not strays(model)]
        tried = [(error(model), model) for model in trusted or [found[0][3]]]
        enough = (1 + WORTH) * min(of for of, _ in tried)
        chosen = min((len(model.theta), of, k) for k, (of, model) in enumerate(tried) if of <= enough)
        self._chosen = tried[chosen[2]][1]
        self.model = refined_safely(self._chosen, [*data.train, *data.valid], data.n_init, STEPS)

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free after the n measured samples."""
        return self.model.simulate(u, y_init)

    def as_chosen(self) -> PolynomialNarx:
        """Return the model before its last refinement, which is on all data."""
        return self._chosen

    @property
    def n_params(self) -> int:
        """How many coefficients were estimated."""
        return len(self.model.theta)

    @property
    def fitted(self) -> dict[str, Any]:
        """The order n, the delay, the largest degree among the terms, and how many terms there are."""
        degree = int((self.model.terms > 0).sum(axis=1).max(initial=0))
        return {"order": self.model.lags, "nk": self.model.nk, "degree": degree, "terms": len(self.model.theta)}

    def _sparse(self, data: TrainingSet, records: Sequence[Experiment]) -> Iterator[PolynomialNarx]:
        """Yield a model for each order, delay, degree and threshold, as far as they differ."""
        means, sizes, bound = scales(data.train)
        nu, ny = map(len, means)
        for order in range(1, self.max_order + 1):
            for nk in (1, 0):
                for degree in range(1, self.max_degree + 1):
                    terms = monomials(ny * order + nu * (order + 1 - nk), degree)
                    if len(terms) <= CANDIDATES:
                        empty = PolynomialNarx(
                            terms, terms[:, 0], np.zeros(len(terms)), order, nk, means, sizes, bound, True
                        )
                        yield from _thinned(empty, records)


def _thinned(model: PolynomialNarx, records: Sequence[Experiment]) -> Iterator[PolynomialNarx]:
    """Yield the model with as many terms as the records bear, then with fewer and fewer as the threshold rises."""
    base = maps(model.lags, True)[1]
    columns, targets = [], []
    for x in records:
        if len(x) > model.lags:
            u, y = model.scaled(x.u, x.y)
            columns.append(values(regressors(u, y, model.lags, model.nk, True), model.terms))
            known = sum(base[k] * y[model.lags - 1 - k : len(y) - 1 - k] for k in range(model.lags))
            targets.append(y[model.lags :] - known)
    if not columns:
        return
    phi, target = np.concatenate(columns, axis=1), np.concatenate(targets)
    size, of_target = np.sqrt(np.mean(phi**2, axis=1)), np.sqrt(np.mean(target**2, axis=0))
    size[size == 0], of_target[of_target == 0] = np.inf, 1.0
    phi, target = phi / size[:, None], target / of_target
    products, right = phi @ phi.T / phi.shape[1], phi @ target / phi.shape[1]
    seen = set()
    for threshold in THRESHOLDS:
        theta = np.stack([thresholded(products, one, threshold, RIDGE) for one in right.T])  # [ny, M]
        few = ROWS * np.count_nonzero(theta) <= target.size
        if few and theta.any() and (which := (theta != 0).tobytes()) not in seen:
            seen.add(which)
            owner, chosen = (index.copy() for index in np.nonzero(theta))
            real = theta[owner, chosen] * of_target[owner] / size[chosen]
            yield replace(model, terms=model.terms[chosen], owner=owner, theta=real)
