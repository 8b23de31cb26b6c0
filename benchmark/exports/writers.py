"""The step of one fitted plant, as text: one substep of each kind of plant, and what calls the laws of its effects."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.greybox import dynamics
from simgap.greybox.drive import Drive
from simgap.greybox.effects.effect import Effect, ForceEffect, InputEffect, OutputEffect
from simgap.greybox.linear_kernels import transition
from simgap.greybox.model import FittedPlant
from simgap.greybox.plant import Plant
from simgap.greybox.simulation import CARRIED, carried, seen
from simgap.greybox.terms import Term
from simgap.greybox.two_masses import ENTRY
from simgap.records import UnusableInput

Law = tuple[str, Callable[..., float], tuple[Callable[..., float], ...]]  # its name, and the functions that it calls


def law_name(effect: Effect) -> str:
    """Name the law of an effect: by its class, because a finer law has the name of the effect that it refines."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type(effect).__name__).lower()


class Cells:
    """Places in the state, handed out one after the other."""

    def __init__(self, taken: int) -> None:
        self.taken = taken

    def take(self, count: int) -> int:
        """Reserve so many places; return the first."""
        self.taken += count
        return self.taken - count


class PlantWriter:
    """The step of one fitted plant, and where its numbers stand in the state of the whole model."""

    def __init__(self, fitted: FittedPlant, number: int, cells: Cells, nu: int) -> None:
        self.fitted, self.number, self.name, self.nu = fitted, number, f"plant{number}", nu
        self.plant: Plant = fitted.forecast.plant
        self.theta = fitted.forecast.theta
        self.of_theta, self.sub = f"P{number}", self.plant.substeps
        self.h = self.plant.dt / self.sub
        if self.plant.by_rate:
            raise UnusableInput("the input is the rate of an imposed motion, which no format takes; give its position")
        if self.plant.imposed and self.plant.zeros:
            raise UnusableInput(
                "the model reads the rate of the imposed motion from the sample after the present one; a step knows no "
                "sample to come, and no format takes such a model"
            )
        n, flows = self.plant.order, self.plant.order if self.plant.cascade else 1
        self.count, self.at, self.before = cells.take(1), cells.take(n), cells.take(flows)
        self.back = 1 - min(self.plant.taps)  # samples of the input before the newest that a substep needs
        through = range(nu) if self.plant.machine is None else (self.plant.machine.of_drive,)
        self.arriving = {channel: cells.take((self.back + 1) * self.sub) for channel in through}
        self.motion = cells.take(2)  # velocity and direction of an imposed motion
        self.memory = {term: cells.take(self._cells(term)) for term in self.plant.terms}

    def _cells(self, term: Term) -> int:
        effect: Any = term.effect
        if isinstance(effect, ForceEffect):
            return effect.memory
        return effect.cells(self.theta[self.plant.part_of(term)], self.h if effect.port == "input" else self.plant.dt)

    def laws(self) -> Iterator[Law]:
        """Yield the name, the law and its helpers, of every effect."""
        for term in self.plant.terms:
            effect: Any = term.effect
            yield law_name(effect), effect.term if isinstance(effect, ForceEffect) else effect.step, effect.helpers

    def constants(self) -> dict[str, np.ndarray]:
        """Give the parameters, the transition over a substep, and the rows that the outputs read."""
        plant, n, q = self.plant, self.plant.order, self.number
        given = {f"P{q}": self.theta, f"C{q}": dynamics.readings(plant, self.theta[None])[0, : plant.ny, : max(n, 1)]}
        if n:
            matrices, a = np.empty((3, n, n)), dynamics.matrix(plant, self.theta)
            transition(a, self.h, *matrices)
            given |= dict(zip((f"E{q}", f"G{q}", f"R{q}"), matrices, strict=True))
            given[f"RATES{q}"], given[f"CARRIED{q}"] = -np.diag(a), carried(plant, a)
            given[f"SEEN{q}"] = seen(plant, self.theta[None])[0, :n]
        return {name: np.ascontiguousarray(value).ravel() for name, value in given.items()}

    def start(self, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"], state: np.ndarray) -> None:
        """Write the start that suits the first samples into the state, before sample 0."""
        plant = self.plant
        local = self.fitted.start(u[None], y_init[None][:, :, list(self.fitted.outputs)])
        state[self.at : self.at + plant.order] = local[0, : plant.order]
        for term, value in zip(plant.remembered, local[0, plant.order :], strict=False):
            state[self.memory[term]] = np.clip(value, -1, 1) if term.effect.port == "force" else value
        if plant.imposed and len(u) > 1:
            x = Drive(plant, u[None]).arriving(self.theta, 0, local)
            state[self.motion] = (x[0, 1] - x[0, 0]) / plant.dt

    def held(self) -> list[int]:
        """List the inputs that keep one value in a run."""
        return []

    def text(self) -> str:
        """Write the functions of this plant, `..._step` the last of them."""
        parts = [self.input(channel) for channel in self.arriving]
        if self.plant.imposed:
            return "\n\n\n".join([*parts, self._follow()])
        return "\n\n\n".join([*parts, self._tanks() if self.plant.cascade else self._body(), self.step()])

    def input(self, channel: int) -> str:
        """Write the function that passes an input through its effects."""
        lines = [f"def {self.name}_input{channel}(s: list, u: float, k: int):",
                 '    """Pass the input through its effects, at substep k."""']  # fmt: skip
        for term in self.plant.on("input", channel):
            assert isinstance(term.effect, InputEffect)
            at, cells = self.plant.part_of(term).start, self.memory[term]
            lines.append(f"    u = {law_name(term.effect)}(u, {self.of_theta}, {at}, s, {cells}, {self.h!r}, k)")
        return "\n".join([*lines, "    return u"])

    def forces(self, role: str, x: str, v: str, h: str) -> list[tuple[Term, str]]:
        """List the terms of a role with the call of each."""
        found = [term for term in self.plant.on("force") if term.effect.role == role]
        at = [(self.plant.part_of(term).start, self.memory[term]) for term in found]
        calls = [
            f"{law_name(term.effect)}({x}, {v}, t, {h}, {self.of_theta}, {p}, s, {m})"
            for term, (p, m) in zip(found, at, strict=True)
        ]
        return list(zip(found, calls, strict=True))

    def frictions(self, x: str, v: str, h: str, load: str, damping: str = "0.0") -> list[str]:
        """Write what dry friction can hold, after telling it what the drive carries and what damping takes of it."""
        lines = []
        for term, call in self.forces("friction", x, v, h):
            if term.effect.memory:
                lines += [f"    s[{self.memory[term]}] = {load}", f"    s[{self.memory[term] + 1}] = {damping}"]
            lines.append(f"    hold += {call}")
        return lines

    def _body(self) -> str:
        plant, q, at = self.plant, self.number, self.at
        n, fast = plant.order, min(1, plant.order - 1)
        entry = ENTRY if plant.joint else n - 1
        x, v, h = f"s[{at}]", f"s[{at + fast}]", repr(self.h)
        if plant.swings:
            x = v = "(" + " + ".join(f"SEEN{q}[{i}] * s[{at + i}]" for i in range(n)) + ")"
        pulled = " + ".join(f"CARRIED{q}[{i}] * s[{at + i}]" for i in range(min(n, CARRIED - 1)))
        lines = [f"def {self.name}_substep(s: list, drive: float, begun: int):",
                 '    """Advance the body by a substep, after so many."""',
                 f"    new = [0.0] * {n}", f"    t = begun * {h}", "    force = 0.0"]  # fmt: skip
        lines += [f"    force += {call}" for _, call in self.forces("force", x, v, h)]
        load, damping = f"drive + ({pulled}) - force", f"CARRIED{q}[{CARRIED - 1}] * {v}"
        lines += ["    hold = 0.0", *self.frictions(x, v, h, load, damping)]
        lines.append(f"    change = force - s[{self.before}] if begun > 0 else 0.0")
        lines.append(
            f"    move_body(s, {at}, new, E{q}, G{q}, R{q}, {n}, {entry}, SEEN{q}, drive, force, change, hold)"
        )
        for term, _ in self.forces("stop", x, v, h):
            p = plant.part_of(term).start
            lines.append(f"    stop_body(new, {fast}, {self.of_theta}[{p}], {self.of_theta}[{p + 1}])")
        for _, call in self.forces("braking", x, v, h):
            lines.append(f"    brake_body(new, {n}, s[{at}], {call}, {h})")
        return "\n".join([*lines, f"    take(s, {at}, new, {n})", f"    s[{self.before}] = force"])

    def _tanks(self) -> str:
        plant, q, at, n = self.plant, self.number, self.at, self.plant.order
        x, h = f"s[{at}]", repr(self.h)
        last = f"RATES{q}[{n - 1}]"
        lines = [f"def {self.name}_substep(s: list, drive: float, begun: int):",
                 '    """Advance the tanks by a substep, after so many."""',
                 f"    new = [0.0] * {n}", f"    flow = [0.0] * {n}", f"    t = begun * {h}"]  # fmt: skip
        lines += [f"    flow[0] += {call}" for _, call in self.forces("force", x, x, h)]
        for _, call in self.forces("outflow", "level", "0.0", h):
            lines += [f"    for i in range({n}):", f"        level = s[{at} + i] * RATES{q}[i] / ({last} + 1e-300)",
                      f"        flow_out(flow, i, {n}, {last} * {call})"]  # fmt: skip
        lines.append(f"    fill_tanks(s, {at}, new, flow, {self.before}, E{q}, G{q}, R{q}, {n}, drive, begun)")
        for term, _ in self.forces("rim", x, x, h):
            rims = ", ".join(f"{self.of_theta}[{plant.part_of(term).start + i}]" for i in range(3))
            lines.append(f"    spill_tanks(new, {n}, RATES{q}, {rims})")
        return "\n".join([*lines, f"    take(s, {at}, new, {n})"])

    def _shifted_inputs(self) -> list[str]:
        """Write: the newest sample of each input arrives, the oldest is forgotten."""
        kept, lines = self.back * self.sub, []
        for channel, a in self.arriving.items():
            lines += [
                f"    for i in range({kept}):", f"        s[{a} + i] = s[{a + self.sub} + i]",
                f"    for i in range({self.sub}):",
                f"        s[{a + kept} + i] = {self.name}_input{channel}(s, u[{channel}], k * {self.sub} + i)",
                "    if k == 0:", f"        for i in range({kept}):", f"            s[{a} + i] = s[{a + kept}]",
            ]  # fmt: skip
        return lines

    def _drive(self, back: int, i: str) -> list[str]:
        """Write b u + d for substep i of the sample so many before the newest."""
        layout = self.plant.layout
        gains = np.arange(layout.gains.start, layout.gains.stop).reshape(self.nu, -1)
        offset = f"{self.of_theta}[{layout.offset.start}]" if self.plant.offset else "0.0"
        lines = [f"drive = {offset}"]
        for a, of_channel in zip(self.arriving.values(), gains, strict=True):
            for tap, gain in zip(self.plant.taps, of_channel, strict=True):
                place = a + (self.back - back + tap) * self.sub
                lines.append(f"drive += {self.of_theta}[{gain}] * s[{place} + {i}]")
        return lines

    def step(self) -> str:
        """Write the step that takes the plant from the sample before to this one and reads its sensors."""
        lines = [f"def {self.name}_step(s: list, u: list, y: list):",
                 '    """Take the plant from the sample before to this one, and read its sensors."""',
                 f"    k = int(s[{self.count}])", *self._shifted_inputs(),
                 "    if k > 0:", f"        for i in range({self.sub}):"]  # fmt: skip
        lines += [f"            {line}" for line in self.advance()]
        n, q = self.plant.order, self.number
        for row, output in enumerate(self.fitted.outputs):
            lines += [f"    y[{output}] = 0.0", f"    for i in range({n}):",
                      f"        y[{output}] += C{q}[{row * n} + i] * s[{self.at} + i]"]  # fmt: skip
        return "\n".join([*lines, *self._sensors(), f"    s[{self.count}] = k + 1"])

    def advance(self) -> list[str]:
        """Write substep i since the sample before."""
        return [*self._drive(1, "i"), f"{self.name}_substep(s, drive, (k - 1) * {self.sub} + i)"]

    def _sensors(self) -> list[str]:
        lines = []
        for row, output in enumerate(self.fitted.outputs):
            for term in self.plant.on("output", row):
                assert isinstance(term.effect, OutputEffect)
                at, cells, dt = self.plant.part_of(term).start, self.memory[term], self.plant.dt
                given = f"y[{output}], {self.of_theta}, {at}, s, {cells}, {dt!r}, k"
                lines.append(f"    y[{output}] = {law_name(term.effect)}({given})")
        return lines

    def _follow(self) -> str:
        """Write the step of an imposed motion: the force that it takes."""
        newest, v, side, dt = self.arriving[0] + self.back, self.motion, self.motion + 1, self.plant.dt
        output = self.fitted.outputs[0]
        lines = [f"def {self.name}_step(s: list, u: list, y: list):", '    """Compute the force of the motion."""',
                 f"    k = int(s[{self.count}])", f"    t = k * {dt!r}", *self._shifted_inputs(),
                 f"    h = {dt!r} if k > 0 else 0.0", "    if k > 0:",
                 f"        s[{v}] = (s[{newest}] - s[{newest - 1}]) / {dt!r}",
                 f"    if s[{v}] != 0.0:", f"        s[{side}] = 1.0 if s[{v}] > 0.0 else -1.0"]  # fmt: skip
        lines += [f"    {line}" for line in self._drive(0, "0")] + ["    force = drive"]
        lines += [f"    force -= {call}" for _, call in self.forces("force", f"s[{newest}]", f"s[{v}]", "h")]
        for line in self.frictions(f"s[{newest}]", f"s[{v}]", "h", "force"):
            lines.append(line.replace("    hold += ", f"    force += s[{side}] * "))
        return "\n".join([*lines, f"    y[{output}] = force", *self._sensors(), f"    s[{self.count}] = k + 1"])
