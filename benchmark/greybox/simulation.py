"""From parameters, start states and inputs to simulated outputs; no measured output enters here."""

from __future__ import annotations

import inspect
from functools import cache
from typing import Any, get_args

import numpy as np
from jaxtyping import Float
from numba import cfunc, types

from simgap.greybox import dynamics
from simgap.greybox.drive import Drive
from simgap.greybox.effects.effect import OutputEffect, Role
from simgap.greybox.kernels import SLOTS, TERM, follow_motion, run_body, run_tanks
from simgap.greybox.linear_kernels import read, run_linear, transitions
from simgap.greybox.machine import BACK_EMF, DAMPING, DERIVATIVE, STIFFNESS
from simgap.greybox.machine_kernels import run_machine
from simgap.greybox.past import Past
from simgap.greybox.plant import Plant
from simgap.greybox.terms import Term
from simgap.greybox.two_masses import ENTRY

ROLES = get_args(Role)  # as the kernels number them
CARRIED = 5  # numbers: see `carried`
FIRST = np.array([0])


class Law(types.WrapperAddressProtocol):
    """A force term compiled for the inner loop; its address is known, and not worked out anew at every call."""

    def __init__(self, term: Any) -> None:
        self._compiled = cfunc(TERM, cache=True)(inspect.unwrap(term))
        assert self._compiled.address is not None, "a compiled function has an address"
        self._address: int = self._compiled.address

    def __wrapper_address__(self) -> int:
        return self._address

    def signature(self) -> Any:
        """Return the types of its arguments and of what it computes."""
        return TERM


compiled = cache(Law)


def nothing(x, v, t, h, p, i, m, j):
    """Fill a slot that is not used."""
    return 0.0


def carried(plant: Plant, a: Float[np.ndarray, "n n"]) -> Float[np.ndarray, " 5"]:
    """Return (c, d): the transmission carries drive + c z - forces, and damping takes d v of it.

    c z is what spring and load pull at the side where the forces act.
    """
    c, fast = np.zeros(CARRIED), min(1, plant.order - 1)
    if plant.order:
        row = -a[ENTRY if plant.joint else -1, : CARRIED - 1]
        c[: len(row)] = row
        c[-1] = row[fast] + (row[-1] if plant.joint else 0.0)
        c[fast] -= c[-1]
    return c


def seen(plant: Plant, thetas: Float[np.ndarray, "S p"]) -> Float[np.ndarray, "S 4"]:
    """Return c of the velocity c z that forces see; it has no more than the states of a body in registers."""
    c = np.zeros((len(thetas), 4))
    if plant.swings:
        c[:, : plant.order] = dynamics.readings(plant, thetas)[:, 0]
    else:
        c[:, min(1, plant.order - 1)] = 1.0
    return c


def distinct(values: Float[np.ndarray, "S k"]) -> tuple[np.ndarray, np.ndarray]:
    """List the first row and those that differ from it, and where in this list each row finds its own.

    Most steps of a Jacobian leave the poles as they are, or what drives the plant.
    """
    if len(values) == 1:
        return FIRST, FIRST
    different = (values != values[0]).any(axis=1)
    different[0] = True
    return np.flatnonzero(different), np.where(different, np.cumsum(different) - 1, 0)


class Simulator:
    """One plant on the inputs of several experiments, u [E, T, nu]; shorter ones are padded by the caller.

    They begin where their runs do if nothing is said of their past.
    """

    def __init__(self, plant: Plant, u: Float[np.ndarray, "E T nu"], past: Past | None = None) -> None:
        self.plant = plant
        self.drive = Drive(plant, u, past)
        self.substeps, self.h = self.drive.substeps, self.drive.h
        self.t = plant.dt * np.arange(u.shape[1])  # [T]
        self.shape = u.shape
        self._u_first = u[:, :1]
        self._constants = self._of_machine() if plant.machine else None
        of_command = plant.on("input", plant.nu) if plant.machine else []
        limited: list[Any] = [term.effect for term in of_command]
        self._n_commands, free = len(of_command), SLOTS - len(of_command)
        self._commands = tuple(compiled(effect.command) for effect in limited) + (compiled(nothing),) * free
        self._c_at = np.array([plant.part_of(term).start for term in of_command] + [0] * free)
        self._has_sensors = any(term.effect.port == "output" for term in plant.terms)
        self._known = b"", np.empty((0, *u.shape[:2], 1))  # the states [1, E, T, n] of what was simulated last
        self._duration = plant.dt * u.shape[1]
        forces = [term for term in plant.on("force") if term not in self.drive.loads]
        forces.sort(key=lambda term: ROLES.index(term.effect.role))
        if len(forces) > SLOTS:
            raise ValueError(f"a model holds up to {SLOTS} forces, this one has {len(forces)}")
        acting: list[Any] = [term.effect for term in forces]
        unused = SLOTS - len(forces)
        self._terms = tuple(compiled(effect.term) for effect in acting) + (compiled(nothing),) * unused
        self._until = np.searchsorted([ROLES.index(effect.role) for effect in acting], range(len(ROLES)), side="right")
        self._p_at = np.array([plant.part_of(term).start for term in forces] + [0] * unused)
        memory = np.cumsum([0] + [term.effect.memory for term in forces])
        self._m_at = np.array([*memory, *([memory[-1]] * unused)])  # one more: where the last one's memory ends
        self._memory = np.zeros(max(1, int(memory[-1])))
        remembered = [(term, at) for term, at in zip(forces, memory, strict=False) if term in plant.remembered]
        self._remembered = [at for _, at in remembered]
        self._begins_at = [plant.start_of(term) for term, _ in remembered]

    def states(
        self, thetas: Float[np.ndarray, "S p"], starts: Float[np.ndarray, "S E n"]
    ) -> Float[np.ndarray, "S E T n"]:
        """Simulate the states at the samples, the first being the start, for each of several thetas."""
        plant, (experiments, samples, _) = self.plant, self.shape
        if plant.imposed:
            return np.stack([self._forces(*of_run) for of_run in zip(thetas, starts, strict=True)])
        if plant.machine is not None:
            return np.stack([self._machine(*of_run) for of_run in zip(thetas, starts, strict=True)])
        n, s = plant.order, len(thetas)
        at_start, begun = np.ascontiguousarray(starts[:, :, :n]), starts[:, :, n:]
        of_poles, place = distinct(thetas[:, plant.layout.poles])
        matrices = np.array([dynamics.matrix(plant, theta) for theta in thetas[of_poles]])
        steps = np.empty((3, len(matrices), n, n))
        transitions(matrices, self.h, *steps)
        e, g0, g1 = steps.take(place, axis=1)
        rates = np.array([-np.diag(a) if plant.cascade else carried(plant, a) for a in matrices])[place]
        of_drive, place = distinct(np.concatenate((thetas[:, self.drive.depends_on], begun.reshape(s, -1)), axis=1))
        drives = self.drive.of_each(thetas[of_drive], begun[of_drive])[place]
        states = np.empty((s, experiments, samples, n))
        entry = 0 if plant.cascade else ENTRY if plant.joint else n - 1
        if not self._until[-1]:
            run_linear(e, g0, entry, drives, at_start, self.substeps, states)
            return states
        run = run_tanks if plant.cascade else run_body
        run(
            e, g0, g1, rates, seen(plant, thetas), entry, drives, at_start, self.drive.since, self.substeps, self.h,
            self._terms, self._until, np.ascontiguousarray(thetas), self._p_at, self._m_at, self._begun(starts), states,
        )  # fmt: skip
        return states

    def _begun(self, starts: Float[np.ndarray, "*S E n"]) -> Float[np.ndarray, "*S E m"]:
        """Take what the force terms remember at the start out of the initial states."""
        begun = np.zeros((*starts.shape[:-1], len(self._memory)))
        begun[..., self._remembered] = np.clip(starts[..., self._begins_at], -1.0, 1.0)
        return begun

    def _of_machine(self) -> tuple[np.ndarray, ...]:
        """Take gain, supply and enabled [E, T] at the samples."""
        return tuple(np.ascontiguousarray(column[:, :: self.substeps]) for column in self.drive.of_machine())

    def _machine(self, theta: Float[np.ndarray, " p"], start: Float[np.ndarray, "E n"]) -> Float[np.ndarray, "E T n"]:
        """Simulate a machine of which something is known."""
        plant, machine = self.plant, self.plant.machine
        assert machine is not None and self._constants is not None
        gain, supply, on = self._constants
        known, states = machine.known, np.empty((*self.shape[:2], plant.order))
        goal = self.drive.arriving(theta, machine.of_drive, start)
        if machine.controlled and known.goal_factor != 1.0:
            goal = goal * known.goal_factor
        inertias, weights = machine.moments(self._u_first, theta)
        numbers = np.array([*theta[[DAMPING, BACK_EMF, DERIVATIVE, STIFFNESS]], known.radian, known.hangs_at])
        run_machine(
            machine.controlled, np.ascontiguousarray(goal), gain, supply * theta[plant.layout.gains.start], on,
            inertias, weights, numbers, np.ascontiguousarray(start[:, : plant.order]), self.drive.since,
            self.substeps, self.h, self._terms, self._until, np.ascontiguousarray(theta), self._p_at, self._m_at,
            self._memory, self._commands, self._c_at, self._n_commands, states,
        )  # fmt: skip
        return states

    def _forces(self, theta: Float[np.ndarray, " p"], start: Float[np.ndarray, "E m"]) -> Float[np.ndarray, "E T 2"]:
        """Compute the forces that the motion takes, and the rate that c1 multiplies: of the drive, or of the motion."""
        states, begun = np.empty((*self.shape[:2], 2)), self._begun(start)
        x, v = self.drive.motion(theta, start)
        follow_motion(
            self.drive.of(theta, start), x, v, self.drive.since, self.h, self._terms, self._until,
            np.ascontiguousarray(theta), self._p_at, self._m_at, begun, self._memory, states,
        )  # fmt: skip
        if self.plant.by_rate:
            states[:, :, 1] = v
        return states

    def motion(
        self, theta: Float[np.ndarray, " p"], local: Float[np.ndarray, "E q"]
    ) -> tuple[Float[np.ndarray, "E T"], Float[np.ndarray, "E T"]]:
        """Simulate position and velocity, as the forces see them."""
        if self.plant.imposed:
            return self.drive.motion(theta, local)
        states = self.states(theta[None], local[None, :, : self.plant.n_moving])[0]
        if self.plant.swings:
            v = states @ seen(self.plant, theta[None])[0, : self.plant.order]
            return v, v
        return states[..., 0], states[..., min(1, self.plant.order - 1)]

    def run(
        self, theta: Float[np.ndarray, " p"], local: Float[np.ndarray, "E q"], *, steps: bool = True
    ) -> Float[np.ndarray, "E T ny"]:
        """Simulate the outputs; local holds the initial state and the per-experiment parameters."""
        return self.run_many(theta[None], local[None], steps=steps)[0]

    def run_many(
        self, thetas: Float[np.ndarray, "S p"], locals_: Float[np.ndarray, "S E q"], *, steps: bool = True
    ) -> Float[np.ndarray, "S E T ny"]:
        """Simulate with several parameter vectors; those that differ in what only sensors do share their states.

        Without `steps`, no sensor reads in any.
        """
        plant = self.plant
        moving, starts = thetas[:, plant.moves_states], locals_[:, :, : plant.n_moving]
        keys = [of_run.tobytes() + start.tobytes() for of_run, start in zip(moving, starts, strict=True)]
        known, states_known = self._known
        row_of = {key: row for row, key in enumerate(keys) if key != known}
        rows = list(row_of.values())
        states = self.states(thetas[rows], starts[rows]) if rows else states_known
        place = {known: -1} | {key: i for i, key in enumerate(row_of)}
        which = np.array([place[key] for key in keys])
        y = np.empty((len(keys), *self.shape[:2], plant.ny))
        readings = dynamics.readings(plant, thetas)
        with np.errstate(over="ignore", invalid="ignore"):
            read(states_known, states, which, readings, y)
            if self._has_sensors:
                for of_run in zip(thetas, locals_, y, strict=True):
                    self._pass_sensors(*of_run, steps=steps)
        # The Jacobian is asked for where a fit has just been.
        self._known = keys[0], states[which[0], None] if which[0] >= 0 else states_known
        return y

    def _pass_sensors(
        self,
        theta: Float[np.ndarray, " p"],
        local: Float[np.ndarray, "E q"],
        y: Float[np.ndarray, "E T ny"],
        *,
        steps: bool,
    ) -> None:
        """Let the sensors' effects act on the outputs, in place."""
        plant = self.plant
        for channel in range(plant.ny):
            for term in plant.on("output", channel):
                p = theta[plant.part_of(term)]
                if term.effect.own:
                    shapes = term.effect.shapes(self.t, self._duration, p)
                    y[:, :, channel] += local[:, plant.own_part_of(term)] @ shapes
                elif steps or not term.effect.in_steps:
                    y[:, :, channel] = self._read(term, y[:, :, channel], p, local)

    def _read(
        self, term: Term, y: Float[np.ndarray, "E T"], p: Float[np.ndarray, " k"], local: Float[np.ndarray, "E q"]
    ) -> Float[np.ndarray, "E T"]:
        assert isinstance(term.effect, OutputEffect)
        if term in self.plant.remembered:
            return term.effect.term_from(y, p, self.t, local[:, self.plant.start_of(term)])
        return term.effect.term(y, p, self.drive.since[:, None] + self.t if term.effect.of_time else self.t)
