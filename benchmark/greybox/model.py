"""A fitted grey box of one plant: its start from measured samples, its simulation, its intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import t as student

from simgap.greybox.fitting import Estimate, Problem, Records, _Normal
from simgap.greybox.noise import Noise
from simgap.greybox.outliers import Outliers, flag, left_out
from simgap.greybox.plant import LOCAL_POWERS, Structure
from simgap.greybox.selection import Search
from simgap.greybox.simulation import Simulator
from simgap.greybox.starting import starts
from simgap.records import Channels, Experiment

BLOCKS = 40


def groups(channels: Channels) -> list[tuple[int, ...]]:
    """Which outputs belong to one plant: a position with its velocity, where there is one of each; else each alone."""
    kinds = [channel.kind for channel in channels.outputs]
    if kinds.count("position") == 1 and kinds.count("velocity") == 1:
        pair = (kinds.index("position"), kinds.index("velocity"))
        return [pair] + [(i,) for i in range(len(kinds)) if i not in pair]
    return [(i,) for i in range(len(kinds))]


@dataclass(frozen=True, eq=False)
class Machine:
    """One plant with its effects, fitted; `noise` weighs its outputs against each other."""

    estimate: Estimate
    noise: Noise
    outputs: tuple[int, ...]
    records: Records
    experiments: tuple[Experiment, ...]
    outliers: tuple[Outliers, ...] = ()

    @classmethod
    def fit(cls, start: Estimate, search: Search, experiments: Sequence[Experiment]) -> Machine:
        """Fit a model that a search found on excerpts to all of the experiments."""
        records, noise, outputs = Records.of(experiments, search.outputs), search.base_noise, search.outputs
        fixed = np.ones(len(start.theta), dtype=bool)
        first = Problem(start.structure, records, noise).fit(start.theta, fixed=fixed)
        if search.outliers:
            records = left_out(records, first.errors, search.outliers)
        problem = Problem(start.structure, records, noise)
        return cls(
            problem.fit(start.theta, first.local), noise, outputs, records, tuple(experiments), tuple(search.outliers)
        )

    @property
    def forecasting(self) -> Structure:
        """The structure without what belongs to single experiments and cannot be forecast."""
        structure = self.estimate.structure
        return structure.having([term for term in structure.terms if term not in structure.local])

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Rows n .. T-1, from the start that suits the n measured samples best."""
        structure, theta, n = self.forecasting, self.estimate.theta, y_init.shape[1]
        start = starts(structure, theta, u[:, :n], y_init, self.noise)
        return Simulator(structure, u).run(theta, start)[:, n:]

    def shares(self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]) -> Float[np.ndarray, "B T e"]:
        """What each effect does to the first output: the simulation less the one without it, from the same start."""
        structure, theta, n = self.forecasting, self.estimate.theta, y_init.shape[1]
        if not structure.terms:
            return np.zeros((*u.shape[:2], 0))
        start = starts(structure, theta, u[:, :n], y_init, self.noise)
        whole = Simulator(structure, u).run(theta, start)
        shares = []
        for term in structure.terms:
            rest = structure.having([other for other in structure.terms if other != term])
            of_rest = np.zeros(rest.size)
            of_rest[: rest.n_plant] = theta[: rest.n_plant]
            for other in rest.terms:
                of_rest[rest.term_at(other)] = theta[structure.term_at(other)]
            shares.append(whole[:, :, 0] - Simulator(rest, u).run(of_rest, start)[:, :, 0])
        return np.stack(shares, axis=2)

    def again(self, experiment: Experiment, n_init: int) -> Float[np.ndarray, "N ny"]:
        """Rows n_init .. T-1 of a free run in which what belongs to this experiment is estimated from all of it."""
        structure, outputs = self.estimate.structure, list(self.outputs)
        y_hat = self.simulate(experiment.u[None], experiment.y[None, :n_init][:, :, outputs])[0]
        error = experiment.y[n_init:, outputs] - y_hat
        t = experiment.dt * np.arange(n_init, len(experiment))
        for j in range(len(outputs)):
            powers = sorted(LOCAL_POWERS[term.effect.name] for term in structure.local if term.channel == j)
            if powers:
                columns = np.stack([t**power for power in powers], axis=1)  # [N, powers]
                y_hat[:, j] += columns @ np.linalg.lstsq(columns, error[:, j], rcond=None)[0]
        if self.outliers:
            error = experiment.y[n_init:, outputs] - y_hat
            flags = flag(error[None], np.ones((1, len(error)), dtype=bool))[0]
            for j in (found.output for found in self.outliers):
                y_hat[flags[:, j], j] += error[flags[:, j], j]
        return y_hat

    def log_likelihood(self) -> float:
        """Of the errors as white noise, up to a constant."""
        e = self.estimate.errors[self.records.mask]
        return float(-0.5 * len(e) * np.sum(np.log(np.mean(e * e, axis=0) + 1e-300)))

    def intervals(self) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
        """95 % intervals of theta, honest for coloured errors and for what the model cannot explain.

        cov = H^-1 (sum over blocks of g g') H^-1, g = J' e of a block (Liang and Zeger 1986); Student's t.
        """
        structure, theta = self.estimate.structure, self.estimate.theta
        problem = Problem(structure, self.records, self.noise)
        slopes = problem.slopes(theta, self.estimate.local, structure.free)
        white = self.noise.whiten(self.estimate.errors).reshape(len(self.estimate.local), -1)  # [E, M]
        normal = _Normal.of(slopes, white)
        h, weights, _ = normal._reduced(0.0)
        # The slopes of theta when the local numbers follow: J - K (K'K)^-1 K'J.
        own = slopes.theta - np.einsum("eqp,qem->pem", weights, slopes.local)
        per_record = max(1, -(-BLOCKS // len(white)))
        parts = np.array_split(own * white, per_record, axis=2)
        g = np.concatenate([part.sum(axis=2).T for part in parts])  # [blocks, p]
        inside = structure.free & (np.diag(normal.h) > 0)
        inverse = np.linalg.pinv(h[np.ix_(inside, inside)], rcond=1e-12, hermitian=True)
        used = len(g) / max(1, len(g) - 1)
        covariance = inverse @ (g.T @ g)[np.ix_(inside, inside)] @ inverse * used
        reach = np.full(len(theta), 0.0)
        reach[inside] = student.ppf(0.975, max(2, len(g) - 1)) * np.sqrt(np.maximum(np.diag(covariance), 0))
        return np.maximum(theta - reach, structure.low), np.minimum(theta + reach, structure.high)
