"""Subspace identification of a state-space model, refined by simulation error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import excerpt
from simgap.baselines.estimation.equation_error import check_length
from simgap.baselines.estimation.levenberg import minimise
from simgap.baselines.estimation.linear import simplest
from simgap.baselines.estimation.orders import check_limits
from simgap.baselines.estimation.state_space_error import StateSpaceError
from simgap.cores import one_thread
from simgap.records import Experiment, TrainingSet
from simgap.registry import MODELS
from simgap.subspace.projections import state_spaces, with_spread
from simgap.subspace.state_space import StateSpace

if TYPE_CHECKING:
    import control

EXCERPT = 32768  # samples of the projections
COARSE_EXCERPT = 8192  # samples to refine every order on
COARSE, FINAL = 30, 60  # steps of the refinement
EVERY = 8  # order; beyond, machines swing in many modes of two states each


@MODELS.register("n4sid")
@dataclass
class N4sid:
    """x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t) + e(t), by subspace projections, then by simulation error.

    Every order up to 8, and every second one up to max_order, is estimated with the weightings of N4SID, MOESP and CVA
    (Van Overschee and De Moor, Automatica 30, 1994, and 31, 1995) from `horizon` past and future samples; the best of
    each order is refined by Levenberg-Marquardt over the elements of the matrices, A being block diagonal (after
    McKelvey, Helmersson and Ribarits 2004), and the free run over held-out records chooses the order. With order given,
    nothing is chosen but the weighting.
    """

    parts: ClassVar = (StateSpace,)  # records in a saved model

    order: int | None = None
    max_order: int = 24
    horizon: int = 40
    model: StateSpace = field(init=False, repr=False)

    @one_thread()
    def fit(self, data: TrainingSet, seed: int) -> None:
        """Choose the order on train and valid, then estimate on both together; nothing here is random."""
        check_limits(self)
        upper = range(EVERY + 2, self.max_order + 1, 2)
        orders = [self.order] if self.order else [*range(1, min(self.max_order, EVERY) + 1), *upper]
        held_out = data.held_out
        if not held_out:
            check_length(0, 1, data.n_init)
        records = excerpt(data.train, EXCERPT)
        channels = len(data.channels.inputs) + len(data.channels.outputs)
        longest = max(map(len, records))
        horizon = min(self.horizon, max(longest // (4 * channels), 2))
        check_length(sum(max(len(x) - 2 * horizon, 0) for x in records), 2 * horizon * channels, 2 * horizon)
        size = np.concatenate([x.y for x in data.train]).std(axis=0)
        size[size == 0] = 1.0

        def refined(model: StateSpace, experiments: Sequence[Experiment], steps: int) -> StateSpace:
            equation = StateSpaceError.of(model, experiments, data.n_init, size)
            if not equation.records:
                return model
            return with_spread(equation.at(minimise(equation, equation.theta, steps).theta), experiments, data.n_init)

        def error(model: StateSpace) -> float:
            equation = StateSpaceError.of(model, held_out, data.n_init, size)
            return float(np.sqrt(equation.squares(equation.theta) / max(equation.samples, 1)))

        best: dict[int, tuple[float, StateSpace]] = {}
        for model in state_spaces(records, orders, horizon):
            tried = error(model), model
            if model.order not in best or tried[0] < best[model.order][0]:
                best[model.order] = tried
        few = excerpt(data.train, COARSE_EXCERPT)
        for order, (before, model) in best.items():
            after = refined(model, few, COARSE)
            if (now := error(after)) < before:
                best[order] = now, after
        models = [model for _, model in best.values()]
        chosen = simplest(models, [model.order for model in models], held_out, data.n_init)
        self._chosen = models[chosen]
        self.model = refined(self._chosen, [*data.train, *data.valid], FINAL)

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free from the state that the first n samples show."""
        return self.model.simulate(u, y_init)

    def as_chosen(self) -> StateSpace:
        """Return the model before its last refinement, which is on all data."""
        return self._chosen

    @property
    def n_params(self) -> int:
        """How many numbers are left when the coordinates of the states are fixed, with a constant per output."""
        (ny, nu), n = self.model.d.shape, self.model.order
        return n * (nu + ny) + ny * nu + ny

    @property
    def fitted(self) -> dict[str, Any]:
        """The order."""
        return {"order": self.model.order}

    def to_control(self) -> control.StateSpace:
        """Convert to python-control, for deviations from the operating point."""
        return self.model.to_control()
