"""Residual analysis: is there anything left in the errors that the past or the input explains?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve_toeplitz

from simgap.baselines.estimation.box_jenkins_error import BoxJenkinsError
from simgap.baselines.estimation.filters import divide
from simgap.baselines.estimation.fitted import LinearFit
from simgap.baselines.estimation.gram import lagged_gram
from simgap.baselines.estimation.output_error import OutputError
from simgap.baselines.estimation.prediction_error import PredictionError
from simgap.records import Experiment

# Correlations settle long before; more samples would only cost memory.
ENOUGH_SAMPLES = 50_000
# A record shorter than so many times the largest lag says little of it.
RECORD_TO_LAG = 5


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation coefficients [L] of a residual with a signal `lags` samples ago, and their 95 % bounds [L]."""

    signal: str
    lags: Int[np.ndarray, " L"]
    values: Float[np.ndarray, " L"]
    bounds: Float[np.ndarray, " L"]

    @property
    def outside(self) -> Int[np.ndarray, " n"]:
        """The lags whose correlation is more than chance; one in twenty is expected."""
        return self.lags[np.abs(self.values) > self.bounds]

    def text(self) -> str:
        """Say how many lags are outside, which, and how many chance would put there."""
        expected = 0.05 * len(self.lags)
        lags = ", ".join(map(str, self.outside[:8])) + (", .." if len(self.outside) > 8 else "")
        return (
            f"residual with {self.signal}: {len(self.outside)} of {len(self.lags)} lags outside the 95 % bounds "
            f"({expected:.1f} by chance)" + (f": {lags}" if lags else "")
        )


def residual_analysis(
    fit: LinearFit, experiments: Sequence[Experiment], inputs: Sequence[str], max_lag: int = 25
) -> list[list[Correlation]]:
    """Correlate, for each output, the residual with its own past, lags 1..L, then with each input, lags -L..L.

    `inputs` are their names, for the texts. A correlation at negative lags means feedback. The bounds are 1.96
    standard deviations if the model is right, less what the estimated parameters take away (Box and Pierce 1970),

        r(tau) = z' e / (|z| |e|),   var z' e = z' M R_e M z,   M = 1 - psi (psi' psi)^-1 psi',

    for z(t) = u(t - tau) or e(t - tau) and psi the Jacobian of the errors (Ljung 1999, section 16.6). The plain 1/N is
    too wide at small lags, and wrong where residual and input are both coloured. Short records are asked for fewer
    lags; where even one lag is too many, an output has no findings.
    """
    longest = max(map(len, experiments)) - fit.orders.max_lag
    max_lag = max(1, min(max_lag, longest // RECORD_TO_LAG))
    return [_of_output(fit, experiments, i, inputs, max_lag) for i in range(len(fit.rows))]


def _of_output(
    fit: LinearFit, experiments: Sequence[Experiment], output: int, inputs: Sequence[str], max_lag: int
) -> list[Correlation]:
    pieces = [piece for piece in _aligned(fit, experiments, output) if len(piece[0]) >= RECORD_TO_LAG * max_lag]
    if not pieces:
        return []
    own = range(1, max_lag + 1)
    both = range(-max_lag, max_lag + 1)
    correlations = [_correlate("its own past", pieces, own, lambda e, u: e, white=True)]
    for j, name in enumerate(inputs):
        correlations.append(_correlate(name, pieces, both, lambda e, u, j=j: u[:, j], white=False))
    return correlations


def _aligned(fit: LinearFit, experiments: Sequence[Experiment], output: int) -> Iterator[tuple]:
    """Yield e [T], Jacobian [p, T] and u [T, nu] of each experiment, over the same samples, until there are enough."""
    model, before = fit.polynomial, 0
    shift = np.concatenate((model.y_mean, model.u_mean))
    equation: BoxJenkinsError | OutputError | PredictionError
    if fit.orders.nd.any() or (fit.orders.nf.any() and fit.orders.nc.any()):
        equation = BoxJenkinsError.of(experiments, shift, fit.orders, output, True)
    elif fit.orders.nf.any():
        equation = OutputError.of(experiments, shift, fit.orders, output, True, None)
    else:
        equation = PredictionError.of(lagged_gram(experiments, shift, fit.orders.max_lag), fit.orders, output, True)
        before = equation.nc
    theta = equation.theta_of(fit.rows[output])
    seen = 0
    for (e, jacobian), u in zip(equation.linearised(theta), equation.u, strict=True):
        for s in range(len(e)):
            if seen >= ENOUGH_SAMPLES:
                return
            counted = slice(before, before + ENOUGH_SAMPLES)
            seen += e.shape[1] - before
            yield e[s, counted], jacobian[:, s, counted], u[s, :ENOUGH_SAMPLES]


def _correlate(name: str, pieces: list, lags: range, signal_of, white: bool) -> Correlation:
    """Correlate over the samples of each piece for which every lag exists; pieces are summed, never glued."""
    first, last = max(lags[-1], 0), max(-lags[0], 0)
    errors, jacobians, lagged = [], [], []
    for e, jacobian, u in pieces:
        end = len(e) - last
        z = signal_of(e, u)
        errors.append(e[first:end])
        jacobians.append(jacobian[:, first:end])
        lagged.append(np.stack([z[first - lag : end - lag] for lag in lags]))  # [L, n]
    e, psi, z = (np.concatenate(parts, axis=-1) for parts in (errors, jacobians, lagged))
    own = z - np.linalg.lstsq(psi.T, z.T, rcond=None)[0].T @ psi  # M z
    norms = np.linalg.norm(z, axis=1) * np.linalg.norm(e)
    norms[norms == 0] = 1.0
    if white:
        variance = np.sum(own**2, axis=1) * float(e @ e) / len(e)
    else:
        ends = np.cumsum([len(part) for part in errors])[:-1]
        variance = _coloured_variance(errors, np.split(own, ends, axis=1))
    # z' M e rather than z' e: over these samples e is not quite orthogonal to psi any more. A lag that the model's
    # own regressors hold has correlation and bound zero, but for rounding.
    return Correlation(name, np.array(lags), own @ e / norms, 1.96 * np.sqrt(variance) / norms + 1e-9)


def _coloured_variance(errors: list[np.ndarray], own: list[np.ndarray], order: int = 5) -> np.ndarray:
    """Compute var z' e for e = w / D(q), an autoregression fitted to the residual: var w * |z filtered backwards|^2."""
    products = [sum(float(e[k:] @ e[: len(e) - k]) for e in errors) for k in range(order + 1)]
    total = sum(map(len, errors))
    if products[0] == 0:
        return np.zeros(len(own[0]))
    d = np.concatenate(([1.0], -solve_toeplitz(products[:-1], products[1:])))
    innovation = float(d @ products) / total
    return innovation * np.sum([np.sum(divide(z[:, ::-1], d) ** 2, axis=1) for z in own], axis=0)
