"""What a network is trained on."""

from __future__ import annotations

from abc import ABC, abstractmethod

from jaxtyping import Int
from torch import Tensor

from simgap.neural.training.blocks import Block


class Examples(ABC):
    """Numbered pieces of experiments, scaled, as features and targets."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def batch(self, chosen: Int[Tensor, " B"]) -> tuple[Tensor, Tensor]:
        """Give features and targets of the chosen examples."""

    @abstractmethod
    def answer(self, net: Block, x: Tensor) -> Tensor:
        """Compute the network's outputs for the features."""
