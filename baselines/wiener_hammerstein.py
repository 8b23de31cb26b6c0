"""Wiener-Hammerstein: a static nonlinearity between two linear filters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from simgap.baselines.estimation.block_model import BlockModel
from simgap.baselines.estimation.block_search import Kind
from simgap.baselines.estimation.blocks import Blocks
from simgap.registry import MODELS


@MODELS.register("wiener-hammerstein")
@dataclass
class WienerHammerstein(BlockModel):
    """y(t) = B2(q)/F2(q) f( B1(q)/F1(q) u(t) ) + e(t), by minimising the simulation error.

    Poles and zeros of a linear model are shared out over the two filters in every way (Sjoberg and Schoukens 2012),
    the best are refined by Levenberg-Marquardt, f a cubic spline (Schoukens and Tiels, Automatica 85, 2017). Filters
    grow, and knots are added, as long as the free run over the held-out records asks for it. max_order: of the linear
    model.
    """

    kind: ClassVar[Kind] = "wiener-hammerstein"
    max_order: int = 6
    outputs: list[Blocks] = field(init=False, repr=False)
