"""The linear model x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t), and how its start state is found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from simgap.subspace.kernels import run

if TYPE_CHECKING:
    import control


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x(t+1) = A x(t) + B (u(t) - u_mean), y(t) = C x(t) + D (u(t) - u_mean) + y_mean.

    noise: variances of the simulation error of each output; root: a factor L of the states' covariance L L'. They tell
    how far a few measured samples are to be trusted with the start state.
    """

    a: Float[np.ndarray, "n n"]
    b: Float[np.ndarray, "n nu"]
    c: Float[np.ndarray, "ny n"]
    d: Float[np.ndarray, "ny nu"]
    u_mean: Float[np.ndarray, " nu"]
    y_mean: Float[np.ndarray, " ny"]
    noise: Float[np.ndarray, " ny"]
    root: Float[np.ndarray, "n n"]
    dt: float

    @property
    def order(self) -> int:
        """How many states there are."""
        return len(self.a)

    @property
    def poles(self) -> np.ndarray:
        """The eigenvalues of A."""
        return np.linalg.eigvals(self.a)

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free from the state that the first n samples show."""
        n = y_init.shape[1]
        _, gain = self.free_response(n)
        runs = []
        for one, start in zip(u - self.u_mean, y_init - self.y_mean, strict=True):
            runs.append(self.run(one, self.start_state(one[:n], start, gain))[0][n:])
        return np.array(runs).reshape(len(u), u.shape[1] - n, -1) + self.y_mean

    def run(self, u: Float[np.ndarray, "T nu"], x0: Float[np.ndarray, " n"]) -> tuple[np.ndarray, np.ndarray]:
        """Simulate deviations: y [T, ny] and x [T, n] from the state x0."""
        return run(self.a, self.b, self.c, self.d, np.ascontiguousarray(u), x0)

    def start_state(
        self, u: Float[np.ndarray, "n nu"], y: Float[np.ndarray, "n ny"], gain: Float[np.ndarray, "N M"]
    ) -> Float[np.ndarray, " N"]:
        """Find the most likely state before deviations u and y."""
        return gain @ (y - self.run(u, np.zeros(self.order))[0]).ravel()

    def free_response(self, n: int) -> tuple[Float[np.ndarray, "M N"], Float[np.ndarray, "N M"]]:
        """Compute what a state adds to the next n outputs, and the gain from those back to it.

        That is the mean of the state, normal with covariance L L', given outputs with white noise.
        """
        ny, nothing = len(self.c), np.zeros((n, self.b.shape[1]))
        free = np.stack([self.run(nothing, unit)[0].ravel() for unit in np.eye(self.order)], axis=1)
        weight = 1 / np.sqrt(np.maximum(np.tile(self.noise, n), 1e-300))
        rows = np.concatenate((free @ self.root * weight[:, None], np.eye(self.order)))
        return free, self.root @ np.linalg.pinv(rows)[:, : n * ny] * weight

    def to_control(self) -> control.StateSpace:
        """Convert to python-control, for deviations from the operating point."""
        import control

        return control.StateSpace(self.a, self.b, self.c, self.d, self.dt)


def blocks(order: int) -> Bool[np.ndarray, "n n"]:
    """Tell where the 2 x 2 blocks on the diagonal of A are, the last one of an odd order being a single element."""
    block = np.arange(order) // 2
    return block[:, None] == block


def in_blocks(
    a: Float[np.ndarray, "n n"], c: Float[np.ndarray, "ny n"]
) -> tuple[Float[np.ndarray, "n n"], Float[np.ndarray, "ny n"]]:
    """Change the coordinates of the states so that A is 0 outside of `blocks`; each block has two of its poles."""
    values, vectors = np.linalg.eig(a)
    rate, turn = np.real(values), np.imag(values)
    real = np.real(vectors[:, turn == 0])[:, np.argsort(rate[turn == 0])]
    pairs = [np.stack((np.real(v), np.imag(v)), axis=1) for v in vectors[:, turn > 0].T]
    pairs += [real[:, k : k + 2] for k in range(0, real.shape[1], 2)]
    basis = np.concatenate([np.linalg.qr(pair)[0] for pair in pairs], axis=1)
    moved = np.linalg.lstsq(basis, a @ basis, rcond=None)[0]  # poles that coincide share a direction
    return np.where(blocks(len(a)), moved, 0.0), c @ basis
