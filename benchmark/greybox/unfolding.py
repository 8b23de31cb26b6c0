"""Readings without a sign: each is given the sign of what a model simulates there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter

from simgap.greybox.fitting import Estimate
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import fit_plain
from simgap.greybox.samples import Records

ROUNDS = 10
LAGS = 3  # time constants, from those of a sample to those of a record, behind which the inputs give the first signs


def unfolded(plant: Plant, records: Records) -> Estimate:
    """Fit a plain plant of one output to y(k) = sign(y_hat(k)) |y(k)|, again until no sign changes.

    It begins with the signs of the inputs behind a lag, and with models of lower order (after Gerchberg and Saxton
    1972, who find the phases of a wave from its intensity).
    """
    first, *larger = _rungs(plant)
    begun = [_settled(first, records, signs, None) for signs in _of_inputs(records)]
    fit, signs = min(begun, key=lambda settled: float(np.sum(settled[0].errors ** 2)))
    for rung in larger:
        fit, signs = _settled(rung, records, signs, fit)
    return fit


def _settled(
    plant: Plant, records: Records, signs: Float[np.ndarray, "E T 1"], smaller: Estimate | None
) -> tuple[Estimate, Float[np.ndarray, "E T 1"]]:
    """Fit to the readings with these signs, then with those of the fit, until they stay."""

    def fit_to(y: np.ndarray) -> Estimate:
        return fit_plain(plant, replace(records, y=y), smaller if plant.order > 2 else None)

    readings = np.abs(records.y)
    fit = fit_to(signs * readings)
    for _ in range(ROUNDS):
        before, signs = signs, np.where(signs * readings - fit.errors < 0, -1.0, 1.0)
        if (signs == before).all():
            break
        fit = fit_to(signs * readings)
    return fit, signs


def _of_inputs(records: Records) -> Iterator[Float[np.ndarray, "E T 1"]]:
    """Yield the signs of the inputs, in units of their sizes, behind lags of several time constants."""
    u = np.sum(records.u / records.input_sizes, axis=2, keepdims=True)
    for samples in np.geomspace(5.0, max(5.0, records.mask.shape[1] / 3), LAGS):
        kept = np.exp(-1 / samples)
        yield np.where(np.asarray(lfilter([1 - kept], [1.0, -kept], u, axis=1)) < 0, -1.0, 1.0)


def _rungs(plant: Plant) -> Iterator[Plant]:
    """Yield plants of rising order, the given one at last; where its kind gives the order, that one alone."""
    for order in range(1, plant.order if plant.kind in ("velocity", "other") else 1):
        yield Plant(plant.kind, order, plant.nu, plant.dt, zeros=order - 1 if plant.zeros else 0, offset=True)
    yield plant
