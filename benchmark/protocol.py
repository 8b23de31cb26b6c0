"""What a model is. A class with these two methods is a model; it need not import simgap."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from simgap.records import TrainingSet


@runtime_checkable
class Model(Protocol):
    """A model of a machine, fitted to measured data and simulated without them.

    Hyper-parameters are the fields of a dataclass; `fit` starts from nothing each time it is called.
    Seven attributes are optional after `fit`: `n_params`, how many numbers were estimated; `fitted`, a dict of
    what the fit chose (an order, say) that goes into the results; `summary()`, a text for people; `stochastic`, True
    where another seed gives other numbers, as with a network trained from random weights (default False). It goes
    into the results, and `simgap check` then grants the spread of the seeds instead of a rounding error. `as_chosen()`,
    of a model that estimates on the validation data too: the model before it did, whose error on them is an honest one.
    `held_out_error`, where a few numbers of that model are theirs all the same: its cross-validated error on them.
    `earlier_seconds`, where a fit carried on from an interrupted one: the seconds of that, which count in the results.
    A class whose `takes_known` is True makes use of what is known of the machine, `data.channels.plant`.
    A fitted model is saved attribute by attribute; `simgap.saved` says what it may declare for that.
    """

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Estimate the model from `data.train` and `data.valid`; all randomness comes from `seed`."""
        ...

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Simulate B experiments from all T inputs and the first n measured outputs, oldest first.

        Returns the outputs of rows n .. T-1, in physical units. A free run is one long experiment, an h-step
        forecast is many short ones.
        """
        ...


def as_chosen(model: Any) -> Any:
    """Return the model as validation data chose it, estimated on training data alone; None where it cannot say."""
    method = getattr(model, "as_chosen", None)
    return method() if callable(method) else model


def is_stochastic(model: Any) -> bool:
    """Whether a model, or its class, declares that its numbers depend on the seed."""
    return getattr(model, "stochastic", False) is True


def earlier_seconds(model: Any) -> float:
    """Seconds of an interrupted fit that the last one carried on; 0 for a model that says nothing of them."""
    return float(getattr(model, "earlier_seconds", 0.0))


_listener: Callable[[int, int], None] | None = None


def progress(done: int, total: int) -> None:
    """A model whose fit takes long may say how far it is, in steps of its own such as epochs."""
    if _listener is not None:
        _listener(done, total)


def listen(listener: Callable[[int, int], None] | None) -> None:
    """Have `listener(done, total)` called when a model of this process says how far it is; None: nobody."""
    global _listener  # noqa: PLW0603  # one fit at a time runs in a process
    _listener = listener
