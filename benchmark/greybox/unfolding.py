"""Readings without a sign: each is given the sign of what a model simulates there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from simgap.greybox.fitting import Estimate
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import fit_plain
from simgap.greybox.samples import Records

ROUNDS = 10


def unfolded(plant: Plant, records: Records) -> Estimate:
    """Fit a plain plant of one output to y(k) = sign(y_hat(k)) |y(k)|, again until no sign changes.

    It begins with the signs of the inputs, and with models of lower order (after Gerchberg and Saxton 1972, who find
    the phases of a wave from its intensity).
    """
    signs = np.where(np.sum(records.u / records.input_sizes, axis=2) < 0, -1.0, 1.0)[:, :, None]
    smaller = None
    for rung in _rungs(plant):
        fit, before = None, np.zeros_like(signs)
        for _ in range(ROUNDS):
            fit = fit_plain(rung, replace(records, y=signs * np.abs(records.y)), smaller)
            before, signs = signs, np.where(signs * np.abs(records.y) - fit.errors < 0, -1.0, 1.0)
            if (signs == before).all():
                break
        assert fit is not None
        smaller = fit if rung.order > 1 else None
    return fit


def _rungs(plant: Plant) -> Iterator[Plant]:
    """Yield plants of rising order, the given one at last; where its kind gives the order, that one alone."""
    for order in range(1, plant.order if plant.kind == "other" else 1):
        yield Plant(plant.kind, order, plant.nu, plant.dt, offset=True)
    yield plant
