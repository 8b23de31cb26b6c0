"""Linear filters and static curves in a row, and their simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.curve_kernels import spline
from simgap.baselines.estimation.filters import divide, multiply

STATE_STEPS = 8  # of Gauss-Newton, from the state at rest
STATE_GAIN = 1e-6  # a step that gains less of the loss is the last


@dataclass(frozen=True, eq=False)
class Blocks:
    """One output, y = sum_i G_i(q) f_i(x_i) + y_mean, with x_i = sum_j H_ij(q) (u_j - u_mean_j), for branches i.

    H_ij = b1[i, j] / f1 and G_i = b2[i] / f2; the curve f_i is a cubic spline of coefficients c[i] from low[i] on.
    A Wiener model has G = 1, a Hammerstein model one branch per input with H = 1.
    noise, x_size, y_size: standard deviations of the simulation error, of x_i and of y, which tell how far a few
    measured samples are to be trusted with the start state.
    """

    b1: Float[np.ndarray, "m nu L1"]
    f1: Float[np.ndarray, " N1"]
    c: Float[np.ndarray, "m K"]
    low: Float[np.ndarray, " m"]
    step: Float[np.ndarray, " m"]
    b2: Float[np.ndarray, "m L2"]
    f2: Float[np.ndarray, " N2"]
    u_mean: Float[np.ndarray, " nu"]
    y_mean: float
    noise: float
    x_size: Float[np.ndarray, " m"]
    y_size: float

    @property
    def states(self) -> tuple[int, int]:
        """Past samples that act on the future through 1/f1, of each branch, and through 1/f2."""
        return max(len(self.f1), self.b1.shape[-1]) - 1, max(len(self.f2), self.b2.shape[-1]) - 1

    def simulate(self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n"]) -> Float[np.ndarray, "B T-n"]:
        """Run free from the state that the first n samples show."""
        n = y_init.shape[1]
        u = u - self.u_mean
        run = Run.of(self, u, self.start_state(u[:, :n], y_init - self.y_mean))
        return run.y[:, n:] + self.y_mean

    def start_state(self, u: Float[np.ndarray, "B n nu"], y: Float[np.ndarray, "B n"]) -> Float[np.ndarray, "B N"]:
        """Find the most likely state z before the record, by Gauss-Newton: a normal prior, white measurement noise.

        z holds what the past adds to the first samples of each x_i and of y; at rest it is zero.
        """
        z = np.zeros((len(u), self.c.shape[0] * self.states[0] + self.states[1]))
        if z.shape[1] == 0:
            return z
        weight, damping = self.prior_weight, np.zeros(len(u))
        run = Run.of(self, u, z)
        loss, moving = _posterior(run.y - y, z, weight), np.ones(len(u), dtype=bool)
        for _ in range(STATE_STEPS):
            jacobian = run.state_jacobian()  # [B, N, n]
            gradient = (jacobian @ (run.y - y)[:, :, None])[:, :, 0] + weight * z
            hessian = jacobian @ np.swapaxes(jacobian, 1, 2) + np.diag(weight)
            scale = np.einsum("bii->bi", hessian)
            hessian = hessian + np.eye(z.shape[1]) * (scale * damping[:, None])[:, None, :]
            trial = z - np.linalg.solve(hessian, gradient[:, :, None])[:, :, 0]
            trial_run = Run.of(self, u, trial)
            trial_loss = _posterior(trial_run.y - y, trial, weight)
            better = moving & (trial_loss < loss)
            # Each record stops for itself, so that a batch is simulated like its records one by one.
            moving &= ~better | (loss - trial_loss > STATE_GAIN * loss)
            z = np.where(better[:, None], trial, z)
            loss = np.where(better, trial_loss, loss)
            damping = np.where(better, damping / 10, np.maximum(damping * 10, 0.01))
            if not moving.any():
                break
            run = trial_run if better.all() else Run.of(self, u, z)
        return z

    def through(self, i: int, w: Float[np.ndarray, "*_ T"], whole: bool = True) -> Float[np.ndarray, "*_ T"]:
        """Filter by b2[i], and by 1/f2 too if `whole`."""
        v = multiply(self.b2[i], w) if self.b2.shape[1] > 1 else self.b2[i, 0] * w
        return divide(v, self.f2) if whole else v

    @property
    def prior_weight(self) -> Float[np.ndarray, " N"]:
        """Variance of the error over that of each element of the state."""
        first, second = self.states
        sizes = np.concatenate((np.repeat(self.x_size, first), np.full(second, self.y_size)))
        return self.noise**2 / np.maximum(sizes, 1e-12 * self.y_size) ** 2


def _posterior(e: np.ndarray, z: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return np.sum(e**2, axis=1) + np.sum(weight * z**2, axis=1)


@dataclass(frozen=True, eq=False)
class Run:
    """What flows through the blocks: x and f(x), f'(x) [m, B, T], and y [B, T] without its mean."""

    model: Blocks
    x: Float[np.ndarray, "m B T"]
    w: Float[np.ndarray, "m B T"]
    slope: Float[np.ndarray, "m B T"]
    y: Float[np.ndarray, "B T"]

    @classmethod
    def of(cls, model: Blocks, u: Float[np.ndarray, "B T nu"], z: Float[np.ndarray, "B N"]) -> Run:
        """Simulate from the state z; u is without its mean."""
        (batch, length, nu), m = u.shape, len(model.c)
        first, second = model.states
        x = np.empty((m, batch, length))
        for i in range(m):
            x[i] = sum(multiply(model.b1[i, j], u[:, :, j]) for j in range(nu) if model.b1[i, j].any())
            x[i, :, : min(first, length)] += z[:, i * first : (i + 1) * first][:, :length]
        x = divide(x, model.f1)
        w, slope = np.empty_like(x), np.empty_like(x)
        for i in range(m):
            f, df = spline(x[i].ravel(), model.low[i], model.step[i], model.c[i])
            w[i], slope[i] = f.reshape(batch, length), df.reshape(batch, length)
        y = np.sum([model.through(i, w[i], whole=False) for i in range(m)], axis=0)
        y[:, : min(second, length)] += z[:, m * first :][:, :length]
        return cls(model, x, w, slope, divide(y, model.f2))

    def state_jacobian(self) -> Float[np.ndarray, "B N T"]:
        """Compute dy/dz."""
        (m, batch, length), (first, second) = self.x.shape, self.model.states
        free = divide(np.eye(first, length), self.model.f1)
        of_x = [self.model.through(i, free * self.slope[i, :, None]) for i in range(m) if first]
        of_y = np.broadcast_to(divide(np.eye(second, length), self.model.f2), (batch, second, length))
        return np.concatenate((*of_x, of_y), axis=1)
