"""The one-step prediction error of A(q) y = B(q) u + C(q) e, its sum of squares and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import stack
from simgap.baselines.estimation.filters import divide, multiply
from simgap.baselines.estimation.fitted import Row
from simgap.baselines.estimation.gram import Gram
from simgap.baselines.estimation.levenberg import Cost, stable, sum_up
from simgap.baselines.estimation.orders import Orders


@dataclass(frozen=True, eq=False)
class PredictionError:
    """One output, y = Phi theta + C e, for each batch of experiments of one length.

    Only samples whose regressors are all measured are predicted. The nc samples of e before them are estimated
    along and count in the sum of squares (Box and Jenkins 1976, section 7.1, unconditional least squares): taken as
    zero, they cost efficiency wherever 1/C rings for long; taken as free, C is drawn to the unit circle.
    """

    u: list[Float[np.ndarray, "_ _ nu"]]
    phi: list[Float[np.ndarray, "p _ _"]]
    y: list[Float[np.ndarray, "_ _"]]
    nc: int
    constant: bool

    @classmethod
    def of(cls, gram: Gram, orders: Orders, output: int, constant: bool) -> PredictionError:
        inputs, phi, targets = [], [], []
        ny, lags = len(orders.na), gram.max_lag
        for u, y in stack(gram.experiments):
            signals = np.concatenate((y, u), axis=2) - gram.shift  # [B, T, S]
            end = signals.shape[1]
            columns = [
                signals[:, lags - lag : end - lag, signal] * (-1.0 if signal < ny else 1.0)
                for signal, lag in orders.lagged(output)
            ]
            inputs.append(signals[:, lags:, ny:])
            targets.append(signals[:, lags:, output])
            phi.append(np.stack([*columns, np.ones_like(targets[-1])] if constant else columns))
        return cls(inputs, phi, targets, int(orders.nc[output]), constant)

    @property
    def linear(self) -> int:
        """How many coefficients stand before those of C."""
        return len(self.phi[0])

    @property
    def coefficients(self) -> list[int]:
        """Where theta holds coefficients of A, B and C: everywhere but at the constant, which ends the linear part."""
        first_part = self.linear - self.constant
        return [*range(first_part), *range(self.linear, self.linear + self.nc)]

    def theta_of(self, row: Row) -> np.ndarray:
        """Give theta of an estimated equation, with no constant."""
        theta = np.zeros(self.linear + self.nc)
        theta[self.coefficients] = row.values
        return theta

    @property
    def samples(self) -> int:
        return sum(y.size for y in self.y)

    def noise(self, theta: np.ndarray) -> np.ndarray:
        """C as a monic polynomial."""
        return np.concatenate(([1.0], theta[self.linear :]))

    def allowed(self, theta: np.ndarray) -> list[np.ndarray]:
        """Points with the roots of C inside the unit circle, where the predictor forgets its start."""
        return [np.concatenate((theta[: self.linear], c[1:])) for c in stable(self.noise(theta))]

    def errors(self, theta: np.ndarray) -> list[np.ndarray]:
        """Compute [B, nc + T]: the nc samples of e before the record that make the sum of squares smallest, then e."""
        residuals = (y - np.tensordot(theta[: self.linear], phi, 1) for phi, y in zip(self.phi, self.y, strict=True))
        return [self._without_start(self._filtered(residual, theta), theta) for residual in residuals]

    def past(self, e: np.ndarray) -> np.ndarray:
        """Stack e one to nc samples ago, [nc, B, T]."""
        batch, length = e.shape[0], e.shape[1] - self.nc
        lagged = [e[:, self.nc - k : self.nc - k + length] for k in range(1, self.nc + 1)]
        return np.array(lagged).reshape(self.nc, batch, length)

    def squares(self, theta: np.ndarray) -> float:
        """Compute |e|^2."""
        return sum(float(np.vdot(e, e)) for e in self.errors(theta))

    def cost(self, theta: np.ndarray) -> Cost:
        """Compute |e|^2, half its gradient and J' J."""
        return sum_up(self.linearised(theta))

    def linearised(self, theta: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield e [B, nc + T] and de/dtheta [p, B, nc + T] of each batch.

        The Jacobian is -Phi / C and -q^-k e / C (Ljung 1999, eq. 10.53). The start is eliminated at every point:
        variable projection with Kaufman's Jacobian (1975).
        """
        for phi, e in zip(self.phi, self.errors(theta), strict=True):
            jacobian = -self._filtered(np.concatenate((phi, self.past(e))), theta)
            yield e, self._without_start(jacobian, theta)

    def pseudo_linear(self, errors: list[np.ndarray]) -> np.ndarray:
        """Estimate theta by least squares on Phi and on past errors that are taken as known."""
        columns = (np.concatenate((phi, self.past(e))) for phi, e in zip(self.phi, errors, strict=True))
        products = sum_up(zip(self.y, columns, strict=True))
        return self.allowed(np.linalg.lstsq(products.hessian, products.gradient, rcond=1e-14)[0])[0]

    def _filtered(self, signals: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """signals / C with nothing in the nc samples before them."""
        before = np.zeros((*signals.shape[:-1], self.nc))
        return np.concatenate((before, divide(signals, self.noise(theta))), axis=-1)

    def _without_start(self, signals: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """Project signals [..., nc + T] off what e before the record adds: itself, and its response through 1/C."""
        if self.nc == 0:
            return signals
        c = self.noise(theta)
        echo = signals[..., : self.nc + _ringing(c, signals.shape[-1] - self.nc)]
        impulse = np.eye(1, echo.shape[-1] - self.nc)[0]
        start = np.eye(self.nc, echo.shape[-1])
        for k in range(self.nc):  # row k is a unit e, nc - k samples before the record
            start[k, self.nc :] = divide(multiply(-c[self.nc - k :], impulse), c)
        basis = np.linalg.qr(start.T)[0]  # [n, nc]
        echo -= (echo @ basis) @ basis.T
        return signals


def _ringing(c: np.ndarray, length: int) -> int:
    """Count the samples until 1/C has rung out to rounding: r^n < 1e-17 for its largest root r, and some more."""
    radius = np.abs(np.roots(c)).max(initial=0.0)
    if radius > 0.999:
        return length
    return min(length, 60 + int(40 / -np.log(max(radius, 1e-9))))
