"""Box-Jenkins: y = B(q)/F(q) u + C(q)/D(q) e by minimising the one-step prediction error from output error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.armax_search import estimate_armax
from simgap.baselines.estimation.box_jenkins_error import BoxJenkinsError
from simgap.baselines.estimation.equation_error import check_length
from simgap.baselines.estimation.fitted import LinearFit, Row
from simgap.baselines.estimation.levenberg import minimise, stable
from simgap.baselines.estimation.oe_search import assemble_outputs, oe_starts
from simgap.baselines.estimation.orders import Orders
from simgap.cores import one_thread
from simgap.records import Experiment


@one_thread()
def estimate_box_jenkins(
    experiments: Sequence[Experiment],
    shift: Float[np.ndarray, " S"],
    orders: Orders,
    constant: bool = True,
    start: LinearFit | None = None,
) -> LinearFit:
    """Minimise sum e^2 of e = D/C (y - B/F u), one output at a time, C and F kept stable (Ljung 1999, section 10.2).

    The search begins at `start`, an earlier fit, and around its operating point, or else at an output-error model and
    the ARMA model of its error. Raises TooFewSamples when the experiments are too short for the order.
    """
    shift = start.operating_point if start else shift
    ny = len(orders.nb)
    rows, transfers, noises, constants, samples = [], [], [], np.zeros(ny), 0
    for i in range(ny):
        equation = BoxJenkinsError.of(experiments, shift, orders, i, constant)
        samples = equation.samples
        check_length(samples, len(equation.coefficients) + constant, equation.nd)
        theta = equation.theta_of(start.rows[i]) if start else _start(experiments, shift, orders, i, equation)
        best = minimise(equation, theta)
        rows.append(Row.at(best, equation.names, equation.coefficients, samples))
        (c, d), (f, numerators) = equation.noise(best.theta), equation.plant.transfer(best.theta)
        transfers.append((np.convolve(f, d), {j: np.convolve(b, d) for j, b in numerators.items()}))
        noises.append(np.convolve(f, c))
        constants[i] = best.theta[equation.plant.n_params - 1] if constant else 0.0
    longest = max(map(len, noises))
    fit = assemble_outputs(experiments[0].dt, shift, orders, tuple(rows), transfers, constants, samples, longest)
    noise = np.zeros_like(fit.polynomial.a)
    for i, c in enumerate(noises):
        noise[: len(c), i, i] = c
    return replace(fit, polynomial=replace(fit.polynomial, c=noise))


def _start(
    experiments: Sequence[Experiment], shift: np.ndarray, orders: Orders, output: int, equation: BoxJenkinsError
) -> np.ndarray:
    """Give theta of the best output-error model, and of the ARMA model of what it leaves."""
    starts = oe_starts(experiments, shift, orders, output, equation.plant)
    plant = minimise(equation.plant, min(starts, key=equation.plant.squares), 30).theta
    left = [e[:, None] for run in equation.plant.runs(plant) for e in run.e]
    noise = Orders.of(1, 1, na=equation.nd, nb=0 if equation.nd else 1, nc=equation.nc)
    if not equation.nc + equation.nd:
        return plant
    records = [Experiment("", np.zeros_like(e), e, experiments[0].dt) for e in left]
    arma = estimate_armax(records, np.zeros(2), noise, constant=False).polynomial
    c, d = arma.c[: equation.nc + 1, 0, 0], arma.a[: equation.nd + 1, 0, 0]
    return np.concatenate((plant, stable(c)[0][1:], stable(d, 1 - 1e-3)[0][1:]))
