"""The linear model A(q) y(t) = B(q) u(t) + C(q) e(t), and how it is simulated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.kernels import filter_matrix

if TYPE_CHECKING:
    import control


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A(q) (y - y_mean) = B(q) (u - u_mean) + C(q) e, with q^-1 the delay by one sample.

    a [N+1, ny, ny] and c [N+1, ny, ny] are monic; b [N+1, ny, nu] holds lag k in b[k], a delay as leading zeros.
    With C = I it is ARX, with C = A output error. All share one observer-form state z [N, ny],

        y_hat = z_0 + B_0 u,   z_k <- z_{k+1} + B_{k+1} u - A_{k+1} y_hat + (C_{k+1} - A_{k+1}) (y - y_hat),

    in which a simulation is the prediction with y = y_hat (Ljung 1999, section 4.3).
    """

    a: Float[np.ndarray, "N1 ny ny"]
    b: Float[np.ndarray, "N1 ny nu"]
    c: Float[np.ndarray, "N1 ny ny"]
    u_mean: Float[np.ndarray, " nu"]
    y_mean: Float[np.ndarray, " ny"]
    dt: float

    @property
    def order(self) -> int:
        """N, the number of past samples that the state holds."""
        return len(self.a) - 1

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free from the state that the first n samples show; no measured output is used after them."""
        n = y_init.shape[1]
        u = u - self.u_mean
        state = self.state_after(u[:, :n], y_init - self.y_mean)
        y = _run(self.a, self.b, u[:, n:], state)
        y += self.y_mean
        return y

    def predict(self, u: Float[np.ndarray, "B T nu"], y: Float[np.ndarray, "B T ny"]) -> Float[np.ndarray, "B T ny"]:
        """Predict y_hat(t | t-1) from measured outputs; the start state fits the whole record."""
        u, y = u - self.u_mean, y - self.y_mean
        return self._follow(u, y, self._start_state(u, y)) + self.y_mean

    @cached_property
    def state_space(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """F, G, H, D of the observer form: z+ = F z + G u, y = H z + D u."""
        ny, size = len(self.y_mean), self.order * len(self.y_mean)
        shift = np.eye(size, k=ny)
        shift[:, :ny] -= self.a[1:].reshape(size, ny)
        drive = (self.b[1:] - self.a[1:] @ self.b[0]).reshape(size, self.b.shape[2])
        return shift, drive, np.eye(ny, size), self.b[0]

    @cached_property
    def poles(self) -> np.ndarray:
        """Eigenvalues of the simulation; one outside the unit circle makes a free run grow without bound."""
        return np.linalg.eigvals(self.state_space[0])

    def to_control(self) -> control.StateSpace:
        """Convert to python-control, for deviations from the operating point.

        forced_response(to_control(), U=(u - u_mean).T) + y_mean equals a free run that starts at rest.
        """
        import control

        return control.StateSpace(*self.state_space, self.dt)

    @cached_property
    def _predictor(self) -> Float[np.ndarray, "N1 ny nuy"]:
        # C y_hat = B u + (C - A) y: the recursion of the simulation, with y as a further input.
        return np.concatenate((self.b, self.c - self.a), axis=2)

    def _follow(self, u: np.ndarray, y: np.ndarray, start: np.ndarray) -> np.ndarray:
        return _run(self.c, self._predictor, np.concatenate((u, y), axis=2), start)

    def _start_state(self, u: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Estimate z [B, N, ny] at t = 0 by least squares on the one-step prediction errors of the record.

        What the record is too short to tell is taken from a plant that had stood at its first sample for long.
        """
        batch, n, ny = y.shape
        rest = np.concatenate((self.b, -self.a), axis=2)[:0:-1].cumsum(axis=0)[::-1]  # [N, ny, nu+ny]
        start = np.einsum("kij,sj->ski", rest, np.concatenate((u[:, 0], y[:, 0]), axis=1))
        if self.order == 0:
            return start
        error = (y - self._follow(u, y, start)).reshape(batch, n * ny)
        effect = np.linalg.pinv(self._free_response(n), rcond=1e-10)
        return start + (error @ effect.T).reshape(batch, self.order, ny)

    def _free_response(self, n: int) -> np.ndarray:
        """Compute what each element of z adds to the next n predictions, [n*ny, N*ny]."""
        ny, size = len(self.y_mean), self.order * len(self.y_mean)
        unit = np.eye(size).reshape(size, self.order, ny)
        nothing = np.zeros((size, n, self._predictor.shape[2]))
        return _run(self.c, self._predictor[:1], nothing, unit).reshape(size, n * ny).T

    def state_after(self, u: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Compute z [B, N, ny] at t = n, after the predictor has followed the n measured samples."""
        n, start = y.shape[1], self._start_state(u, y)
        signals = np.concatenate((u, y, self._follow(u, y, start)), axis=2)
        weights = np.concatenate((self._predictor, -self.c), axis=2)
        state = np.zeros_like(start)
        for k in range(self.order):
            if n + k < self.order:
                state[:, k] = start[:, n + k]
            oldest = min(self.order, n + k)  # of the lags, the last one that reaches into the record
            past = signals[:, n + k - oldest :]
            state[:, k] += np.tensordot(past, weights[oldest:k:-1], axes=((1, 2), (0, 2)))
        return state


def _run(a: np.ndarray, b: np.ndarray, u: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Solve A(q) y = B(q) u from the state z, for arrays in any memory order."""
    return filter_matrix(*(np.ascontiguousarray(part) for part in (a[1:], b, u, z)))
