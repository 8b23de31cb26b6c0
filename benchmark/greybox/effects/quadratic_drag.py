"""Drag of a turbulent flow."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.findings import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("quadratic_drag")
@final
class QuadraticDrag(ForceEffect):
    """f = -c v abs(v)."""

    name: ClassVar[str] = "quadratic_drag"
    title: ClassVar[str] = "quadratic drag"
    explanation: ClassVar[str] = (
        "A force against the motion that grows with the square of the velocity: air or water around the body, oil "
        "through an orifice."
    )
    reference: ClassVar[str] = "Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, ch. 6"
    role: ClassVar[Role] = "force"
    shows_in: ClassVar[tuple[ViewName, ...]] = ("velocity", "rate of change", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "coulomb_friction": "run at two constant speeds, one twice the other: drag costs four times as much",
        "input_saturation": (
            "hold constant inputs up to the largest: with drag the steady speed bends, with saturation it stops "
            "growing at once"
        ),
        "dead_zone": (
            "hold several constant inputs: the steady output over the input is curved for drag, kinked for a dead zone"
        ),
        "stribeck_friction": (
            "run at several constant speeds: drag grows with the square of the speed, Stribeck friction falls with it"
        ),
        "hysteresis": (
            "run at two constant speeds, one twice the other: drag costs four times as much, a hysteretic force costs "
            "the same"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The drag coefficient."""
        return (
            Parameter(
                "drag",
                scales.unit(-1, 0 if scales.order > 1 or scales.kind == "velocity" else -1),
                0.0,
                100 * scales.force_rms / scales.v_max**2,
            ),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """A small drag."""
        return [Start((0.1 * scales.force_rms / scales.v_max**2,), amplitude=0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Where something moves."""
        return scales.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Against v, with its square."""
        return -p[i] * v * abs(v)
