"""Records as motions for SINDy: smoothed state, derivative, the rows of a regression, and free runs of equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simgap.records import Dataset, Experiment
from simgap.recovery.adapters.sindy_library import StateLibrary, of_input

FAR = 20.0  # sizes of the motion, beyond which a run has diverged
SUBSTEPS = 2  # of Runge and Kutta, per sample


@dataclass(frozen=True, eq=False)
class Motion:
    """One record: the smoothed state x, v [T], the derivative to explain, and the columns of its inputs."""

    x: np.ndarray
    v: np.ndarray
    u: np.ndarray  # [T, nu]
    rate: np.ndarray
    of_input: dict[str, np.ndarray]  # effect -> [T, n]
    dt: float
    measured: np.ndarray
    integrals: int  # how often the derivative was taken of what was measured

    def names(self, library: StateLibrary) -> list[str]:
        """The effects of all columns."""
        inputs = [name for name, columns in self.of_input.items() for _ in range(columns.shape[1])]
        return [*inputs, *(name for name, _ in library.columns(*(np.zeros(1),) * 4))]

    @property
    def driven(self) -> np.ndarray:
        """All columns of the inputs [T, n]."""
        return np.concatenate(list(self.of_input.values()), axis=1)

    def rows(self, library: StateLibrary, window: int, weak: bool) -> tuple[np.ndarray, np.ndarray]:
        """Theta and the derivative; in the weak form, integrals of both with bumps that end at zero."""
        state = [
            column for _, column in library.columns(self.x, self.v, self.u[:, 0], self.dt * np.arange(len(self.x)))
        ]
        held = self.driven  # from one sample to the next, so that it is half a sample late
        phi = np.column_stack(((held + np.concatenate((held[:1], held[:-1]))) / 2, *state))
        if not weak:
            return phi[window:-window], self.rate[window:-window]
        bump = (1 - np.linspace(-1, 1, 2 * window + 1) ** 2) ** 4
        slope = bump
        for _ in range(self.integrals):
            slope = np.gradient(slope, self.dt)  # by parts: its sign is that of the mirror image in the convolution
        return np.stack([np.convolve(c, bump, "valid") for c in phi.T], axis=1), np.convolve(
            self.measured, slope, "valid"
        )


def motions_of(dataset: Dataset, split: str, windows: Sequence[int], second: bool) -> dict[int, list[Motion]]:
    """The records of a split, smoothed over each window; an equation of second order explains the rate of v."""
    kinds = [channel.kind for channel in dataset.channels.outputs]
    u = np.concatenate([x.u for x in dataset.training.train])
    largest = np.abs(u).max(axis=0)
    step = np.max([np.abs(np.diff(x.u, axis=0)).max(axis=0) for x in dataset.training.train], axis=0)
    motions: dict[int, list[Motion]] = {window: [] for window in windows}
    for x in getattr(dataset.training, split):
        columns: dict[str, list[np.ndarray]] = {}
        for j in range(x.u.shape[1]):
            for name, column in of_input(x.u[:, j], largest[j], step[j]):
                columns.setdefault(name, []).append(column)
        stacked = {name: np.stack(listed, axis=1) for name, listed in columns.items()}
        for window in windows:
            motions[window].append(_motion(x, kinds, window, second, stacked))
    return motions


def _motion(x: Experiment, kinds: Sequence[str], window: int, second: bool, columns: dict[str, np.ndarray]) -> Motion:
    y = x.y[:, 0]
    smooth, slope = _derivative(y, x.dt, window)
    if kinds[0] == "velocity":
        return Motion(np.zeros_like(y), smooth, x.u, slope, columns, x.dt, y, 1)
    if not second:
        return Motion(smooth, np.zeros_like(y), x.u, slope, columns, x.dt, y, 1)
    if "velocity" in kinds:
        slope = _derivative(x.y[:, kinds.index("velocity")], x.dt, window)[0]
    return Motion(smooth, slope, x.u, _derivative(slope, x.dt, window)[1], columns, x.dt, y, 2)


def _derivative(y: np.ndarray, dt: float, window: int) -> tuple[np.ndarray, np.ndarray]:
    """A signal smoothed, and its derivative, by the method that pysindy recommends for noisy records."""
    from pysindy.differentiation import SmoothedFiniteDifference

    method = SmoothedFiniteDifference(smoother_kws={"window_length": window, "polyorder": 3})
    slope = method(y[:, None], dt)  # type: ignore[arg-type]
    return method.smoothed_x_[:, 0], np.asarray(slope)[:, 0]


def free_run_errors(
    library: StateLibrary, motions: list[Motion], xi: np.ndarray, second: bool, first: int
) -> np.ndarray:
    """RMSE of the output of each equation, xi [c, n], over the records from sample `first` on."""
    n = motions[0].driven.shape[1]
    driven = np.stack([m.driven @ xi[:, :n].T for m in motions], axis=2)  # [T, c, records]
    u = np.stack([m.u[:, 0] for m in motions], axis=1)  # [T, records]
    y = np.stack([m.measured for m in motions], axis=1)
    own, dt = xi[:, n:], motions[0].dt
    top = np.array([max(abs(library.low), abs(library.high), library.x_size), library.v_size])[:, None, None] * FAR
    start = np.array([[m.x[first] for m in motions], [m.v[first] for m in motions]])
    z = np.repeat(start[:, None], len(xi), axis=1)  # [2, c, records]
    squares, h = np.zeros(len(xi)), dt / SUBSTEPS

    def rate(z: np.ndarray, k: int, t: float) -> np.ndarray:
        columns = library.columns(z[0], z[1], u[k], np.asarray(t))
        total = driven[k] + sum(own[:, [i]] * column for i, (_, column) in enumerate(columns))
        # Of an equation of first order the other state stays where it is; of a body without a position nobody reads it.
        return np.stack([z[1] if second else total, total if second else 0 * total])

    for k in range(first, len(y)):
        squares += np.mean((z[0 if library.has_x else 1] - y[k]) ** 2, axis=1)
        for i in range(SUBSTEPS):
            t = k * dt + i * h
            k1 = rate(z, k, t)
            k2 = rate(z + h / 2 * k1, k, t + h / 2)
            k3 = rate(z + h / 2 * k2, k, t + h / 2)
            k4 = rate(z + h * k3, k, t + h)
            z = np.clip(z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), -top, top)
    return np.sqrt(squares / (len(y) - first))
