"""From parameters, start states and inputs to simulated outputs; no measured output enters here."""

from __future__ import annotations

import inspect
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float
from numba import cfunc

from simgap.greybox.effects.effect import InputEffect, OutputEffect
from simgap.greybox.kernels import SLOTS, TERM, run_plant_directly, transition
from simgap.greybox.plant import LOCAL_POWERS, Structure

ROLES = {"force": 0, "friction": 1, "outflow": 2, "rim": 3}


@cache
def compiled(term: Any) -> Any:
    """A force term for the inner loop."""
    return cfunc(TERM, cache=True)(inspect.unwrap(term))


def nothing(x, v, t, h, p, i, m, j):
    """Fills the unused slots."""
    return 0.0


def shifted(u: Float[np.ndarray, "E K"], steps: int) -> Float[np.ndarray, "E K"]:
    """u some steps later (or, negative, before), standing still outside the record."""
    if steps > 0:
        return np.concatenate((u[:, steps:], np.repeat(u[:, -1:], steps, axis=1)), axis=1)
    return np.concatenate((np.repeat(u[:, :1], -steps, axis=1), u[:, :steps]), axis=1) if steps else u


class Simulator:
    """One structure on the inputs of several experiments, u [E, T, nu]; shorter ones are padded by the caller."""

    def __init__(self, structure: Structure, u: Float[np.ndarray, "E T nu"]) -> None:
        self.structure = structure
        self.substeps = structure.substeps
        self.h = structure.dt / self.substeps
        self.t = structure.dt * np.arange(u.shape[1])  # [T]
        self.shape = u.shape
        # [nu, E, T * substeps]: each sample until the next one
        arrived = np.repeat(np.moveaxis(u, 2, 0), self.substeps, axis=2)
        self._u = np.ascontiguousarray(arrived)
        self._arrived: dict[bytes, np.ndarray] = {}
        self._known: dict[bytes, np.ndarray] = {}  # states of what was simulated last
        forces = structure.forces()
        if len(forces) > SLOTS:
            raise ValueError(f"a model holds up to {SLOTS} forces, this one has {len(forces)}")
        acting: list[Any] = [term.effect for term in forces]
        unused = SLOTS - len(forces)
        self._terms = tuple(compiled(effect.term) for effect in acting) + (compiled(nothing),) * unused
        self._n_terms = len(forces)
        self._roles = np.array([ROLES[effect.role] for effect in acting] + [0] * unused)
        self._p_at = np.array([structure.term_at(term).start for term in forces] + [0] * unused)
        memory = np.cumsum([0] + [term.effect.memory for term in forces])
        self._m_at = np.array([*memory[:-1], *([0] * unused)])
        self._memory = np.zeros(max(1, int(memory[-1])))

    def states(
        self, thetas: Float[np.ndarray, "S p"], starts: Float[np.ndarray, "S E n"]
    ) -> Float[np.ndarray, "S E T n"]:
        """The states of the plant at the samples, the first being the start, for each of several thetas."""
        structure, (experiments, samples, _) = self.structure, self.shape
        n, s = structure.order, len(thetas)
        e, g0, g1 = np.empty((3, s, n, n))
        rates = np.empty((s, n))
        for i, theta in enumerate(thetas):
            # A parameter of an effect leaves the plant as it is.
            if i and (theta[: structure.n_plant] == thetas[i - 1][: structure.n_plant]).all():
                e[i], g0[i], g1[i], rates[i] = e[i - 1], g0[i - 1], g1[i - 1], rates[i - 1]
                continue
            a = structure.matrix(theta)
            transition(a, self.h, e[i], g0[i], g1[i])
            rates[i] = -np.diag(a)
        states = np.empty((s, experiments, samples, n))
        entry, fast = (0, 0) if structure.cascade else (n - 1, min(1, n - 1))
        run_plant_directly(
            e, g0, g1, rates, entry, fast, np.stack([self.drive(theta) for theta in thetas]),
            np.ascontiguousarray(starts), self.substeps, self.h, self._terms, self._n_terms, self._roles,
            np.ascontiguousarray(thetas), self._p_at, self._m_at, self._memory, states,
        )  # fmt: skip
        return states

    def drive(self, theta: Float[np.ndarray, " p"]) -> Float[np.ndarray, "E K"]:
        """b u + d after the actuators' effects, for every substep."""
        structure = self.structure
        gains, offset = theta[structure.at[1]], theta[structure.at[2]]
        total = np.full(self._u.shape[1:], offset[0] if len(offset) else 0.0)
        for channel, of_channel in enumerate(gains.reshape(structure.nu, -1)):
            arrived = self.arrived(theta, channel)
            for tap, gain in zip(structure.taps, of_channel, strict=True):
                total += gain * shifted(arrived, tap * self.substeps)
        return total

    def arrived(self, theta: Float[np.ndarray, " p"], channel: int) -> Float[np.ndarray, "E K"]:
        """What arrives at the plant of one input; kept, because most parameters do not change it."""
        terms = self.structure.on("input", channel)
        if not terms:
            return self._u[channel]
        values = [theta[self.structure.term_at(term)] for term in terms]
        key = np.concatenate([[channel], *values]).tobytes()
        if key not in self._arrived:
            u = self._u[channel]
            for term, p in zip(terms, values, strict=True):
                assert isinstance(term.effect, InputEffect)
                u = term.effect.term(u, p, self.h)
            if len(self._arrived) > 1 + len(values):
                self._arrived.pop(next(iter(self._arrived)))
            self._arrived[key] = u
        return self._arrived[key]

    def outputs(
        self, theta: Float[np.ndarray, " p"], local: Float[np.ndarray, "E q"], states: Float[np.ndarray, "E T n"]
    ) -> Float[np.ndarray, "E T ny"]:
        """The readings of the sensors."""
        structure = self.structure
        with np.errstate(over="ignore", invalid="ignore"):
            y = states @ structure.reading(theta).T
        for channel in range(structure.ny):
            for term in structure.on("output", channel):
                if term in structure.local:
                    power = LOCAL_POWERS[term.effect.name]
                    value = local[:, structure.order + structure.local.index(term)]
                    y[:, :, channel] += value[:, None] * self.t**power
                else:
                    assert isinstance(term.effect, OutputEffect)
                    y[:, :, channel] = term.effect.term(y[:, :, channel], theta[structure.term_at(term)], self.t)
        return y

    def run(self, theta: Float[np.ndarray, " p"], local: Float[np.ndarray, "E q"]) -> Float[np.ndarray, "E T ny"]:
        """Simulated outputs; local holds the start state and the local parameters of each experiment."""
        return self.run_many(theta[None], local[None])[0]

    def run_many(
        self, thetas: Float[np.ndarray, "S p"], locals_: Float[np.ndarray, "S E q"]
    ) -> Float[np.ndarray, "S E T ny"]:
        """The same for several parameter vectors; those that differ in what only sensors do share their states."""
        starts = locals_[:, :, : self.structure.order]
        keys = [t[self.structure.acting].tobytes() + z.tobytes() for t, z in zip(thetas, starts, strict=True)]
        new = {key: i for i, key in enumerate(keys) if key not in self._known}
        with np.errstate(over="ignore", invalid="ignore"):
            if new:
                rows = list(new.values())
                self._known |= zip(new, self.states(thetas[rows], starts[rows]), strict=True)
            y = [self.outputs(t, q, self._known[key]) for t, q, key in zip(thetas, locals_, keys, strict=True)]
        self._known = {keys[0]: self._known[keys[0]]}  # a search asks for the slopes where it has just been
        return np.stack(y)
