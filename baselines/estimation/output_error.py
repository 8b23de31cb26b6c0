"""The simulation error of y = B(q)/F(q) u + e, its sum of squares and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import stack
from simgap.baselines.estimation.filters import divide, multiply
from simgap.baselines.estimation.fitted import Row
from simgap.baselines.estimation.levenberg import Cost, stable, sum_up
from simgap.baselines.estimation.orders import Orders
from simgap.records import UnusableInput


@dataclass(frozen=True, eq=False)
class OutputError:
    """One output, y = sum_j B_j/F_j u_j + constant + R z + e, for each batch of experiments of one length.

    theta holds, for each input with nb > 0, the nf coefficients of F_j, then the nb of B_j; the constant is last.
    R [T, N] are the free responses of 1/(F_1 F_2 ..), all that the plant's past can cause; z is eliminated at every
    point by least squares on the first n_start samples, or on all of them where n_start is None.
    """

    u: list[Float[np.ndarray, "_ _ nu"]]
    y: list[Float[np.ndarray, "_ _"]]
    nf: tuple[int, ...]
    nb: tuple[int, ...]
    nk: tuple[int, ...]
    constant: bool
    n_start: int | None

    @classmethod
    def of(cls, experiments, shift: np.ndarray, orders: Orders, output: int, constant: bool, n_start: int | None):
        ny = len(orders.nb)
        nf, nb, nk = (tuple(int(n) for n in of[output]) for of in (orders.nf, orders.nb, orders.nk))
        empty = cls([], [], nf, nb, nk, constant, None)
        if not empty.used:
            raise UnusableInput(f"no input acts on output {output + 1}; give it nb of at least 1")
        if n_start is not None:  # fewer samples than the state would leave it undetermined
            n_start = max(n_start, empty.state + 1)
        batches = [
            (u - shift[ny:], y[:, :, output] - shift[output])
            for u, y in stack(experiments)
            if u.shape[1] > (n_start or empty.state)
        ]
        return replace(empty, u=[u for u, _ in batches], y=[y for _, y in batches], n_start=n_start)

    @property
    def samples(self) -> int:
        """How many errors count."""
        return sum(y.shape[0] * (y.shape[1] - (self.n_start or self.state)) for y in self.y)

    @property
    def used(self) -> list[int]:
        """The inputs that act on this output."""
        return [j for j, nb in enumerate(self.nb) if nb]

    @property
    def n_params(self) -> int:
        """How many numbers theta holds."""
        return sum(self.nf[j] + self.nb[j] for j in self.used) + self.constant

    @property
    def names(self) -> list[str]:
        """f1, .., b1, .. of each input, with its number where there are several."""
        names = []
        for j in self.used:
            channel = f"_{j + 1}" if len(self.nb) > 1 else ""
            names += [f"f{k}{channel}" for k in range(1, self.nf[j] + 1)]
            names += [f"b{self.nk[j] + k}{channel}" for k in range(self.nb[j])]
        return names

    def theta_of(self, row: Row) -> np.ndarray:
        """Give theta of an estimated equation, with no constant."""
        return np.concatenate((row.values, np.zeros(int(self.constant))))

    @property
    def state(self) -> int:
        """Past samples that act on the future: of the outputs through F, of the inputs through B."""
        poles = sum(self.nf[j] for j in self.used)
        return max(max(poles, poles - self.nf[j] + self.nb[j] + self.nk[j] - 1) for j in self.used)

    def split(self, theta: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray, slice]]:
        """Yield (input, B with its delay, monic F, where the pair stands in theta)."""
        at = 0
        for j in self.used:
            middle, end = at + self.nf[j], at + self.nf[j] + self.nb[j]
            f = np.concatenate(([1.0], theta[at:middle]))
            yield j, np.concatenate((np.zeros(self.nk[j]), theta[middle:end])), f, slice(at, end)
            at = end

    def transfer(self, theta: np.ndarray) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Give the common denominator F_1 F_2 .. and, of each input, B_j times the F of the others."""
        parts = list(self.split(theta))
        common, numerators = np.ones(1), {}
        for j, b, f, _ in parts:
            common = np.convolve(common, f)
            numerators[j] = b
            for other, _, f_other, _ in parts:
                if other != j:
                    numerators[j] = np.convolve(numerators[j], f_other)
        return common, numerators

    def allowed(self, theta: np.ndarray) -> list[np.ndarray]:
        """Give points whose poles are stable or integrate, so that a simulation cannot run away."""
        candidates = [theta.copy(), theta.copy()]
        for j, _, f, part in self.split(theta):
            repaired = stable(f, radius=1.0)
            for candidate, choice in zip(candidates, (repaired[0], repaired[-1]), strict=True):
                candidate[part.start : part.start + self.nf[j]] = choice[1:]
        return candidates if (candidates[0] != candidates[1]).any() else candidates[:1]

    def squares(self, theta: np.ndarray) -> float:
        """Compute |e|^2."""
        return sum(float(np.vdot(run.counted, run.counted)) for run in self.runs(theta))

    def cost(self, theta: np.ndarray) -> Cost:
        """Compute |e|^2, half its gradient and J' J."""
        return sum_up(self.linearised(theta))

    def linearised(self, theta: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield e [B, T-n] and de/dtheta [p, B, T-n] of each batch (n = 0 without n_start).

        de/db_k = -q^-k u/F and de/df_k = q^-k (B/F) u/F (Ljung 1999, eq. 10.50). The start is eliminated by variable
        projection: e = P r with P = 1 - R pinv(R_n) over the first n samples (Golub and Pereyra 1973).
        """
        for run in self.runs(theta):
            n, jacobian = run.inverse.shape[1], self.slopes(theta, run)
            jacobian -= jacobian[:, :, :n] @ run.inverse.T @ run.free.T
            if n < run.e.shape[1]:
                self._add_change_of_fit(jacobian, theta, run)
                jacobian = jacobian[:, :, n:]
            yield run.counted, jacobian

    def runs(self, theta: np.ndarray) -> Iterator[Run]:
        """Simulate each batch from the start state that fits it best."""
        for u, y in zip(self.u, self.y, strict=True):
            filtered = {j: divide(u[:, :, j], f) for j, _, f, _ in self.split(theta)}
            responses = {j: multiply(b, filtered[j]) for j, b, _, _ in self.split(theta)}
            residual = y - np.sum(list(responses.values()), axis=0) - (theta[-1] if self.constant else 0.0)
            free, inverse = self._free_responses(theta, y.shape[1])
            start = residual[:, : inverse.shape[1]] @ inverse.T @ free.T
            yield Run(filtered, responses, free, inverse, start, residual - start)

    def _free_responses(self, theta: np.ndarray, length: int) -> tuple[np.ndarray, np.ndarray]:
        """Compute R [T, N] and the pseudo-inverse [N, n] of its first n_start rows."""
        common, _ = self.transfer(theta)
        free = divide(np.eye(self.state, length), common).T
        return free, np.linalg.pinv(free[: self.n_start], rcond=1e-10)

    def slopes(self, theta: np.ndarray, run: Run) -> np.ndarray:
        """Compute de/dtheta [p, B, T] at a fixed z, whose response rings through every F as the others do."""
        jacobian = np.zeros((self.n_params, *run.e.shape))
        length = run.e.shape[1]
        for j, _, f, part in self.split(theta):
            twice = divide(run.responses[j] + run.start, f)
            for k in range(1, self.nf[j] + 1):
                jacobian[part.start + k - 1, :, k:] = twice[:, : length - k]
            for k in range(self.nb[j]):
                lag = self.nk[j] + k
                jacobian[part.start + self.nf[j] + k, :, lag:] = -run.filtered[j][:, : length - lag]
        if self.constant:
            jacobian[-1] = -1.0
        return jacobian

    def _add_change_of_fit(self, jacobian: np.ndarray, theta: np.ndarray, run: Run) -> None:
        """Add the part of dz/df that the misfit of the first n samples causes: -R (R_n' R_n)^-1 dR_n' misfit."""
        n = run.inverse.shape[1]
        misfit = run.e[:, :n]
        spread = run.free @ (run.inverse @ run.inverse.T)  # [T, N]
        for j, _, f, part in self.split(theta):
            change = divide(run.free[:n], f, axis=0)
            for k in range(1, self.nf[j] + 1):
                jacobian[part.start + k - 1] += misfit[:, k:] @ change[: n - k] @ spread.T


@dataclass(frozen=True, eq=False)
class Run:
    """The simulation of one batch, and what its Jacobian needs of it."""

    filtered: dict[int, Float[np.ndarray, "B T"]]  # u/F of each input
    responses: dict[int, Float[np.ndarray, "B T"]]  # B/F u
    free: Float[np.ndarray, "T N"]  # R
    inverse: Float[np.ndarray, "N n"]  # the pseudo-inverse of the first rows of R
    start: Float[np.ndarray, "B T"]  # what the plant's past adds to the output
    e: Float[np.ndarray, "B T"]

    @property
    def counted(self) -> Float[np.ndarray, "B _"]:
        """e without the samples that the start was found from, unless those are all."""
        n = self.inverse.shape[1]
        return self.e[:, n:] if n < self.e.shape[1] else self.e
