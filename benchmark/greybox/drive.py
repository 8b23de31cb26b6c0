"""What drives a plant in every substep: inputs after their effects, gains, loads; no measured output."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from simgap.greybox.effects.effect import InputEffect
from simgap.greybox.past import Past
from simgap.greybox.plant import Plant
from simgap.greybox.terms import Term


def shifted(u: Float[np.ndarray, "E K"], steps: int) -> Float[np.ndarray, "E K"]:
    """Shift u to some steps later (or, negative, earlier), standing still outside the record."""
    if steps > 0:
        return np.concatenate((u[:, steps:], np.repeat(u[:, -1:], steps, axis=1)), axis=1)
    return np.concatenate((np.repeat(u[:, :1], -steps, axis=1), u[:, :steps]), axis=1) if steps else u


class Drive:
    """What drives one plant on the inputs of several experiments, u [E, T, nu], after what came before them."""

    def __init__(self, plant: Plant, u: Float[np.ndarray, "E T nu"], past: Past | None = None) -> None:
        self.plant, self.substeps = plant, plant.substeps
        past = past or Past.none(u)
        self.since = past.since
        self.h = plant.dt / plant.substeps
        whole = np.concatenate((past.u, u), axis=1)
        self._first = past.u.shape[1] * plant.substeps  # of the substeps that are simulated
        # [nu, E, P + K]: each sample until the next one
        self._whole = np.ascontiguousarray(np.repeat(np.moveaxis(whole, 2, 0), plant.substeps, axis=2))
        self._rate: np.ndarray | None = None  # [E, K], of an imposed motion, where it is the input
        if plant.by_rate:
            v = self._whole[0]
            self._rate = v[:, self._first :]
            self._whole = np.zeros_like(self._whole)
            x = self._whole[0]
            x[:, 1:] = np.cumsum(0.5 * (v[:, 1:] + v[:, :-1]) * self.h, axis=1)
            x -= x[:, self._first, None]
        self.u = self._whole[:, :, self._first :]  # [nu, E, K]
        self._arrived: dict[bytes, np.ndarray] = {}
        self._middles = self.h * (np.arange(self.u.shape[2]) + 0.5)  # of the substeps
        self._duration = plant.dt * u.shape[1]
        self.loads = [term for term in plant.per_experiment if term.effect.port == "force"]
        self._shaped: dict[Term, tuple[np.ndarray, np.ndarray]] = {}  # by what numbers, in what shapes
        effects = [term for term in plant.terms if term.effect.port == "input"]
        self.depends_on = np.zeros(plant.size, dtype=bool)  # which of theta
        for part in (plant.layout.gains, plant.layout.offset, *map(plant.part_of, (*effects, *self.loads))):
            self.depends_on[part] = True
        self._inputs: np.ndarray | None = None  # [nu * taps, E * K], where nothing but gains stands before the plant
        if not effects and not self.loads and plant.machine is None:
            taps = [self._shifted(one, tap) for one in self._whole for tap in plant.taps]
            self._inputs = np.array(taps).reshape(len(taps), -1)

    def _shifted(self, u: Float[np.ndarray, "E J"], samples: int) -> Float[np.ndarray, "E K"]:
        return shifted(u, samples * self.substeps)[:, self._first :]

    def of(
        self, theta: Float[np.ndarray, " p"], start: Float[np.ndarray, "E m"] | None = None
    ) -> Float[np.ndarray, "E K"]:
        """Compute b u + d after the actuators' effects, for every substep, and the loads of each experiment.

        `start` is what the terms remember, then the numbers of each such load.
        """
        plant = self.plant
        if plant.machine is not None:
            return self._torque(theta)
        gains, offset = theta[plant.layout.gains], theta[plant.layout.offset]
        total = np.full(self.u.shape[1:], offset[0] if len(offset) else 0.0)
        for channel, of_channel in enumerate(gains.reshape(plant.nu, -1)):
            arriving = self._passed(theta, channel, start)
            for tap, gain in zip(plant.taps, of_channel, strict=True):
                total += gain * self._shifted(arriving, tap)
        if start is None:
            return total
        for term in self.loads:
            part = plant.own_part_of(term)
            total += start[:, part.start - plant.order : part.stop - plant.order] @ self._shapes(term, theta)
        return total

    def _shapes(self, term: Term, theta: Float[np.ndarray, " p"]) -> Float[np.ndarray, "own K"]:
        common = theta[self.plant.part_of(term)]
        if term not in self._shaped or not np.array_equal(self._shaped[term][0], common):
            self._shaped[term] = common, term.effect.shapes(self._middles, self._duration, common)
        return self._shaped[term][1]

    def of_each(
        self, thetas: Float[np.ndarray, "S p"], starts: Float[np.ndarray, "S E m"]
    ) -> Float[np.ndarray, "S E K"]:
        """Compute the same for several parameter vectors."""
        if self._inputs is None:
            return np.stack([self.of(*of_run) for of_run in zip(thetas, starts, strict=True)])
        drives = thetas[:, self.plant.layout.gains] @ self._inputs
        if self.plant.offset:
            drives += thetas[:, self.plant.layout.offset]
        return drives.reshape(-1, *self.u.shape[1:])

    def arriving(
        self, theta: Float[np.ndarray, " p"], channel: int, start: Float[np.ndarray, "E m"] | None = None
    ) -> Float[np.ndarray, "E K"]:
        """Pass one input through its effects."""
        return self._passed(theta, channel, start)[:, self._first :]

    def _passed(
        self, theta: Float[np.ndarray, " p"], channel: int, start: Float[np.ndarray, "E m"] | None = None
    ) -> Float[np.ndarray, "E J"]:
        """Do so from the inputs before the record on; it is kept, because most parameters do not change it."""
        terms = self.plant.on("input", channel)
        if not terms:
            return self._whole[channel]
        values = [theta[self.plant.part_of(term)] for term in terms]
        remembered = () if start is None else zip(self.plant.remembered, start.T, strict=False)
        begun = {term.key: of_term for term, of_term in remembered if term in terms}
        key = np.concatenate([[channel], *values, *begun.values()]).tobytes()
        if key not in self._arrived:
            u, first = self._whole[channel], self._first
            for term, p in zip(terms, values, strict=True):
                assert isinstance(term.effect, InputEffect)
                if term.key in begun:  # like the plant's states, found in the first samples, whatever came before
                    u = np.concatenate(
                        (u[:, :first], term.effect.term_from(u[:, first:], p, self.h, begun[term.key])), axis=1
                    )
                elif term.effect.of_time:
                    u = term.effect.term_since(u, p, self.h, self.since - first * self.h)
                else:
                    u = term.effect.term(u, p, self.h)
            if len(self._arrived) > 1 + len(values):
                self._arrived.pop(next(iter(self._arrived)))
            self._arrived[key] = u
        return self._arrived[key]

    def motion(
        self, theta: Float[np.ndarray, " p"], start: Float[np.ndarray, "E m"]
    ) -> tuple[Float[np.ndarray, "E K"], Float[np.ndarray, "E K"]]:
        """Compute position and velocity of an imposed motion; between two samples of a position it is even."""
        x = np.ascontiguousarray(self.arriving(theta, 0, start))
        if self._rate is not None:
            return x, self._rate
        v = np.diff(x, axis=1, prepend=x[:, :1]) / self.h
        v[:, 0] = v[:, min(1, v.shape[1] - 1)]
        return x, v

    def of_machine(self) -> tuple[np.ndarray, ...]:
        """Take gain, supply and enabled [E, K] from the columns of a machine."""
        machine = self.plant.machine
        assert machine is not None
        known, u = machine.known, np.moveaxis(self.u, 0, 2)
        on = u[:, :, machine.names.index(known.enabled)] if known.enabled else np.ones(u.shape[:2])
        return machine.column(u, known.gain, 1.0), machine.column(u, known.supply, 1.0), on

    def _torque(self, theta: Float[np.ndarray, " p"]) -> Float[np.ndarray, "E K"]:
        """Compute what drives a machine: k V e u, or with a controller what the goal's distance from its mean asks."""
        machine = self.plant.machine
        assert machine is not None
        gain, supply, on = self.of_machine()
        goal = self.u[machine.of_drive]
        command = gain * (goal - goal.mean()) * machine.known.goal_factor if machine.controlled else goal
        return theta[self.plant.layout.gains.start] * supply * on * command
