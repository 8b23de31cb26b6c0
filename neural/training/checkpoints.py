"""The state of a training on disk, as safetensors: reading a stranger's file executes nothing."""

from __future__ import annotations

import contextlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn


@dataclass
class Checkpoint:
    """Weights, best weights, Adam's moments, random states and the lists of a history after an epoch; None: nowhere."""

    path: Path | None
    net: nn.Module
    adam: torch.optim.Adam
    best: dict[str, Tensor]
    order: torch.Generator
    history: dict[str, list[float]]

    def save(self) -> None:
        """Write the state; a reader sees the old file or the new one. A full disk does not end a training.

        The bytes go through a file that `remove` knows: safetensors' own is named at random, and a kill leaves it.
        """
        if self.path is None:
            return
        metadata = {"history": json.dumps(self.history), "rate": repr(self.adam.param_groups[0]["lr"])}
        partial = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            partial.write_bytes(save({name: value.contiguous() for name, value in self._tensors().items()}, metadata))
            partial.replace(self.path)
        except (OSError, SafetensorError):
            with contextlib.suppress(OSError):
                partial.unlink()

    def restore(self) -> bool:
        """Read the state if there is one, and return whether; a torn file, or another network's, is ignored."""
        if self.path is None or not self.path.is_file():
            return False
        for p in self.net.parameters():  # Adam makes its moments at its first step
            self.adam.state[p] = {"step": torch.zeros((), device=p.device), "exp_avg": torch.zeros_like(p),
                                  "exp_avg_sq": torch.zeros_like(p)}  # fmt: skip
        mine = self._tensors()
        try:
            with safe_open(self.path, "pt") as file:
                metadata = file.metadata()
                history, rate = json.loads(metadata["history"]), float(metadata["rate"])
                theirs = {name: file.get_tensor(name) for name in mine}
            if any(theirs[name].shape != value.shape for name, value in mine.items()):
                raise ValueError("of another network")
            lists = {name: list(map(float, history[name])) for name in self.history}
        except (SafetensorError, OSError, KeyError, TypeError, ValueError):
            self.adam.state.clear()
            return False
        for name, value in mine.items():
            if not name.startswith("random."):
                value.data.copy_(theirs[name])
        self.order.set_state(theirs["random.order"])
        torch.set_rng_state(theirs["random.dropout"])
        for name, values in lists.items():
            self.history[name][:] = values
        for group in self.adam.param_groups:
            group["lr"] = rate
        return True

    def _tensors(self) -> dict[str, Tensor]:
        named = dict(self.net.named_parameters())
        moments: dict[str, Any] = {
            f"adam.{name}.{kind}": value for name, p in named.items() for kind, value in self.adam.state[p].items()
        }
        return {
            **{f"net.{name}": p.data for name, p in named.items()},
            **{f"best.{name}": value for name, value in self.best.items()},
            **moments,
            "random.order": self.order.get_state(),
            "random.dropout": torch.get_rng_state(),
        }


def remove(path: Path) -> None:
    """Delete the checkpoint of a finished training, and what a killed one left half written."""
    with contextlib.suppress(OSError):
        for file in path.parent.glob(f"{path.name}*"):
            file.unlink(missing_ok=True)
