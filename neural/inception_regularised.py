"""Model 6 of the paper: three kinds of layers side by side, with dropout and L2."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.inception import Inception
from simgap.registry import MODELS


@MODELS.register("inception_regularised")
@dataclass
class InceptionRegularised(Inception):
    """`inception` with 20 % dropout behind the branches and L2 0.02 on their weights; model 6 of the paper (4.2).

    No dropout behind the fully connected layers, which repair what it damages (4.2).
    """

    dropout: float = 0.2
    l2: float = 0.02
