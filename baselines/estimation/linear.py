"""What all linear models share: order given or selected, estimation, simulation, and what they say of themselves."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation import graph, stepping
from simgap.baselines.estimation.batches import stack
from simgap.baselines.estimation.equation_error import TooFewSamples
from simgap.baselines.estimation.fitted import LinearFit, Row
from simgap.baselines.estimation.orders import Orders, check_limits
from simgap.baselines.estimation.polynomial import Polynomial
from simgap.baselines.estimation.residuals import residual_analysis
from simgap.records import Channels, Experiment, TrainingSet, UnusableInput
from simgap.step_form import StepForm
from simgap.subspace.state_space import StateSpace

if TYPE_CHECKING:
    import control

Criterion = Literal["valid", "aic", "bic"]
# From orders, and a fit to begin the search at where there is one, to a fit.
Estimator = Callable[[Orders, LinearFit | None], LinearFit]


class IdentificationWarning(UserWarning):
    """The model was identified, but the reader should know something before trusting it."""


class LinearModel(ABC):
    """A model A(q) y = B(q) u + C(q) e, or B(q)/F(q), whose order is given or selected.

    A final class names its fields and says how one order is estimated. After `fit`, `result` holds the coefficients
    with their standard errors, and `polynomial` what simulates.
    """

    parts: ClassVar = (LinearFit, Orders, Polynomial, Row)  # records in a saved model
    # Whether the estimate makes one-step errors small, so that a free run of training data is as fair as any other.
    by_prediction: ClassVar[bool] = False

    result: LinearFit
    select: Criterion

    @abstractmethod
    def given_orders(self, ny: int, nu: int) -> Orders | None:
        """Give the orders that the user chose, or None where they are to be selected."""

    @abstractmethod
    def candidates(self, ny: int, nu: int) -> list[Orders]:
        """List the orders that a selection compares."""

    @abstractmethod
    def estimator(self, experiments: Sequence[Experiment], n_init: int, max_lag: int) -> Estimator:
        """Make a function from orders to a fit on these experiments, for orders up to max_lag."""

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Estimate on train and valid together; a selection by validation compares fits on train alone.

        A model of one-step errors stays as it was chosen where that simulates all data better. The estimate has no
        randomness, so the seed changes nothing.
        """
        check_limits(self)
        ny, nu = len(data.channels.outputs), len(data.channels.inputs)
        orders, start = self.given_orders(ny, nu), None
        if orders is None:
            orders, start = self._selected(data, self.candidates(ny, nu))
        everything = data.train + data.valid
        if orders.max_lag >= (longest := max(map(len, everything))):
            raise TooFewSamples(
                f"the model reaches {orders.max_lag} samples back, and the longest experiment has {longest}; "
                f"lower the order or record more"
            )
        self.result = self.estimator(everything, data.n_init, orders.max_lag)(orders, start)
        judged = [e for e in everything if len(e) > data.n_init]
        if self.by_prediction and start is not None and judged:
            # More data make one-step errors smaller, and may make a pole unstable that was not.
            self.result = simplest_of_the_best([self.result, start], judged, data.n_init)
        self._data = data
        for complaint in self.result.complaints():
            warnings.warn(complaint, IdentificationWarning, stacklevel=2)

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free from the state that the first n samples show."""
        return self.polynomial.simulate(u, y_init)

    def as_chosen(self) -> Polynomial:
        """Estimate the same orders on the training data alone."""
        data, orders = self._data, self.result.orders
        return self.estimator(data.train, data.n_init, orders.max_lag)(orders, self.result).polynomial

    @property
    def polynomial(self) -> Polynomial:
        """The identified difference equation."""
        return self.result.polynomial

    @property
    def n_params(self) -> int:
        """How many coefficients were estimated."""
        return self.result.n_params

    @property
    def fitted(self) -> dict[str, Any]:
        """The orders, as chosen or given."""
        return self.result.orders.as_dict()

    def to_control(self) -> control.StateSpace:
        """Convert to python-control, for deviations from its operating point; see `Polynomial.to_control`."""
        return self.polynomial.to_control()

    def step_form(self, nu: int, ny: int) -> StepForm:
        """Write the model as a step, for exports."""
        return stepping.step_form(self.polynomial)

    def step_start(self, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"]) -> Float[np.ndarray, " ns"]:
        """Return the state of that step before sample n."""
        return stepping.start(self.polynomial, u, y_init)

    def to_onnx(self, n: int) -> Any:
        """Convert to an ONNX graph that simulates as `simulate` does, from n measured samples."""
        return graph.build(self.polynomial, n)

    def summary(self) -> str:
        """Describe the coefficients with standard errors, the poles, and the residual analysis.

        A model that was loaded has no data left: its outputs are y0, y1, .. then, and there are no residuals.
        """
        poles = ", ".join(f"{pole:.4g}" for pole in sorted(self.polynomial.poles, key=abs, reverse=True)[:8])
        data: TrainingSet | None = getattr(self, "_data", None)
        ny, nu = self.polynomial.b.shape[1:]
        channels = data.channels if data else Channels.unnamed(nu, ny)
        outputs = [channel.name for channel in channels.outputs]
        lines = []
        if data:
            inputs = [channel.name for channel in channels.inputs]
            correlations = residual_analysis(self.result, data.train + data.valid, inputs)
            lines = [f"{name}: {one.text()}" for name, row in zip(outputs, correlations, strict=True) for one in row]
        return "\n".join((self.result.table(outputs), f"poles of the simulation: {poles}", *lines))

    def _selected(self, data: TrainingSet, candidates: list[Orders]) -> tuple[Orders, LinearFit]:
        """Choose a candidate; its fit is where the final estimation begins.

        So the model that is refined is the one that was chosen, and no other minimum of the same order.
        """
        train, valid = ([e for e in split if len(e) > data.n_init] for split in (data.train, data.valid))
        by_simulation = self.select == "valid" and bool(valid)
        experiments = data.train if by_simulation else data.train + data.valid
        fits = self._fits(experiments, data.n_init, candidates)
        if by_simulation:
            chosen = simplest_of_the_best(fits, train + valid if self.by_prediction else valid, data.n_init)
        else:
            samples = min(fit.samples for fit in fits)
            penalty = 2.0 if self.select == "aic" else float(np.log(samples))
            chosen = min(fits, key=lambda fit: fit.criterion(penalty, samples))
        return chosen.orders, chosen

    def _fits(self, experiments: Sequence[Experiment], n_init: int, candidates: list[Orders]) -> list[LinearFit]:
        longest = max(map(len, experiments))
        short_enough = [orders for orders in candidates if orders.max_lag < longest // 4]
        estimate = self.estimator(experiments, n_init, max((o.max_lag for o in short_enough), default=0))
        fits = []
        for orders in short_enough:
            try:
                fits.append(estimate(orders, None))
            except TooFewSamples:
                continue
        if not fits:
            raise UnusableInput(
                f"too few samples to select an order: the longest training experiment has {longest}; "
                f"record more, or give a low order"
            )
        return fits


def simplest_of_the_best(fits: list[LinearFit], judged: Sequence[Experiment], n_init: int) -> LinearFit:
    """Choose the fit with the fewest coefficients whose free run is no worse than the best by more than chance."""
    return fits[simplest([fit.polynomial for fit in fits], [fit.n_params for fit in fits], judged, n_init)]


def simplest(
    models: Sequence[Polynomial | StateSpace], sizes: Sequence[int], judged: Sequence[Experiment], n_init: int
) -> int:
    """Choose the smallest model whose free run is no worse than the best by more than chance, and give its place.

    Chance is one standard error over pieces of the data, of the difference or of the best one's error, whichever is
    less (Breiman, Friedman, Olshen and Stone 1984, section 3.4.3). A model that fails in a single piece has a standard
    error as large as its mean difference, whatever that is, and would pass by the first alone.
    """
    errors = np.array([free_run_errors(model, judged, n_init) for model in models])  # [F, K]
    best = int(np.argmin(errors.mean(axis=1)))
    if not np.isfinite(errors[best]).all():
        return int(np.argmin(sizes))
    if errors.shape[1] == 1:  # nothing tells what chance is
        return best
    with np.errstate(over="ignore", invalid="ignore"):  # a fit that diverged has huge or infinite errors
        worse = errors - errors[best]
        chance = np.minimum(worse.std(axis=1, ddof=1), errors[best].std(ddof=1)) / np.sqrt(errors.shape[1])
        as_good = worse.mean(axis=1) <= np.nan_to_num(chance)
    return int(np.argmin(np.where(as_good, sizes, np.inf)))


def free_run_errors(
    model: Polynomial | StateSpace, experiments: Sequence[Experiment], n_init: int, pieces: int = 10
) -> Float[np.ndarray, " K"]:
    """Average mse / variance over the outputs, in `pieces` pieces or more of all experiments; inf if it diverges."""
    spread = np.concatenate([e.y[n_init:] for e in experiments]).var(axis=0)
    spread[spread == 0] = 1.0
    each = -(-pieces // len(experiments))
    errors = []
    with np.errstate(over="ignore", invalid="ignore"):
        for u, y in stack(experiments):
            squares = (model.simulate(u, y[:, :n_init]) - y[:, n_init:]) ** 2 / spread  # [B, T-n, ny]
            for piece in np.array_split(squares.mean(axis=2), min(each, squares.shape[1]), axis=1):
                errors.extend(piece.mean(axis=1))
    return np.where(np.isfinite(errors), errors, np.inf)


def check_together(model: str, **orders: Any) -> None:
    """Raise UnusableInput when some of these orders were given and others not."""
    given = [name for name, value in orders.items() if value is not None]
    if given and len(given) < len(orders):
        raise UnusableInput(f"{model}: {', '.join(orders)} belong together; only {', '.join(given)} given")
