"""A test for odd and even distortions: what the best linear model leaves, regressed on functions of either symmetry."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import lfilter
from scipy.stats import binomtest

from simgap.records import Dataset, Experiment
from simgap.registry import ADAPTERS, MODELS

MEMORIES = (0.0, 3.0, 10.0)  # samples, of the filters behind each function
RIDGES = (1e-4, 1e-2)  # of columns at length 1
CHANCE = 0.02  # that as many records would gain if it were a coin for each
SECOND = 0.5  # of the median gain of the stronger symmetry, from which the other is named too

# Laws f(-w) = -f(w), and f(-w) = f(w), about the middle of the records, the commonest first.
ODD = ["coulomb_friction", "dead_zone", "input_saturation", "backlash", "cubic_stiffness", "quadratic_drag",
       "stribeck_friction", "load_friction", "hysteresis", "hard_stop", "gravity", "position_torque", "valve_stiction",
       "sensor_saturation", "quantisation", "torque_foldback", "rate_limit"]  # fmt: skip
EVEN = ["asymmetric_gain", "curved_input", "quadratic_stiffness", "curved_sensor", "absolute_sensor",
        "inner_saturation", "rate_limit"]  # fmt: skip
# About an operating point every law has a part of either symmetry.
ONE_SIDED = ["sqrt_outflow", "overflow", "input_saturation", "dead_zone", "backlash", "valve_stiction", "curved_input",
             "curved_sensor", "sensor_saturation", "inner_saturation", "rate_limit", "quantisation"]  # fmt: skip


@ADAPTERS.register("odd_even")
def answer(dataset: Dataset) -> dict[str, list[list[str]]]:
    """Say whether the distortion is odd or even, as the set of effects that are (Pintelon and Schoukens 2012, ch. 4).

    Their test reads it from the even lines of a spectrum under an odd multisine. Records with any input have no such
    lines: here odd and even functions are asked which of them predict the errors of the best linear model on held-out
    records.
    """
    model: Any = MODELS["oe"]()
    model.fit(dataset.training, 0)
    n = dataset.n_init
    records = [x for x in (*dataset.training.train, *dataset.training.valid) if len(x) > n]
    simulated = [model.simulate(x.u[None], x.y[None, :n])[0, :, 0] for x in records]
    errors = [x.y[n:, 0] - y for x, y in zip(records, simulated, strict=True)]
    linear, odd, even = zip(*(_functions(x, y, n) for x, y in zip(records, simulated, strict=True)), strict=True)
    plain = _left(linear, errors)
    gains = {}
    for name, functions in (("odd", odd), ("even", even)):
        gain = plain - _left([np.hstack(pair) for pair in zip(linear, functions, strict=True)], errors)
        if binomtest(int((gain > 0).sum()), len(gain), alternative="greater").pvalue < CHANCE:
            gains[name] = float(np.median(gain))
    if dataset.channels.outputs[0].kind in ("level", "other"):
        return {"names": [ONE_SIDED] if gains else []}
    sets = {"odd": ODD, "even": EVEN}
    ordered = sorted(gains, key=lambda name: -gains[name])
    return {"names": [sets[name] for name in ordered if gains[name] > SECOND * gains[ordered[0]]]}


def _functions(x: Experiment, simulated: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linear, odd and even functions of the simulation, its rate and the inputs, with and without a memory [T, m]."""
    signals = [simulated, np.gradient(simulated), *x.u[n:].T, *(lfilter([0.2], [1, -0.8], u)[n:] for u in x.u.T)]
    w = [(s - s.mean()) / (s.std() or 1.0) for s in signals]
    odd = [f(s) for s in w for f in (lambda s: s * np.abs(s), lambda s: s**3, lambda s: np.tanh(5 * s))]
    even = [a * b for i, a in enumerate(w) for b in w[: i + 1]] + [np.abs(s) for s in w]
    linear, odd, even = (
        np.stack([_remembered(s, tau) for s in found for tau in MEMORIES], axis=1) for found in (w, odd, even)
    )
    return np.hstack((linear, np.ones((len(linear), 1)))), odd, even


def _remembered(signal: np.ndarray, tau: float) -> np.ndarray:
    keep = np.exp(-1 / tau) if tau else 0.0
    return np.asarray(lfilter([1 - keep], [1, -keep], signal))


def _left(functions: list[np.ndarray] | tuple[np.ndarray, ...], errors: list[np.ndarray]) -> np.ndarray:
    """The squared error of a ridge regression on each record, fitted to the others, with the better ridge [records]."""
    products = [f.T @ f for f in functions]
    right = [f.T @ e for f, e in zip(functions, errors, strict=True)]
    size = np.sqrt(np.diag(sum(products))) + 1e-12
    tried = []
    for ridge in RIDGES:
        left = []
        for f, e, p, r in zip(functions, errors, products, right, strict=True):
            a = (sum(products) - p) / np.outer(size, size)
            theta = np.linalg.solve(a + ridge * np.eye(len(a)), (sum(right) - r) / size)
            left.append(float(np.sum((e - f @ (theta / size)) ** 2)))
        tried.append(np.array(left))
    return min(tried, key=lambda left: float(left.sum()))
