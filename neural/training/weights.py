"""A trained network as a saved model holds it, and back."""

from __future__ import annotations

from typing import Any

import torch


def state_of(model: Any) -> dict[str, Any]:
    """Give the hyper-parameters, the scaling, and the weights as arrays; a loaded network simulates on any machine."""
    weights = {name: value.detach().cpu().numpy() for name, value in model.trained.state_dict().items()}
    return model.hyper_parameters() | {
        "device": "cpu", "log": "", "dt": model.dt, "inputs": model.inputs, "of_x": model.of_x, "of_y": model.of_y,
        "fitted": model.fitted, "weights": weights,
    }  # fmt: skip


def build(kind: type, state: dict[str, Any]) -> Any:
    """Build the network of that class with those weights. Raises UnusableInput, ValueError, TypeError, RuntimeError."""
    trained = ("dt", "inputs", "of_x", "of_y", "fitted")
    model = kind(**{name: value for name, value in state.items() if name not in (*trained, "weights")})
    model.check()
    for name in trained:
        setattr(model, name, state[name])
    sizes = model.inputs, len(model.of_y.middle)
    with torch.device("meta"):  # its shapes, before memory is taken for it
        shapes = {name: tuple(value.shape) for name, value in model.net(*sizes).state_dict().items()}
    if shapes != {name: value.shape for name, value in state["weights"].items()}:
        raise ValueError("the weights are not those of such a network")
    model.trained = model.net(*sizes)
    model.trained.load_state_dict({name: torch.from_numpy(value) for name, value in state["weights"].items()})
    model.trained.eval()
    return model
