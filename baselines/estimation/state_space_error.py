"""The simulation error of a state-space model, its sum of squares and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.levenberg import Cost, sum_up
from simgap.baselines.estimation.state_space import StateSpace
from simgap.baselines.estimation.state_space_kernels import pushed
from simgap.baselines.estimation.subspace import stable_matrix
from simgap.records import Experiment


@dataclass(frozen=True, eq=False)
class StateSpaceError:
    """e = (y_hat - y) / size after the first n_init samples of each experiment, as a function of A, B, C, D, y_mean.

    theta holds all their elements; those that a change of the states' coordinates cancels are left to the damping of
    the search, which takes the shortest step (McKelvey, Helmersson and Ribarits, Automatica 40, 2004).
    """

    model: StateSpace
    records: list[tuple[Float[np.ndarray, "_ nu"], Float[np.ndarray, "_ ny"]]]
    n_init: int
    size: Float[np.ndarray, " ny"]

    @classmethod
    def of(cls, model: StateSpace, experiments: Sequence[Experiment], n_init: int, size: Float[np.ndarray, " ny"]):
        return cls(model, [(e.u - model.u_mean, e.y) for e in experiments if len(e) > n_init], n_init, size)

    @property
    def samples(self) -> int:
        """How many errors count."""
        return sum(y[self.n_init :].size for _, y in self.records)

    @property
    def theta(self) -> Float[np.ndarray, " p"]:
        """Where the search starts."""
        model = self.model
        return np.concatenate([part.ravel() for part in (model.a, model.b, model.c, model.d, model.y_mean)])

    def at(self, theta: Float[np.ndarray, " p"]) -> StateSpace:
        """Give the model of theta."""
        changed, place = {}, 0
        for name in ("a", "b", "c", "d", "y_mean"):
            old = getattr(self.model, name)
            changed[name] = np.ascontiguousarray(theta[place : place + old.size].reshape(old.shape))
            place += old.size
        return replace(self.model, **changed)

    def allowed(self, theta: Float[np.ndarray, " p"]) -> list[Float[np.ndarray, " p"]]:
        """Give the point with the poles inside the unit circle or on it."""
        repaired = theta.copy()
        a = self.at(theta).a
        repaired[: a.size] = stable_matrix(a, 1.0).ravel()
        return [repaired]

    def squares(self, theta: Float[np.ndarray, " p"]) -> float:
        """Compute |e|^2."""
        model = self.at(theta)
        total = sum(float(np.sum(e**2)) for e, *_ in self._runs(model, model.free_response(self.n_init)[1]))
        return total if np.isfinite(total) else np.inf

    def cost(self, theta: Float[np.ndarray, " p"]) -> Cost:
        """Compute |e|^2, half its gradient and J' J."""
        return sum_up(self._linearised(theta))

    def _runs(self, model: StateSpace, gain: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        n = self.n_init
        for u, y in self.records:
            y_hat, x = model.run(u, model.start_state(u[:n], y[:n] - model.y_mean, gain))
            yield ((y_hat + model.y_mean - y) / self.size)[n:], x, u

    def _linearised(self, theta: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield e and de/dtheta of each record; the start state moves along, by its gain times the slope there."""
        model, n, ny = self.at(theta), self.n_init, len(self.size)
        _, gain = model.free_response(n)
        length = max((len(y) for _, y in self.records), default=0)
        free = model.free_response(length)[0].reshape(length, ny, model.order)
        for e, x, u in self._runs(model, gain):
            signals = np.concatenate((x, u), axis=1)
            responses = pushed(model.a, model.c, signals)  # [N, N + nu, T, ny]
            order, count = model.order, signals.shape[1]
            direct = np.zeros((ny, count, *responses.shape[2:]))
            for o in range(ny):
                direct[o, :, :, o] = signals.T
            parts = (
                responses[:, :order], responses[:, order:], direct[:, :order], direct[:, order:],
                np.broadcast_to(np.eye(ny)[:, None], (ny, len(u), ny)),
            )  # fmt: skip
            slopes = np.concatenate([part.reshape(-1, len(u), ny) for part in parts])
            moved = slopes[:, :n].reshape(len(slopes), -1) @ gain.T  # [p, N]
            slopes -= np.tensordot(moved, free[: len(u)], axes=(1, 2))
            yield e, (slopes / self.size)[:, n:]
