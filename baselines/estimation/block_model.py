"""What the block models share: a linear model of each output first, then filters and curves."""

from __future__ import annotations

import copy
from abc import ABC
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import excerpt
from simgap.baselines.estimation.block_search import EXCERPT, FREE, WORTH, Kind, Search, starts
from simgap.baselines.estimation.blocks import Blocks
from simgap.baselines.estimation.equation_error import TooFewSamples, check_length
from simgap.baselines.estimation.gram import rough_means
from simgap.baselines.estimation.oe_search import oe_starts
from simgap.baselines.estimation.orders import Orders, check_limits
from simgap.baselines.estimation.output_error import OutputError
from simgap.records import Experiment, TrainingSet


class BlockModel(ABC):
    """A model of filters and curves whose structure is chosen by free runs over the held-out records.

    A final class names its kind. `outputs` holds the fitted blocks of each output.
    """

    parts: ClassVar = (Blocks,)  # records in a saved model
    kind: ClassVar[Kind]

    max_order: int
    outputs: list[Blocks]

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Choose the structure on train and valid, then estimate on both together; nothing here is random."""
        check_limits(self)
        outputs = range(len(data.channels.outputs))
        searches = [Search(self.kind, data, i) for i in outputs]
        chosen = [self._structure(data, search) for search in searches]
        self.outputs = [search.on_everything(one) for search, one in zip(searches, chosen, strict=True)]
        self._chosen = copy.copy(self)
        self._chosen.outputs = chosen

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free from the state that the first n samples show."""
        return np.stack([one.simulate(u, y_init[:, :, i]) for i, one in enumerate(self.outputs)], axis=2)

    def as_chosen(self) -> BlockModel:
        """Return the model before its last refinement, which is on all data."""
        return self._chosen

    @property
    def n_params(self) -> int:
        """How many numbers were estimated."""
        return sum(getattr(one, name).size - (name in ("f1", "f2")) for one in self.outputs for name in FREE[self.kind])

    @property
    def fitted(self) -> dict[str, Any]:
        """The orders of the filters, and the coefficients of each curve."""
        chosen: dict[str, Any] = {}
        for name in FREE[self.kind]:
            sizes = [getattr(one, name).shape[-1] - (name in ("f1", "f2")) for one in self.outputs]
            chosen["curve" if name == "c" else f"n{name}"] = sizes[0] if len(sizes) == 1 else sizes
        return chosen

    def _structure(self, data: TrainingSet, search: Search) -> Blocks:
        records, output = excerpt(data.train, EXCERPT), search.output
        shift = rough_means(data.train, True)
        ny = len(data.channels.outputs)
        first: Kind = "hammerstein" if self.kind == "hammerstein" else "wiener"
        mean = shift[ny:], float(shift[output])
        found = [
            (search.error(starts(first, records, output, *linear, *mean)[0]), linear)
            for order in range(1, self.max_order + 1)
            for linear in _linear(records, shift, order, output, ny, data.n_init)
        ]
        if not found:
            check_length(0, 2, data.n_init)
        least = min(error for error, _ in found)
        linear = next(linear for error, linear in found if error <= (1 + WORTH) * least)
        chosen = starts(self.kind, records, output, *linear, *mean)
        return search.best(chosen)


def _linear(
    experiments: Sequence[Experiment], shift: np.ndarray, order: int, output: int, ny: int, n_init: int
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Find F and B [nu, L] of an output, with and without a delay, by Steiglitz-McBride; none from too few samples."""
    nu = len(shift) - ny
    models = []
    for nk in (1, 0):
        orders = Orders.of(ny, nu, nb=order + (nk == 0), nk=nk, nf=order)
        try:
            equation = OutputError.of(experiments, shift, orders, output, False, n_init)
            check_length(equation.samples, equation.n_params, n_init)
            thetas = list(oe_starts(experiments, shift, orders, output, equation))
        except TooFewSamples:
            continue
        f, numerators = equation.transfer(min(thetas, key=equation.squares))
        b = np.zeros((nu, max(map(len, numerators.values()))))
        for j, numerator in numerators.items():
            b[j, : len(numerator)] = numerator
        models.append((f, b))
    return models
