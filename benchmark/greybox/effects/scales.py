"""Sizes of the signals of a plant, by which effects choose their bounds and where they begin."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.records import Kind


@dataclass(frozen=True)
class SignalScales:
    """Sizes of the signals of a plant in physical units, known before an effect is fitted."""

    kind: Kind
    order: int
    dt: float  # s
    duration: float  # s, of the longest experiment
    u_low: float  # unit of the input, as are the next two
    u_high: float
    u_rms: float
    y_low: float  # unit of the output, as are the next two
    y_high: float
    y_rms: float
    x_max: float  # the largest distance from zero
    v_max: float  # the largest velocity
    stroke: float  # the distance between far reversals
    force_rms: float  # what the input does, in the unit of the highest derivative
    u_unit: str = ""
    y_unit: str = ""
    lines: tuple[float, ...] = ()  # Hz, frequencies at which the errors of all experiments agree
    tones: tuple[float, ...] = ()  # Hz, those that stand out in the errors, whatever their phase
    force: str = ""  # unit of the forces, where the inertia is known
    commanded: bool = False  # the input is the command of a controller inside; x_max is then its largest error
    quantisation_step: float = 0.0  # unit of the output: the step of the grid that all readings lie on, 0 without one

    @property
    def at_zero(self) -> bool:
        """Whether the plain model lacks an operating point that is fitted, and stands at zero without input."""
        return self.kind in ("position", "velocity")

    @property
    def u_max(self) -> float:
        """Largest absolute value of the input."""
        return max(abs(self.u_low), abs(self.u_high))

    def unit(self, length: int, s: int) -> str:
        """Write the unit L^length s^s, where L is the output's unit or, for a velocity, that of its integral."""
        unit = self.u_unit if self.order == 0 else self.y_unit  # an imposed motion is an input
        base, rate = (unit.removesuffix("/s"), length) if unit.endswith("/s") else (unit, 0)
        if self.kind == "velocity" and not rate:
            s += length  # the output's unit is that of a velocity whatever it is called
        if self.kind != "velocity":
            s -= rate
        base = f"({base})" if "/" in base else base
        powers = [(base, length), ("s", s)] if base else [("s", s)]
        numerator = " ".join(f"{name}^{n}" if n > 1 else name for name, n in powers if n > 0)
        factors = [f"{name}^{-n}" if n < -1 else name for name, n in powers if n < 0]
        if not factors:
            return numerator
        denominator = factors[0] if len(factors) == 1 else f"({' '.join(factors)})"
        return f"{numerator or '1'}/{denominator}"

    @property
    def force_unit(self) -> str:
        """Unit of the forces on the plant: that of the highest derivative."""
        if self.force:
            return self.force
        if self.order == 0:
            return self.y_unit
        return self.unit(1, -1 if self.kind == "level" else -self.order - (self.kind == "velocity"))

    def force_over(self, x: int = 0, v: int = 0) -> str:
        """Unit of a force over x powers of the position and v of the velocity, as the force terms see them."""
        seconds = 0 if self.order == 1 and self.kind == "other" else v  # there the velocity is the output itself
        if not self.force and self.order:
            return self.unit(1 - x - v, seconds - self.order - (self.kind == "velocity"))
        force, moved = self.force or self.y_unit, self.y_unit if self.order else self.u_unit
        if self.kind == "velocity" and not moved.endswith("/s"):
            seconds = 0  # rpm, km/h
        moved = moved.removesuffix("/s")
        above = " ".join(filter(None, [force, f"s^{seconds}" if seconds > 1 else "s" * seconds])) or "1"
        below = f"({moved})" if "/" in moved else moved
        return f"{above}/{below}{f'^{x + v}' if x + v > 1 else ''}" if below else above

    @property
    def velocity_unit(self) -> str:
        """Unit of the velocity that the force terms see."""
        return self.unit(1, -1 if self.order != 1 or self.kind == "velocity" else 0)
