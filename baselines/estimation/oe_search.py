"""Output error: y = B(q)/F(q) u + e by minimising the simulation error from the best of several linear estimates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import stack
from simgap.baselines.estimation.equation_error import check_length, estimate_arx
from simgap.baselines.estimation.filters import divide
from simgap.baselines.estimation.fitted import LinearFit, Row
from simgap.baselines.estimation.gram import lagged_gram
from simgap.baselines.estimation.levenberg import minimise, stable
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.estimation.output_error import OutputError
from simgap.baselines.estimation.polynomial import Polynomial
from simgap.records import Experiment


def estimate_oe(
    experiments: Sequence[Experiment],
    shift: Float[np.ndarray, " S"],
    orders: Orders,
    constant: bool = True,
    n_start: int | None = None,
    start: LinearFit | None = None,
) -> LinearFit:
    """Minimise the squared simulation error, one output at a time, F kept stable (Ljung 1999, section 10.2).

    With n_start, each simulation starts from the state that the first n_start samples show, and only what follows
    counts: the error that is minimised is the free run that will be scored. Without it the start states are free
    parameters: efficient under white noise, but slow modes then absorb whatever the model lacks.
    The search begins at `start`, an earlier fit, and around its operating point, or else at the two best of several
    linear estimates. Raises TooFewSamples when the experiments are too short for the order.
    """
    shift = start.operating_point if start else shift
    ny = len(orders.nb)
    rows, transfers, constants, samples = [], [], np.zeros(ny), 0
    for i in range(ny):
        equation = OutputError.of(experiments, shift, orders, i, constant, n_start)
        samples = equation.samples
        check_length(samples, equation.n_params, equation.n_start or 0)
        if start:
            thetas = [equation.theta_of(start.rows[i])]
        else:
            candidates = oe_starts(experiments, shift, orders, i, equation)
            thetas = sorted(candidates, key=equation.squares)[:2]
        searches = [minimise(equation, theta) for theta in thetas]
        best = min(searches, key=lambda search: search.cost.squares)
        names = equation.names
        rows.append(Row.at(best, names, range(len(names)), samples))
        transfers.append(equation.transfer(best.theta))
        constants[i] = best.theta[-1] if constant else 0.0
    return assemble_outputs(experiments[0].dt, shift, orders, tuple(rows), transfers, constants, samples)


def oe_starts(
    experiments: Sequence[Experiment], shift: np.ndarray, orders: Orders, output: int, equation: OutputError
) -> Iterator[np.ndarray]:
    """Yield theta of ARX on the data and on the free run of a long ARX, each refined by Steiglitz-McBride (1965)."""
    ny = len(orders.nb)
    signals = [output, *range(ny, len(shift))]
    own = [Experiment(e.name, e.u, e.y[:, output : output + 1], e.dt) for e in experiments]
    yield from _steiglitz_mcbride(own, shift[signals], equation)
    lags = max(orders.max_lag, int(orders.nf.max()))
    length = min(3 * lags + 20, min(map(len, own)) // 4, sum(map(len, own)) // (4 * len(signals)))
    if length > lags:
        long = Orders.of(1, len(signals) - 1, na=length, nb=length, nk=1)
        model = estimate_arx(lagged_gram(own, shift[signals], length), long).polynomial
        if np.abs(model.poles).max() < 1:
            smooth = [
                Experiment("", *simulated, own[0].dt)
                for u, y in stack(own)
                for simulated in zip(u[:, length:], model.simulate(u, y[:, :length]), strict=True)
            ]
            yield from _steiglitz_mcbride(smooth, shift[signals], equation)


def _steiglitz_mcbride(
    experiments: Sequence[Experiment], shift: np.ndarray, equation: OutputError
) -> Iterator[np.ndarray]:
    """Yield theta of ARX fits to u/F and y/F, with F from the fit before."""
    nf = max(equation.nf[j] for j in equation.used)
    arx = Orders.of(1, len(equation.nb), na=nf, nb=[list(equation.nb)], nk=[list(equation.nk)])
    f = np.ones(1)
    for _ in range(8):
        filtered = _filter(experiments, shift, f)
        model = estimate_arx(lagged_gram(filtered, np.zeros(len(shift)), arx.max_lag), arx).polynomial
        f = stable(model.a[: nf + 1, 0, 0], radius=1 - 1e-3)[0]
        slowest_first = sorted(np.roots(f), key=abs, reverse=True)
        theta = []
        for j in equation.used:
            own = np.real(np.poly(slowest_first[: equation.nf[j]])) if equation.nf[j] < nf else f
            theta += [own[1:], model.b[equation.nk[j] : equation.nk[j] + equation.nb[j], 0, j]]
        yield np.concatenate([*theta, np.zeros(int(equation.constant))])


def _filter(experiments: Sequence[Experiment], shift: np.ndarray, f: np.ndarray) -> list[Experiment]:
    """Filter every signal of the experiments by 1/F."""
    return [
        Experiment("", *filtered, experiments[0].dt)
        for u, y in stack(experiments)
        for filtered in zip(divide(u - shift[1:], f, axis=1), divide(y - shift[0], f, axis=1), strict=True)
    ]


def assemble_outputs(
    dt: float,
    shift: np.ndarray,
    orders: Orders,
    rows: tuple[Row, ...],
    transfers: list,
    constants: np.ndarray,
    samples: int,
    longest: int = 1,
) -> LinearFit:
    """Assemble one polynomial model of `longest` coefficients or more: A holds the common denominators, and C = A."""
    ny, nu = orders.nb.shape
    order = max(longest, *(len(part) for f, numerators in transfers for part in (f, *numerators.values()))) - 1
    a, b = np.zeros((order + 1, ny, ny)), np.zeros((order + 1, ny, nu))
    for i, (f, numerators) in enumerate(transfers):
        a[: len(f), i, i] = f
        for j, numerator in numerators.items():
            b[: len(numerator), i, j] = numerator
    # The constant was added to the output, so it is part of the operating point already.
    polynomial = Polynomial(a, b, a, shift[ny:], shift[:ny] + constants, dt)
    return LinearFit(polynomial, orders, rows, constants, samples)
