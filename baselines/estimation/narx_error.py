"""The free run of a polynomial NARX model, its simulation error, its sum of squares and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from simgap.baselines.estimation.levenberg import Cost, minimise, sum_up
from simgap.baselines.estimation.monomials import maps, started
from simgap.baselines.estimation.narx_kernels import run_free
from simgap.records import Experiment

STARTS, LONG = 100, 1000  # samples of the records from which a model must run free, and for how many samples
BOUND = 3.0  # a free run goes no further from the mean than so many times the largest training output


def scales(
    experiments: Sequence[Experiment],
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray], float]:
    """Measure means and sizes of u and y, and how far a free run may go from the mean, in sizes of y."""
    u, y = (np.concatenate([getattr(x, signal) for x in experiments]) for signal in "uy")
    means = u.mean(axis=0), y.mean(axis=0)
    deviations = u.std(axis=0), y.std(axis=0)
    sizes = np.where(deviations[0] > 0, deviations[0], 1.0), np.where(deviations[1] > 0, deviations[1], 1.0)
    return means, sizes, BOUND * float(np.abs((y - means[1]) / sizes[1]).max())


@dataclass(frozen=True, eq=False)
class PolynomialNarx:
    """y_i(t) = sum of theta_k phi_k(t) over the k of output i; phi_k are products of past outputs and inputs.

    Signals are to their scale, (y - mean) / size. terms number the regressors: 1 .. are y(t-1) of each output, then
    y(t-2) and so on, then u(t-nk) .. u(t-lags); 0 stands for 1. With `differences` they are y(t-1), its difference to
    the sample before, the difference of that, and so on, the same of u, and the sum is the change of y beyond those:
    y(t) = y(t-1) + dy(t-1) + .. + sum.
    """

    terms: Int[np.ndarray, "p d"]
    owner: Int[np.ndarray, " p"]
    theta: Float[np.ndarray, " p"]
    lags: int
    nk: int
    means: tuple[Float[np.ndarray, " nu"], Float[np.ndarray, " ny"]]
    sizes: tuple[Float[np.ndarray, " nu"], Float[np.ndarray, " ny"]]
    bound: float
    differences: bool = False

    def scaled(self, u: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Take signals to the scale of the model."""
        return (u - self.means[0]) / self.sizes[0], (y - self.means[1]) / self.sizes[1]

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free after n measured samples; where those are fewer than the lags, the first stood before the record."""
        n = y_init.shape[1]
        u, y_init = self.scaled(u, y_init)
        runs = [self.run(*started(one, start, self.lags))[0][self.lags :] for one, start in zip(u, y_init, strict=True)]
        return np.array(runs).reshape(len(u), u.shape[1] - n, -1) * self.sizes[1] + self.means[1]

    def run(
        self, u: Float[np.ndarray, "T nu"], before: Float[np.ndarray, "N ny"], slopes: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Run free from `before`, scaled: y [T, ny], and dy/dtheta [T, ny, p] if `slopes`."""
        y = np.zeros((len(u), before.shape[1]))
        y[: self.lags] = before
        s = np.zeros((len(y) if slopes else 0, y.shape[1], len(self.theta)))
        past, base = maps(self.lags, self.differences)
        run_free(
            np.ascontiguousarray(u), y, s, self.lags, self.nk, past, base, self.terms, self.owner, self.theta,
            self.bound,
        )  # fmt: skip
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

    @property
    def mean_square(self) -> float:
        """Mean square of the model's own errors; infinite where no record is long enough."""
        return self.squares(self.model.theta) / self.samples if self.records else np.inf

    def allowed(self, theta: Float[np.ndarray, " p"]) -> list[Float[np.ndarray, " p"]]:
        """Give the point itself: a free run that leaves the bounds is dear enough."""
        return [theta]

    def strays(self) -> bool:
        """Tell whether a run from one of several samples of the records reaches the bounds of the model.

        Such a model runs away from some states it has seen, however well it does from the start of a record.
        """
        model, each = self.model, -(-STARTS // max(len(self.records), 1))
        for u, y in self.records:
            for at in np.unique(np.linspace(0, max(len(y) - 2 * model.lags, 0), each, endpoint=False).astype(int)):
                y_hat, _ = model.run(u[at : at + LONG], y[at : at + model.lags])
                if np.abs(y_hat[model.lags :]).max(initial=0.0) >= model.bound:
                    return True
        return False

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


def refined(model: PolynomialNarx, experiments: Sequence[Experiment], n_init: int, steps: int) -> PolynomialNarx:
    """Minimise the simulation error over these records by Levenberg-Marquardt."""
    equation = NarxError.of(model, experiments, n_init)
    return replace(model, theta=minimise(equation, model.theta, steps).theta) if equation.records else model


def refined_safely(model: PolynomialNarx, experiments: Sequence[Experiment], n_init: int, steps: int) -> PolynomialNarx:
    """Do the same, unless a model that did not run away does so then."""
    finished = refined(model, experiments, n_init, steps)
    strays = [NarxError.of(one, experiments, n_init).strays() for one in (model, finished)]
    return model if strays == [False, True] else finished
