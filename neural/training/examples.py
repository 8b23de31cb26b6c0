"""What a network is trained on."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Sequence

from jaxtyping import Int
from torch import Tensor

from simgap.neural.training.blocks import Block
from simgap.records import Experiment


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


def long_enough(experiments: Sequence[Experiment], length: int) -> list[Experiment]:
    """Choose the experiments with at least so many samples, and warn if some have fewer."""
    chosen = [x for x in experiments if len(x) >= length]
    if 0 < len(chosen) < len(experiments):
        short = len(experiments) - len(chosen)
        warnings.warn(
            f"{short} of {len(experiments)} experiments have fewer than {length} samples, as many as the network "
            "sees at once, and were left out",
            stacklevel=2,
        )
    return chosen
