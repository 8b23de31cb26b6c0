"""Polynomial NARX: a difference equation in products of past outputs and inputs, its terms selected."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import excerpt
from simgap.baselines.estimation.equation_error import check_found, check_length
from simgap.baselines.estimation.forward_selection import forward_selection
from simgap.baselines.estimation.monomials import monomials, regressors, values
from simgap.baselines.estimation.narx_error import NarxError, PolynomialNarx, refined, refined_safely, scales
from simgap.baselines.estimation.orders import check_limits
from simgap.cores import one_thread
from simgap.records import Experiment, TrainingSet
from simgap.registry import MODELS

EXCERPT = 8192  # samples to select terms on
CANDIDATES = 500  # products among which terms are selected
REFINED, STEPS = 16, 30  # structures that are fitted by simulation error, and how long each


@MODELS.register("narx")
@dataclass
class Narx:
    """y(t) = sum_k theta_k phi_k(t), phi_k products of y(t-1) .. y(t-lags), u(t-nk) .. u(t-lags) up to a degree.

    Terms are ranked by orthogonal forward regression (FROLS: Chen, Billings and Luo 1989; Billings 2013, chapter 3).
    Lags, degree, nk and how many terms are chosen by the free run over held-out records, of the best few after a fit
    by simulation error (Levenberg-Marquardt; Aguirre, Barbosa and Braga 2010), which ends the estimation too.
    """

    parts: ClassVar = (PolynomialNarx,)  # records in a saved model

    max_lags: int = 6
    max_degree: int = 3
    max_terms: int = 30
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

        def safe_error(model: PolynomialNarx) -> float:
            return np.inf if NarxError.of(model, records, data.n_init).strays() else error(model)

        found = sorted((min(((error(m), m) for m in of), key=_first) for of in self._rankings(data)), key=_first)
        check_found(found, data)
        safe = [pair for pair in found if np.isfinite(safe_error(pair[1]))] or found
        finished = [refined(model, records, data.n_init, STEPS) for _, model in safe[:REFINED]]
        best = min([safe[0], *((safe_error(model), model) for model in finished)], key=_first)
        best = self._pruned(best, records, safe_error, data.n_init)
        self._chosen = best[1]
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
        """The lags, the delay, the largest degree among the terms, and how many terms there are."""
        degree = int((self.model.terms > 0).sum(axis=1).max())
        return {"lags": self.model.lags, "nk": self.model.nk, "degree": degree, "terms": len(self.model.theta)}

    def _rankings(self, data: TrainingSet) -> Iterator[list[PolynomialNarx]]:
        """Yield the models of the first 1, 2, .. terms of every ranking, their coefficients by least squares."""
        means, sizes, bound = scales(data.train)
        nu, ny = map(len, means)
        for lags in range(1, self.max_lags + 1):
            for nk in (1, 0):
                n = ny * lags + nu * (lags + 1 - nk)
                for degree in range(1, self.max_degree + 1):
                    terms = monomials(n, degree)
                    if len(terms) <= CANDIDATES:
                        empty = PolynomialNarx(terms, terms[:, 0], np.zeros(len(terms)), lags, nk, means, sizes, bound)
                        if models := list(self._prefixes(empty, data.train)):
                            yield models

    def _pruned(
        self, best: tuple[float, PolynomialNarx], records: Sequence[Experiment], error: Callable, n_init: int
    ) -> tuple[float, PolynomialNarx]:
        """Leave terms out, the least significant first, as long as the held-out free run does not get worse."""
        while len(best[1].theta) > 1:
            equation = NarxError.of(best[1], records, n_init)
            if not equation.records:
                break
            hessian = equation.cost(best[1].theta).hessian
            t = np.abs(best[1].theta) / np.sqrt(np.maximum(np.diag(np.linalg.pinv(hessian)), 1e-300))
            keep = np.arange(len(t)) != int(np.argmin(t))
            model = best[1]
            fewer = replace(model, terms=model.terms[keep], owner=model.owner[keep], theta=model.theta[keep])
            fewer = refined(fewer, records, n_init, STEPS)
            if error(fewer) > best[0]:
                break
            best = error(fewer), fewer
        return best

    def _prefixes(self, all_terms: PolynomialNarx, experiments: Sequence[Experiment]) -> Iterator[PolynomialNarx]:
        phi, targets = [], []
        for x in excerpt(experiments, EXCERPT):
            if len(x) > all_terms.lags:
                u, y = all_terms.scaled(x.u, x.y)
                phi.append(values(regressors(u, y, all_terms.lags, all_terms.nk), all_terms.terms))
                targets.append(y[all_terms.lags :])
        if not phi or (rows := sum(map(len, targets))) < 10:
            return
        columns = np.concatenate(phi, axis=1)
        products, right = columns @ columns.T, columns @ np.concatenate(targets)
        most = min(self.max_terms, rows // 5)
        ranked = [forward_selection(products, one, most) for one in right.T]
        for count in range(1, most + 1):
            chosen = [ranking[:count] for ranking in ranked]
            theta = [
                np.linalg.lstsq(products[np.ix_(ks, ks)], right[ks, i], rcond=1e-14)[0] for i, ks in enumerate(chosen)
            ]
            owner = np.repeat(np.arange(len(chosen)), [len(ks) for ks in chosen])
            yield replace(
                all_terms, terms=all_terms.terms[np.concatenate(chosen)], owner=owner, theta=np.concatenate(theta)
            )


def _first(pair: tuple[float, Any]) -> float:
    return pair[0]
