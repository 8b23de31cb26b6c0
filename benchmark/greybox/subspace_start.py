"""Where the fit of a linear plant of many poles begins: at models from projections of its records."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from simgap.greybox.plant import Plant
from simgap.greybox.samples import Records
from simgap.records import Experiment
from simgap.subspace.projections import state_spaces
from simgap.subspace.state_space import StateSpace

HORIZON = 20  # samples
# A pole at or left of zero stands for a motion that is over within a sample.
OVER = 1e-3


def linear_models(records: Records, orders: Sequence[int]) -> list[StateSpace]:
    """Estimate linear models of these orders by each weighting; none where the records are too short for any."""
    outputs, inputs = records.y.shape[2], records.u.shape[2]
    longest = int(records.mask.sum(axis=1).max())
    horizon = min(HORIZON, longest // (4 * (inputs + outputs)))
    experiments = [x for x in _without_gaps(records) if len(x) > 2 * horizon]
    if horizon <= min(orders) or sum(len(x) - 2 * horizon for x in experiments) < 2 * horizon * (inputs + outputs):
        return []
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of matrices that have no inverse: such a model is left out below
        try:
            return list(state_spaces(experiments, orders, horizon))
        except np.linalg.LinAlgError:
            return []


def starts(plant: Plant, models: Sequence[StateSpace]) -> list[Float[np.ndarray, " p"]]:
    """Write the models of the plant's order as its theta, where it is one of a single input and no level."""
    if plant.nu != 1 or plant.cascade or plant.zeros != plant.order - 1:
        return []
    with np.errstate(all="ignore"):
        known = (model for model in models if model.order == plant.order and np.isfinite(model.a).all())
        begun = [_theta_of(plant, model) for model in known if np.isfinite(model.b).all()]
    return [theta for theta in begun if np.isfinite(theta).all()]


def _without_gaps(records: Records) -> list[Experiment]:
    """Give the experiments, with a straight line through readings that are left out."""
    experiments = []
    for u, y, measured in zip(records.u, records.y, records.mask, strict=True):
        places = np.flatnonzero(measured)
        if not len(places):
            continue
        end = places[-1] + 1
        filled = np.stack([np.interp(np.arange(end), places, signal[places]) for signal in y.T], axis=1)
        experiments.append(Experiment("", u[:end], filled, records.dt))
    return experiments


def _theta_of(plant: Plant, model: StateSpace) -> Float[np.ndarray, " p"]:
    """Convert a model in samples, whose input is held between them, to sections and zeros in continuous time.

        G(s) = sum of r_i / (s - s_i),   s_i = log(z_i) / dt,   r_i = (C V)_i (V^-1 B)_i s_i / (z_i - 1)

    What acts at once, D, is left out.
    """
    values, vectors = np.linalg.eig(model.a)
    values = np.where((np.imag(values) == 0) & (np.real(values) < OVER), OVER, values) + 0j
    poles = np.log(values) / plant.dt
    residues = (model.c @ vectors)[0] * np.linalg.lstsq(vectors, model.b + 0j)[0][:, 0] * poles / (values - 1)
    numerator = np.sum([r * np.poly(np.delete(poles, i)) for i, r in enumerate(residues)], axis=0)
    ascending = np.real(numerator)[::-1]
    turn = np.imag(poles)
    real = np.sort(np.real(poles[turn == 0]))
    sections = [[-2 * np.real(p), abs(p) ** 2] for p in poles[turn > 0]]
    sections += [[-a - b, a * b] for a, b in zip(real[:-1:2], real[1::2], strict=False)]
    theta = np.zeros(plant.size)
    theta[plant.layout.poles] = [*np.ravel(sections), *(-real[len(real) - len(real) % 2 :])]
    theta[plant.layout.gains][:1] = ascending[0]
    theta[plant.layout.zeros] = ascending[1:] / ascending[0]
    theta[plant.layout.velocity] = 1.0
    return theta
