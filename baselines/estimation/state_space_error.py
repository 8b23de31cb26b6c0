"""The simulation error of a state-space model, its sum of squares and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.levenberg import Cost, sum_up
from simgap.records import Experiment
from simgap.subspace.kernels import pushed
from simgap.subspace.projections import stable_matrix
from simgap.subspace.state_space import StateSpace, blocks


@dataclass(frozen=True, eq=False)
class StateSpaceError:
    """e = (y_hat - y) / size after the first n_init samples of each experiment, as a function of A, B, C, D, y_mean.

    theta holds the elements of A's blocks and all of the others. What a change of the states' coordinates cancels is
    left to the damping of the search, which takes the shortest step (McKelvey, Helmersson and Ribarits, Automatica 40,
    2004, for a full A; blocks cost n^2 instead of n^3 in each sample).
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
        a = model.a[blocks(model.order)]
        return np.concatenate([a, *(part.ravel() for part in (model.b, model.c, model.d, model.y_mean))])

    def at(self, theta: Float[np.ndarray, " p"]) -> StateSpace:
        """Give the model of theta."""
        free = blocks(self.model.order)
        place = int(free.sum())
        a = np.zeros(free.shape)
        a[free] = theta[:place]
        changed = {"a": a}
        for name in ("b", "c", "d", "y_mean"):
            old = getattr(self.model, name)
            changed[name] = np.ascontiguousarray(theta[place : place + old.size].reshape(old.shape))
            place += old.size
        return replace(self.model, **changed)

    def allowed(self, theta: Float[np.ndarray, " p"]) -> list[Float[np.ndarray, " p"]]:
        """Give the point with the poles inside the unit circle or on it."""
        a, free = self.at(theta).a, blocks(self.model.order)
        for k in range(0, len(a), 2):
            a[k : k + 2, k : k + 2] = stable_matrix(a[k : k + 2, k : k + 2], 1.0)
        return [np.concatenate((a[free], theta[int(free.sum()) :]))]

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
            responses = pushed(model.a, model.c, x, np.ascontiguousarray(u))  # [N, 2 + nu, T, ny]
            of_a = responses[:, :2].reshape(-1, len(u), ny)[: int(blocks(model.order).sum())]
            of_c, of_d = (np.einsum("ti,op->oitp", signals, np.eye(ny)) for signals in (x, u))
            of_mean = np.broadcast_to(np.eye(ny)[:, None], (ny, len(u), ny))
            slopes = np.concatenate(
                [part.reshape(-1, len(u), ny) for part in (of_a, responses[:, 2:], of_c, of_d, of_mean)]
            )
            moved = slopes[:, :n].reshape(len(slopes), -1) @ gain.T  # [p, N]
            slopes -= np.tensordot(moved, free[: len(u)], axes=(1, 2))
            yield e, (slopes / self.size)[:, n:]
