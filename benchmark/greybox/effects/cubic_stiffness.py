"""A cubic spring."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Scene, Start
from simgap.registry import EFFECTS


@EFFECTS.register("cubic_stiffness")
@final
class CubicStiffness(ForceEffect):
    """f = -k x^3."""

    name: ClassVar[str] = "cubic_stiffness"
    title: ClassVar[str] = "cubic stiffness"
    explanation: ClassVar[str] = (
        "A spring that gets stiffer (or softer) the further it is stretched, both ways: a clamped beam, rubber "
        "near its limit, a membrane."
    )
    reference: ClassVar[str] = "Kovacic and Brennan, The Duffing Equation, 2011, ch. 2"
    role: ClassVar[Role] = "force"
    shows_in: ClassVar[tuple[str, ...]] = ("position", "amplitude")
    twins: ClassVar[dict[str, str]] = {
        "position_torque": "travel further: a torque that repeats over position turns back, a hardening spring goes on",
        "input_saturation": "hold constant inputs up to the largest: saturation ends the growth at one value of "
        "the input",
        "quadratic_drag": "hold it at rest away from the middle: a spring still pulls, drag does not",
    }

    def parameters(self, scene: Scene) -> tuple[Parameter, ...]:
        """The coefficient."""
        return (
            Parameter(
                "stiffness",
                scene.unit(-2, -scene.order),
                -100 * scene.force / scene.place**3,
                100 * scene.force / scene.place**3,
            ),
        )

    def starts(self, scene: Scene) -> list[Start]:
        """A weak spring."""
        return [Start((0.1 * scene.force / scene.place**3,), amplitude=0)]

    def suits(self, scene: Scene) -> bool:
        """Where a position is known."""
        return scene.kind == "position" or (scene.kind == "other" and scene.order > 1)

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """The spring's pull."""
        return -p[i] * x * x * x
