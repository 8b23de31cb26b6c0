"""The one-step prediction error of y = B(q)/F(q) u + C(q)/D(q) e, its sum of squares and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.filters import delayed, divide, multiply
from simgap.baselines.estimation.fitted import Row
from simgap.baselines.estimation.levenberg import Cost, stable, sum_up
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.estimation.output_error import OutputError, Run
from simgap.records import Experiment


@dataclass(frozen=True, eq=False)
class BoxJenkinsError:
    """One output, e = D(q)/C(q) v with v = y - sum_j B_j/F_j u_j - constant - R z.

    theta holds that of the plant, an output-error equation with its constant last, then the nc numbers of C and the
    nd of D. Only samples with nd measured ones before them are predicted, e is zero before. The start state z of the
    plant is eliminated at every point by least squares on all e (variable projection with Kaufman's Jacobian, 1975).
    """

    plant: OutputError
    nc: int
    nd: int

    @classmethod
    def of(cls, experiments: Sequence[Experiment], shift: np.ndarray, orders: Orders, output: int, constant: bool):
        plant = OutputError.of(experiments, shift, orders, output, constant, None)
        return cls(plant, int(orders.nc[output]), int(orders.nd[output]))

    @property
    def u(self) -> list[Float[np.ndarray, "_ _ nu"]]:
        """The inputs of the samples that are predicted."""
        return [u[:, self.nd :] for u in self.plant.u]

    @property
    def samples(self) -> int:
        """How many errors count."""
        return sum(y.shape[0] * (y.shape[1] - self.nd - self.plant.state) for y in self.plant.y)

    @property
    def coefficients(self) -> list[int]:
        """Where theta holds coefficients of F, B, C and D: everywhere but at the constant."""
        first = self.plant.n_params
        return [*range(first - self.plant.constant), *range(first, first + self.nc + self.nd)]

    @property
    def names(self) -> list[str]:
        """The names of those coefficients."""
        noise = [f"{letter}{k}" for letter, n in (("c", self.nc), ("d", self.nd)) for k in range(1, n + 1)]
        return self.plant.names + noise

    def theta_of(self, row: Row) -> np.ndarray:
        """Give theta of an estimated equation, with no constant."""
        theta = np.zeros(self.plant.n_params + self.nc + self.nd)
        theta[self.coefficients] = row.values
        return theta

    def noise(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Give C and D as monic polynomials."""
        c, d = np.split(theta[self.plant.n_params :], [self.nc])
        return np.concatenate(([1.0], c)), np.concatenate(([1.0], d))

    def allowed(self, theta: np.ndarray) -> list[np.ndarray]:
        """Give points with the roots of C inside the unit circle, and those of F and D inside it or on it."""
        plants = self.plant.allowed(theta[: self.plant.n_params])
        noises = [stable(part, radius) for part, radius in zip(self.noise(theta), (1 - 1e-6, 1.0), strict=True)]
        moved = any(len(choices) > 1 for choices in (plants, *noises))
        return [np.concatenate((plants[k], *(of[k][1:] for of in noises))) for k in ((0, -1) if moved else (0,))]

    def squares(self, theta: np.ndarray) -> float:
        """Compute |e|^2."""
        total = sum(float(np.vdot(e, e)) for _, e, _ in self._runs(theta))
        return total if np.isfinite(total) else np.inf

    def cost(self, theta: np.ndarray) -> Cost:
        """Compute |e|^2, half its gradient and J' J."""
        return sum_up(self.linearised(theta))

    def linearised(self, theta: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield e [B, T-nd] and de/dtheta [p, B, T-nd] of each batch.

        The Jacobian is D/C times that of the plant, -q^-k e / C and q^-k v / C (Ljung 1999, section 10.3).
        """
        c, _ = self.noise(theta)
        for run, e, basis in self._runs(theta):
            parts = [self._whitened(self.plant.slopes(theta[: self.plant.n_params], run), theta)]
            past_e = [-delayed(e, k) for k in range(1, self.nc + 1)]
            past_v = [delayed(run.e, k)[:, self.nd :] for k in range(1, self.nd + 1)]
            if past_e or past_v:
                parts.append(divide(np.stack([*past_e, *past_v]), c))
            jacobian = np.concatenate(parts)
            yield e, jacobian - (jacobian @ basis) @ basis.T

    def _runs(self, theta: np.ndarray) -> Iterator[tuple[Run, np.ndarray, np.ndarray]]:
        """Simulate the plant of each batch from the start state that leaves the smallest e; basis of what it adds."""
        plant = theta[: self.plant.n_params]
        for run in self.plant.runs(plant):
            residual = run.e + run.start
            of_state = self._whitened(run.free.T, theta).T  # [T-nd, N]
            inverse = np.linalg.pinv(of_state, rcond=1e-10)
            start = self._whitened(residual, theta) @ inverse.T @ run.free.T
            moved = Run(run.filtered, run.responses, run.free, run.inverse, start, residual - start)
            yield moved, self._whitened(moved.e, theta), np.linalg.qr(of_state)[0]

    def _whitened(self, signals: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """Filter by D/C, from the first sample on that has nd before it."""
        c, d = self.noise(theta)
        return divide(multiply(d, signals)[..., self.nd :], c)
