"""The simulation error of a block model, its sum of squares and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import stack
from simgap.baselines.estimation.blocks import Blocks, Run
from simgap.baselines.estimation.curve_kernels import basis
from simgap.baselines.estimation.filters import delayed, divide
from simgap.baselines.estimation.levenberg import Cost, stable, sum_up
from simgap.records import Experiment

FIELDS = ("f1", "b1", "c", "f2", "b2")


@dataclass(frozen=True, eq=False)
class BlockError:
    """e = y_hat - y after the first n_init samples of each experiment, as a function of the numbers in `free` fields.

    theta holds f1, b1, c, f2, b2 of the model, as far as they are free. Gains that cancel between the blocks are left
    to the damping of the search, which takes the shortest step (McKelvey, Helmersson and Ribarits, Automatica 2004).
    """

    model: Blocks
    u: list[Float[np.ndarray, "_ _ nu"]]
    y: list[Float[np.ndarray, "_ _"]]
    n_init: int
    free: tuple[str, ...]

    @classmethod
    def of(cls, model: Blocks, experiments: Sequence[Experiment], output: int, n_init: int, free: tuple[str, ...]):
        batches = [
            (u - model.u_mean, y[:, :, output] - model.y_mean) for u, y in stack(experiments) if u.shape[1] > n_init
        ]
        return cls(model, [u for u, _ in batches], [y for _, y in batches], n_init, free)

    @property
    def samples(self) -> int:
        """How many errors count."""
        return sum(y.shape[0] * (y.shape[1] - self.n_init) for y in self.y)

    @property
    def theta(self) -> Float[np.ndarray, " p"]:
        """Where the search starts."""
        return np.concatenate([_free_part(name, getattr(self.model, name)).ravel() for name in self.free])

    def at(self, theta: Float[np.ndarray, " p"]) -> Blocks:
        """Give the model of theta."""
        changed, place = {}, 0
        for name in self.free:
            old = getattr(self.model, name)
            part = _free_part(name, old)
            new = theta[place : place + part.size].reshape(part.shape)
            changed[name] = np.concatenate(([1.0], new)) if name in ("f1", "f2") else new
            place += part.size
        return replace(self.model, **changed)

    def allowed(self, theta: Float[np.ndarray, " p"]) -> list[Float[np.ndarray, " p"]]:
        """Give points with the poles of both filters inside the unit circle."""
        model = self.at(theta)
        repaired = [{name: f for name, f in zip(("f1", "f2"), pair, strict=True) if name in self.free}
                    for pair in zip(_two(model.f1), _two(model.f2), strict=True)]  # fmt: skip
        points = [replace(self, model=replace(model, **changed)).theta for changed in repaired]
        return points if (points[0] != points[1]).any() else points[:1]

    def squares(self, theta: Float[np.ndarray, " p"]) -> float:
        """Compute |e|^2."""
        model = self.at(theta)
        with np.errstate(over="ignore", invalid="ignore"):
            total = sum(float(np.vdot(e, e)) for _, _, e in self._runs(model))
        return total if np.isfinite(total) else np.inf

    def cost(self, theta: Float[np.ndarray, " p"]) -> Cost:
        """Compute |e|^2, half its gradient and J' J."""
        return sum_up(self.linearised(theta))

    def linearised(self, theta: Float[np.ndarray, " p"]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield e [B, T-n] and de/dtheta [p, B, T-n] of each batch.

        The start state moves along: dz/dtheta = -(Z' Z + P)^-1 Z' J over the first n samples, Z = dy/dz, P the prior.
        """
        model, n = self.at(theta), self.n_init
        for u, run, e in self._runs(model):
            jacobian = self._jacobian(u, run)
            if len(model.prior_weight):
                z = run.state_jacobian()  # [B, N, T]
                inner = z[:, :, :n] @ np.swapaxes(z[:, :, :n], 1, 2) + np.diag(model.prior_weight)
                at_start = np.einsum("bkt,pbt->bkp", z[:, :, :n], jacobian[:, :, :n])
                move = np.linalg.solve(inner, at_start)  # [B, N, p]
                for b in range(len(e)):
                    jacobian[:, b] -= move[b].T @ z[b]
            yield e, jacobian[:, :, n:]

    def _runs(self, model: Blocks) -> Iterator[tuple[np.ndarray, Run, np.ndarray]]:
        for u, y in zip(self.u, self.y, strict=True):
            run = Run.of(model, u, model.start_state(u[:, : self.n_init], y[:, : self.n_init]))
            yield u, run, (run.y - y)[:, self.n_init :]

    def _jacobian(self, u: Float[np.ndarray, "B T nu"], run: Run) -> Float[np.ndarray, "p B T"]:
        """Compute dy/dtheta at a fixed state."""
        model, (m, batch, length) = run.model, run.x.shape
        parts: dict[str, list[np.ndarray]] = {name: [] for name in FIELDS}
        if "b1" in self.free:
            forced = np.moveaxis(divide(u, model.f1, axis=1), 2, 0)  # u / f1, [nu, B, T]
            for i in range(m):
                for j in range(len(forced)):
                    parts["b1"] += [
                        model.through(i, run.slope[i] * delayed(forced[j], k)) for k in range(model.b1.shape[2])
                    ]
        if "f1" in self.free and len(model.f1) > 1:
            twice = divide(run.x, model.f1)
            for k in range(1, len(model.f1)):
                parts["f1"].append(
                    -np.sum([model.through(i, run.slope[i] * delayed(twice[i], k)) for i in range(m)], axis=0)
                )
        if "c" in self.free:
            for i in range(m):
                columns = basis(run.x[i].ravel(), model.low[i], model.step[i], model.c.shape[1])
                parts["c"] += list(model.through(i, columns.reshape(-1, batch, length)))
        if "b2" in self.free:
            filtered = divide(run.w, model.f2)
            parts["b2"] = [delayed(filtered[i], k) for i in range(m) for k in range(model.b2.shape[1])]
        if "f2" in self.free and len(model.f2) > 1:
            twice = divide(run.y, model.f2)
            parts["f2"] = [-delayed(twice, k) for k in range(1, len(model.f2))]
        return np.stack([column for name in self.free for column in parts[name]])


def _free_part(name: str, value: np.ndarray) -> np.ndarray:
    return value[1:] if name in ("f1", "f2") else value


def _two(f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    choices = stable(f, radius=1.0)
    return choices[0], choices[-1]
