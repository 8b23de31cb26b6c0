"""Wiener: a linear filter, then a static nonlinearity."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from simgap.baselines.estimation.block_model import BlockModel
from simgap.baselines.estimation.block_search import Kind
from simgap.baselines.estimation.blocks import Blocks
from simgap.registry import MODELS


@MODELS.register("wiener")
@dataclass
class Wiener(BlockModel):
    """y(t) = f( B(q)/F(q) u(t) ) + e(t), by minimising the simulation error from a linear model on.

    f is a cubic spline of the filter's output, straight beyond its outermost knots (Schoukens and Tiels, Automatica 85,
    2017). max_order: of the linear model; a free run over the held-out records chooses it, and how far it grows.
    """

    kind: ClassVar[Kind] = "wiener"
    max_order: int = 6
    outputs: list[Blocks] = field(init=False, repr=False)
