"""The free run of a polynomial NARX model, its simulation error, its sum of squares and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from simgap.baselines.estimation.levenberg import Cost, sum_up
from simgap.baselines.estimation.narx_kernels import run_free
from simgap.records import Experiment

BOUND = 3.0  # a free run goes no further from the mean than so many times the largest training output


@dataclass(frozen=True, eq=False)
class PolynomialNarx:
    """y_i(t) = sum of theta_k phi_k(t) over the k of output i; phi_k are products of past outputs and inputs.

    Signals are to their scale, (y - mean) / size. terms number the regressors: 1 .. are y(t-1) of each output, then
    y(t-2) and so on, then u(t-nk) .. u(t-lags); 0 stands for 1.
    """

    terms: Int[np.ndarray, "p d"]
    owner: Int[np.ndarray, " p"]
    theta: Float[np.ndarray, " p"]
    lags: int
    nk: int
    means: tuple[Float[np.ndarray, " nu"], Float[np.ndarray, " ny"]]
    sizes: tuple[Float[np.ndarray, " nu"], Float[np.ndarray, " ny"]]
    bound: float

    def scaled(self, u: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Take signals to the scale of the model."""
        return (u - self.means[0]) / self.sizes[0], (y - self.means[1]) / self.sizes[1]

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free after n measured samples; where those are fewer than the lags, the first stood before the record."""
        n = y_init.shape[1]
        u, y_init = self.scaled(u, y_init)
        missing = max(self.lags - n, 0)
        runs = []
        for one, start in zip(u, y_init, strict=True):
            padded = np.concatenate((np.repeat(one[:1], missing, axis=0), one[max(n - self.lags, 0) :]))
            before = np.concatenate((np.repeat(start[:1], missing, axis=0), start[max(n - self.lags, 0) :]))
            runs.append(self.run(padded, before)[0][self.lags :])
        return np.array(runs).reshape(len(u), u.shape[1] - n, -1) * self.sizes[1] + self.means[1]

    def run(
        self, u: Float[np.ndarray, "T nu"], before: Float[np.ndarray, "N ny"], slopes: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Run free from `before`, scaled: y [T, ny], and dy/dtheta [T, ny, p] if `slopes`."""
        y = np.zeros((len(u), before.shape[1]))
        y[: self.lags] = before
        s = np.zeros((len(y) if slopes else 0, y.shape[1], len(self.theta)))
        run_free(np.ascontiguousarray(u), y, s, self.lags, self.nk, self.terms, self.owner, self.theta, self.bound)
        return y, s


@dataclass(frozen=True, eq=False)
class NarxError:
    """The error of the free run after the first n_init samples of each record, scaled, as a function of theta."""

    model: PolynomialNarx
    records: list[tuple[Float[np.ndarray, "_ nu"], Float[np.ndarray, "_ ny"]]]

    @classmethod
    def of(cls, model: PolynomialNarx, experiments: Sequence[Experiment], n_init: int):
        start = max(n_init - model.lags, 0)
        return cls(
            model, [model.scaled(x.u[start:], x.y[start:]) for x in experiments if len(x) > max(n_init, model.lags)]
        )

    @property
    def samples(self) -> int:
        """How many errors count."""
        return sum(y[self.model.lags :].size for _, y in self.records)

    def allowed(self, theta: Float[np.ndarray, " p"]) -> list[Float[np.ndarray, " p"]]:
        """Give the point itself: a free run that leaves the bounds is dear enough."""
        return [theta]

    def squares(self, theta: Float[np.ndarray, " p"]) -> float:
        """Compute |e|^2."""
        model = replace(self.model, theta=theta)
        return sum(float(np.sum((model.run(u, y[: model.lags])[0] - y) ** 2)) for u, y in self.records)

    def cost(self, theta: Float[np.ndarray, " p"]) -> Cost:
        """Compute |e|^2, half its gradient and J' J."""
        return sum_up(self._linearised(theta))

    def _linearised(self, theta: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        model = replace(self.model, theta=theta)
        for u, y in self.records:
            y_hat, slopes = model.run(u, y[: model.lags], slopes=True)
            yield (y_hat - y)[model.lags :], np.moveaxis(slopes[model.lags :], 2, 0)
