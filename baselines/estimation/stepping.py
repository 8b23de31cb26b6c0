"""Linear models as a step form, for exports."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.polynomial import Polynomial
from simgap.step_form import StepForm, source_of


def difference_equation(
    s: list, u: list, y: list, a: list, b: list, u_mean: list, y_mean: list, n: int, nu: int, ny: int
):
    """A(q) (y - y_mean) = B(q) (u - u_mean); s holds what the start adds to the next n outputs, then the past y and u.

    The sums run as in `filter_matrix`, so that integrators far from their operating point round alike.
    """
    past_y = n * ny
    past_u = 2 * n * ny
    for i in range(ny):
        y[i] = s[i] if n > 0 else 0.0
        for j in range(nu):
            y[i] += b[i * nu + j] * (u[j] - u_mean[j])
            for k in range(n):
                y[i] += b[((k + 1) * ny + i) * nu + j] * s[past_u + k * nu + j]
        for k in range(n):
            for j in range(ny):
                y[i] -= a[((n - k) * ny + i) * ny + j] * s[past_y + (n - 1 - k) * ny + j]
    for k in range(n):
        for i in range(ny):
            s[k * ny + i] = s[(k + 1) * ny + i] if k + 1 < n else 0.0
            s[past_y + (n - 1 - k) * ny + i] = s[past_y + (n - 2 - k) * ny + i] if k + 1 < n else y[i]
        for j in range(nu):
            s[past_u + (n - 1 - k) * nu + j] = s[past_u + (n - 2 - k) * nu + j] if k + 1 < n else u[j] - u_mean[j]
    for i in range(ny):
        y[i] += y_mean[i]


def step_form(model: Polynomial) -> StepForm:
    """Write a polynomial model as a step; it rests at its operating point."""
    n, (ny, nu) = model.order, model.b.shape[1:]
    step = (
        "def step(s: list, u: list, y: list):\n"
        '    """Fill y(k) from u(k), and take the state to the next sample."""\n'
        f"    difference_equation(s, u, y, A, B, U_MEAN, Y_MEAN, {n}, {nu}, {ny})\n"
    )
    constants = {"A": model.a, "B": model.b, "U_MEAN": model.u_mean, "Y_MEAN": model.y_mean}
    return StepForm(
        f"{source_of(difference_equation)}\n\n{step}", {name: array.ravel() for name, array in constants.items()},
        np.zeros(n * (2 * ny + nu)), nu, ny, bool(model.b[0].any()),
    )  # fmt: skip


def start(
    model: Polynomial, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"]
) -> Float[np.ndarray, " ns"]:
    """Return the state that the first n samples show."""
    state = model.state_after((u - model.u_mean)[None, : len(y_init)], (y_init - model.y_mean)[None])
    return np.append(state.ravel(), np.zeros(model.order * (y_init.shape[1] + u.shape[1])))
