"""A coarse reading."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.greybox.effects.effect import OutputEffect, Parameter, Scene, Start
from simgap.registry import EFFECTS


@EFFECTS.register("quantisation")
@final
class Quantisation(OutputEffect):
    """reading = q round(y / q)."""

    name: ClassVar[str] = "quantisation"
    title: ClassVar[str] = "quantisation"
    explanation: ClassVar[str] = "The reading comes in steps: few counts of an encoder, few bits of a converter."
    reference: ClassVar[str] = "Widrow and Kollar, Quantization Noise, 2008, ch. 4"
    shows_in: ClassVar[tuple[str, ...]] = ("position",)
    twins: ClassVar[dict[str, str]] = {}

    def parameters(self, scene: Scene) -> tuple[Parameter, ...]:
        """The step, as read off the values themselves."""
        return (Parameter("step", scene.y_unit, scene.lattice, scene.lattice, fixed=True),)

    def starts(self, scene: Scene) -> list[Start]:
        """The grid of the readings."""
        return [Start((scene.lattice,))]

    def suits(self, scene: Scene) -> bool:
        """Where the readings lie on a grid."""
        return scene.lattice > 0

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """To the nearest multiple of p[0]."""
        return p[0] * np.round(y / p[0])
