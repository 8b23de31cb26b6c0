"""A machine of which something is known as a step form: a substep of `simgap.greybox.machine_kernels`, as text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from simgap.exports.writers import Cells, Law, PlantWriter
from simgap.greybox import dynamics
from simgap.greybox.effects.effect import InputEffect
from simgap.greybox.machine import ARM, BACK_EMF, DAMPING, DERIVATIVE, INERTIA, MASS, STIFFNESS, Machine
from simgap.greybox.model import FittedPlant
from simgap.known_plant import Known


class MachineWriter(PlantWriter):
    """The step of a known machine. Columns of its table are inputs, numbers are constants in the text."""

    def __init__(self, fitted: FittedPlant, number: int, cells: Cells, nu: int) -> None:
        super().__init__(fitted, number, cells, nu)
        assert self.plant.machine is not None
        self.machine: Machine = self.plant.machine
        # Where the columns of the sample before stand, which act until the present one.
        self.columns = {channel: cells.take(1) for channel in range(nu) if channel not in self.arriving}

    def laws(self) -> Iterator[Law]:
        """Yield the laws of the effects, and those of a command under names of their own."""
        of_command = self.plant.on("input", self.plant.nu)
        for term, law in zip(self.plant.terms, super().laws(), strict=True):
            effect: Any = term.effect
            yield (f"{effect.name}_command", effect.command, ()) if term in of_command else law

    def constants(self) -> dict[str, np.ndarray]:
        """Give the parameters, and the row that the output reads."""
        return {self.of_theta: self.theta, f"C{self.number}": dynamics.readings(self.plant, self.theta[None]).ravel()}

    def held(self) -> list[int]:
        """List the columns of mass, arm, inertia and the controller's gain."""
        known = self.machine.known
        constants = (known.mass, known.arm, known.inertia, known.gain)
        return [self.machine.names.index(one.column) for one in constants if one is not None and one.column]

    def text(self) -> str:
        """Write the functions of this machine, `..._step` the last of them."""
        parts = [self.input(self.machine.of_drive), self._substep(), self.step()]
        kept = [f"    s[{cell}] = u[{channel}]" for channel, cell in self.columns.items()]
        return "\n\n\n".join(parts) + "".join(f"\n{line}" for line in kept)

    def advance(self) -> list[str]:
        """Write substep i since the sample before, on the columns of that one."""
        known, p = self.machine.known, self.of_theta
        goal = f"s[{self.arriving[self.machine.of_drive]} + i]" + _times(known.goal_factor if known.controlled else 1.0)
        mass, arm, inertia = (
            self._column(one, "") if one is not None and one.column else f"{p}[{i}]"
            for one, i in ((known.mass, MASS), (known.arm, ARM), (known.inertia, INERTIA))
        )
        moment = f"{mass} * {arm} * {arm}" if known.arm is not None else mass
        drive = f"{p}[{self.plant.layout.gains.start}]"
        on = self._column(Known(column=known.enabled), "") if known.enabled else "1.0"
        total = f"({inertia} + {moment}){times}" if (times := _times(known.radian)) else f"{inertia} + {moment}"
        return [
            f"on = {on}", f"inertia = {total}",
            f"weight = {mass} * {arm}{_times(known.gravity)}" if known.gravity else "weight = 0.0",
            f"gain = {self._column(known.gain, '1.0')}",
            f"strength = {drive} * {self._column(known.supply, '1.0')} * on",
            f"{self.name}_substep(s, {goal}, gain, strength, on, inertia, weight, (k - 1) * {self.sub} + i)",
        ]  # fmt: skip

    def _column(self, known: Known | None, other: str) -> str:
        if known is None:
            return other
        if not known.column:
            return repr(known.value)
        return f"s[{self.columns[self.machine.names.index(known.column)]}]" + _times(known.factor)

    def _substep(self) -> str:
        plant, known, p, h = self.plant, self.machine.known, self.of_theta, repr(self.h)
        moves = plant.order > 1
        x = "x" if moves else "v"
        lines = [
            f"def {self.name}_substep(s: list, goal, gain, strength, on, inertia, weight, begun: int):",
            '    """Advance the machine by a substep, after so many."""',
            f"    t = begun * {h}", f"    v = s[{self.at + plant.order - 1}]",
        ]  # fmt: skip
        if moves:
            lines += [f"    q = s[{self.at}]", f"    x = q + 0.5 * {h} * v"]
        lines += (
            [f"    command = gain * (goal - x) - {p}[{DERIVATIVE}] * v"] if known.controlled else ["    command = goal"]
        )
        lines += [f"    command = {call}" for call in self._commands(h)]
        lines += [
            "    drive = strength * command",
            f"    other = -{p}[{STIFFNESS}] * {x}" if moves else "    other = 0.0",
        ]
        if known.gravity:
            turned = f"({x} - {known.hangs_at!r})" if known.hangs_at else x
            lines.append(f"    other -= weight * math.sin({turned}{_times(known.radian)})")
        lines += [f"    other += {call}" for _, call in self.forces("force", x, "v", h)]
        lines.append("    hold = 0.0")
        lines += self.frictions(x, "v", h, f"drive - {p}[{BACK_EMF}] * on * v - other")
        lines.append(f"    d = {p}[{DAMPING}] + {p}[{BACK_EMF}] * on")
        lines += [f"    other -= d * {call}" for _, call in self.forces("outflow", x, "0.0", h)]
        lines += [
            f"    scale = -math.expm1(-{h} * d / (inertia + 1e-300)) / d if d > 0.0 else {h} / (inertia + 1e-300)",
            "    new = v + scale * (drive + other - d * v)", "    if hold > 0.0:",
            "        new += scale * dry_friction(v, new, scale, hold)",
        ]  # fmt: skip
        rims = [plant.part_of(term).start for term, _ in self.forces("rim", x, "v", h)]
        lines += [f"    new = min(new, {p}[{at}])" for at in rims]
        if moves:
            lines.append(f"    q += 0.5 * {h} * (v + new)")
            for term, _ in self.forces("stop", x, "v", h):
                at = plant.part_of(term).start
                lines += [
                    f"    end = min(max(q, {p}[{at}]), {p}[{at + 1}])", "    if q != end:",
                    "        new = min(new, 0.0) if q > end else max(new, 0.0)", "        q = end",
                ]  # fmt: skip
            lines.append(f"    s[{self.at}] = q")
        return "\n".join([*lines, f"    s[{self.at + plant.order - 1}] = new"])

    def _commands(self, h: str) -> Iterator[str]:
        for term in self.plant.on("input", self.plant.nu):
            assert isinstance(term.effect, InputEffect)
            at = self.plant.part_of(term).start
            yield f"{term.effect.name}_command(command, goal - x, t, {h}, {self.of_theta}, {at}, s, 0)"


def _times(factor: float) -> str:
    return f" * {factor!r}" if factor != 1.0 else ""
