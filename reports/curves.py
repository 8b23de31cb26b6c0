"""The curve of a learning-rate range test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

# The loss of single batches is noisy; its median over so many is looked at.
SMOOTH = 15


@dataclass(frozen=True, eq=False)
class LearningRates:
    """Losses of single batches while the learning rate grew (Smith 2017; the paper's section 3.4 and figure 5)."""

    model: str
    dataset: str
    rates: Float[np.ndarray, " n"]
    losses: Float[np.ndarray, " n"]

    @property
    def smooth(self) -> Float[np.ndarray, " n"]:
        """Running median of the losses."""
        padded = np.pad(self.losses, SMOOTH // 2, mode="edge")
        return np.median(np.lib.stride_tricks.sliding_window_view(padded, SMOOTH), axis=1)[: len(self.losses)]

    @property
    def steepest(self) -> float:
        """The rate at which the loss falls fastest, over the logarithm of the rate."""
        slope = np.gradient(self.smooth, np.log(self.rates))
        return float(self.rates[np.argmin(slope)])

    @property
    def lowest(self) -> float:
        """The rate at which the loss is lowest."""
        return float(self.rates[np.argmin(self.smooth)])

    def __str__(self) -> str:
        return (
            f"{self.model} on {self.dataset}: the loss falls fastest at a learning rate of {self.steepest:.1e} and is "
            f"lowest at {self.lowest:.1e}; {len(self.rates)} batches up to {self.rates[-1]:.1e}."
        )

    def to_json(self) -> dict[str, Any]:
        """Write rates, losses and what is read from them."""
        return {
            "model": self.model, "dataset": self.dataset, "rates": self.rates.tolist(), "losses": self.losses.tolist(),
            "steepest": self.steepest, "lowest": self.lowest,
        }  # fmt: skip

    def to_html(self) -> str:
        """Draw the curve as a page."""
        import plotly.graph_objects as go

        figure = go.Figure()
        figure.add_scatter(x=self.rates, y=self.losses, name="batches", mode="markers", marker={"size": 4})
        figure.add_scatter(x=self.rates, y=self.smooth, name=f"median of {SMOOTH}", mode="lines")
        figure.add_vline(x=self.steepest, line_dash="dot", annotation_text="falls fastest")
        figure.update_xaxes(title="learning rate", type="log", exponentformat="power")
        figure.update_yaxes(title="loss of a batch, scaled data", type="log")
        figure.update_layout(title="Learning-rate range test", template="plotly_white")
        return str(figure.to_html(include_plotlyjs=True))
