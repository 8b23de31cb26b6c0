"""Hammerstein: a static nonlinearity of each input, then linear filters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from simgap.baselines.estimation.block_model import BlockModel
from simgap.baselines.estimation.block_search import Kind
from simgap.baselines.estimation.blocks import Blocks
from simgap.registry import MODELS


@MODELS.register("hammerstein")
@dataclass
class Hammerstein(BlockModel):
    """y(t) = sum_j B_j(q)/F(q) f_j(u_j(t)) + e(t), by minimising the simulation error from a linear model on.

    f_j is a cubic spline of input j, straight beyond its outermost knots (Schoukens and Tiels, Automatica 85, 2017).
    max_order: of the linear model; a free run over the held-out records chooses it, and how far it grows.
    """

    kind: ClassVar[Kind] = "hammerstein"
    max_order: int = 6
    outputs: list[Blocks] = field(init=False, repr=False)
