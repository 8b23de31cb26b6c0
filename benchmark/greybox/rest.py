"""What inputs and simulation alone still tell of a simulation's error: a kernel regression, cross-validated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import cho_factor, cho_solve

from simgap.error_views.correlation import correlation_time
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.rest_features import Design, Features, denominator_of

DESIGNS = (
    Design(100, 1.0),
    Design(40, 3.0),
    Design(40, 1.0, after=(4.0, 16.0, 64.0)),
    Design(60, 2.0, before=(3.0, 10.0, 30.0)),
    Design(100, 1.0, lags=(1, 2, 4, 8, 16)),
)
RIDGES = 10.0 ** np.arange(-5, 2, 1.5)
ROWS = 10_000  # of a regression, spread over the records
FOLDS = 8
MEMORIES = 2  # of the error, that a fold lasts at least
# The mean gain of the folds over its standard error, and the share of the squared errors: noise hardly reaches both.
CERTAIN = 2.5
MATTERS = 0.01


@runtime_checkable
class Predictor(Protocol):
    """What predicts the error of one output; share is the part of held-out squared errors that it predicts."""

    @property
    def share(self) -> float: ...

    @property
    def n_params(self) -> int: ...

    def predict(
        self, u: Float[np.ndarray, "B T nu"], y_hat: Float[np.ndarray, "B T ny"]
    ) -> Float[np.ndarray, "B T"]: ...


@dataclass(frozen=True, eq=False)
class RestOfOutput:
    """e_hat = c (phi - m) of one output, nowhere larger than the largest error in training.

    share is the part of the squared errors that it predicts in folds held out.
    """

    features: Features
    means: Float[np.ndarray, " f"]
    coefficients: Float[np.ndarray, " f"]
    largest: float
    share: float

    @property
    def n_params(self) -> int:
        """Numbers that were estimated, not drawn."""
        return len(self.coefficients)

    def predict(self, u: Float[np.ndarray, "B T nu"], y_hat: Float[np.ndarray, "B T ny"]) -> Float[np.ndarray, "B T"]:
        """Predict the error of a simulation y_hat."""
        e_hat, at = np.full(y_hat.shape[:2], -self.means @ self.coefficients), 0
        for block in self.features.blocks(u, y_hat):
            e_hat += block @ self.coefficients[at : at + block.shape[2]]
            at += block.shape[2]
        return np.clip(e_hat, -self.largest, self.largest)


@dataclass(frozen=True, eq=False)
class Rest:
    """The learnt rest of every output of a data set; None where cross-validation shows nothing to learn."""

    outputs: tuple[Predictor | None, ...]

    @property
    def n_params(self) -> int:
        """Numbers that were estimated."""
        return sum(rest.n_params for rest in self.outputs if rest)

    def predict(
        self, u: Float[np.ndarray, "B T nu"], y_hat: Float[np.ndarray, "B T ny"]
    ) -> Float[np.ndarray, "B T ny"]:
        """Predict the errors y - y_hat of simulations from their first sample on; the past of each is what it knows."""
        return np.stack(
            [rest.predict(u, y_hat) if rest else np.zeros(y_hat.shape[:2]) for rest in self.outputs], axis=2
        )


def learn(model: GreyBoxModel, seed: int) -> Rest:
    """Regress the training errors of a fitted model on features of the inputs and of what it simulates.

        e(t) = c phi(t) + what is not learnt,   phi: z and cos(w z + b), as they are and through the plant's poles
        c = argmin |e - Phi c|^2 + ridge N |c|^2

    Random Fourier features of a Gaussian kernel (Rahimi and Recht, NIPS 2007), w drawn from `seed`; a missing force
    passes the plant's poles. Design and ridge are those that predict best what was held out: whole experiments or,
    where there are few, parts of them longer than the memory of the error.
    """
    y_hat = simulated(model)
    outputs: dict[int, RestOfOutput | None] = {}
    with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that grows without bound
        for plant in model.plants:
            outputs |= zip(plant.outputs, _learn_plant(plant, y_hat, seed), strict=True)
    return Rest(tuple(outputs[i] for i in sorted(outputs)))


def estimated_again(rest: Rest, model: GreyBoxModel) -> Rest:
    """Estimate the same regressions from the training errors of another fit of the model; other predictors stay."""
    y_hat, outputs = simulated(model), list(rest.outputs)
    for plant in model.plants:
        records, rows = plant.records, _spread_rows(plant.records.mask)
        for j, output in enumerate(plant.outputs):
            if isinstance(before := outputs[output], RestOfOutput):
                e = plant.estimate.errors[..., [j]]
                phi = _columns(before.features, records.u, y_hat, rows)
                again = _Regressions.fit(phi, e[rows], folds(e, records.mask)[rows])
                outputs[output] = replace(before, means=again.means, coefficients=again.coefficients[:, 0].copy())
    return Rest(tuple(outputs))


def simulated(model: GreyBoxModel) -> Float[np.ndarray, "E T ny"]:
    """Simulate all outputs of the training records."""
    runs = [plant.simulate_training() for plant in model.plants]
    order = [output for plant in model.plants for output in plant.outputs]
    return np.concatenate(runs, axis=2)[:, :, np.argsort(order)]


def _learn_plant(plant: FittedPlant, y_hat: np.ndarray, seed: int) -> list[RestOfOutput | None]:
    """Find for each output the design and the ridge that predict best; None where even they may be chance."""
    records, e = plant.records, plant.estimate.errors  # [E, T, ny]
    u, mask = records.u, records.mask
    fold = folds(e, mask)
    rows = _spread_rows(mask)
    if len(np.unique(fold[rows])) < 3:
        return [None] * e.shape[2]  # too short to hold anything out
    denominator = denominator_of(plant.estimate.plant, plant.estimate.theta, mask.shape[1])
    tried = []
    for design in DESIGNS:
        features = Features.draw(design, u, y_hat, mask, denominator, seed)
        tried.append((features, _Regressions.fit(_columns(features, u, y_hat, rows), e[rows], fold[rows])))
    rests: list[RestOfOutput | None] = []
    for j in range(e.shape[2]):
        features, best = min(tried, key=lambda pair: float(pair[1].after[:, j].sum()))
        before, after = best.before[:, j], best.after[:, j]
        rounding = float(records.rounding[j]) ** 2 * len(e[rows])
        largest = float(np.abs(e[..., j][mask]).max())
        share = float(1 - (after.sum() + rounding) / (before.sum() + rounding))
        rest = RestOfOutput(features, best.means, best.coefficients[:, j].copy(), largest, share)
        rests.append(rest if helps(before, after, rounding) else None)
    return rests


def helps(before: Float[np.ndarray, " k"], after: Float[np.ndarray, " k"], rounding: float) -> bool:
    """Tell whether the squared errors of folds fall by more than chance; every fold counts alike, however large."""
    gains = 1 - (after + rounding) / (before + rounding)
    certain = gains.mean() > CERTAIN * gains.std() / np.sqrt(len(gains) - 1)
    return bool(certain and before.sum() - after.sum() > MATTERS * before.sum() + rounding)


def folds(e: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"]) -> Int[np.ndarray, "E T"]:
    """Number the folds: whole experiments by turns or, where there are few, parts longer than the error's memory."""
    experiments, samples = mask.shape
    if experiments >= FOLDS:
        return np.repeat(np.arange(experiments)[:, None] % FOLDS, samples, axis=1)
    lengths = mask.sum(axis=1)
    tau = max(correlation_time(of_output - of_output.mean(), lengths, 1)[0] for of_output in e[mask].T)
    parts = np.clip(lengths // (MEMORIES * tau), 1, -(-2 * FOLDS // experiments)).astype(int)  # [E]
    part = np.arange(samples) * parts[:, None] // np.maximum(lengths, 1)[:, None]
    return (np.cumsum(parts)[:, None] - parts[:, None] + np.minimum(part, parts[:, None] - 1)) % FOLDS


def _columns(
    features: Features, u: Float[np.ndarray, "E T nu"], y_hat: Float[np.ndarray, "E T ny"], rows: np.ndarray
) -> Float[np.ndarray, "N f"]:
    return np.concatenate([block[rows] for block in features.blocks(u, y_hat)], axis=1)


def _spread_rows(mask: Bool[np.ndarray, "E T"]) -> Bool[np.ndarray, "E T"]:
    rows = np.zeros_like(mask)
    rows[mask] = np.arange(mask.sum()) % -(-mask.sum() // ROWS) == 0
    return rows


@dataclass(frozen=True, eq=False)
class _Regressions:
    """Ridge regressions of several outputs on the same features, each with the ridge that predicts it best.

    before, after: squared errors of each fold held out, without and with the regression.
    """

    means: Float[np.ndarray, " f"]
    coefficients: Float[np.ndarray, "f ny"]
    before: Float[np.ndarray, "k ny"]
    after: Float[np.ndarray, "k ny"]

    @classmethod
    def fit(
        cls, phi: Float[np.ndarray, "N f"], e: Float[np.ndarray, "N ny"], fold: Int[np.ndarray, " N"]
    ) -> _Regressions:
        """Fit with every ridge, without each fold in turn; the moments of the folds are all that it takes."""
        means, spreads = phi.mean(axis=0), phi.std(axis=0)
        spreads = np.where(spreads > 0, spreads, 1.0)
        phi = phi - means
        phi /= spreads
        inside = [fold == k for k in np.unique(fold)]
        grams, moments = [phi[i].T @ phi[i] for i in inside], [phi[i].T @ e[i] for i in inside]
        gram, moment = np.sum(grams, axis=0), np.sum(moments, axis=0)
        before = np.stack([np.sum(e[i] ** 2, axis=0) for i in inside])
        after = np.empty((len(RIDGES), *before.shape))
        for k, i in enumerate(inside):
            for r, ridge in enumerate(RIDGES):
                c = _solved(gram - grams[k], moment - moments[k], ridge * np.sum(~i))  # [f, ny]
                after[r, k] = before[k] + np.sum(c * (grams[k] @ c - 2 * moments[k]), axis=0)
        best = np.argmin(after.sum(axis=1), axis=0)  # [ny]
        columns = np.arange(e.shape[1])
        fits = [_solved(gram, moment[:, j], float(RIDGES[best[j]]) * len(e)) for j in columns]
        coefficients = np.stack(fits, axis=1) / spreads[:, None]
        return cls(means, coefficients, before, after[best, :, columns].T)


def _solved(gram: np.ndarray, moment: np.ndarray, ridge: float) -> np.ndarray:
    return cho_solve(cho_factor(gram + ridge * np.eye(len(gram)), check_finite=False), moment, check_finite=False)
