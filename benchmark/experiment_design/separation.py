"""How far a record would set two fitted models apart, whatever the wrong one is fitted to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from simgap.experiment_design.rivals import Question, Rival
from simgap.greybox.fitting import descend
from simgap.greybox.normal_equations import scales_of
from simgap.greybox.past import Past
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records
from simgap.greybox.simulation import Simulator

CHUNK = 30_000  # samples that are differentiated at once
HUGE = 1e12  # the separation from a simulation that is no number
STEPS = 15


def simulate(rival: Rival, u: Float[np.ndarray, "E T nu"]) -> Float[np.ndarray, "E T ny"]:
    """Simulate a model from its usual initial state."""
    return Simulator(rival.forecast.plant, u).run(rival.forecast.theta, rival.starts(len(u)))


def simulate_likely(rival: Rival, u: Float[np.ndarray, "E T nu"], draws: int) -> Float[np.ndarray, "S E T ny"]:
    """Simulate a model, and as many draws of its numbers, from its usual initial state."""
    thetas = rival.likely(draws)
    return Simulator(rival.forecast.plant, u).run_many(
        thetas, np.repeat(rival.starts(len(u))[None], len(thetas), axis=0)
    )


def separations(question: Question, u: Float[np.ndarray, "E T nu"]) -> Float[np.ndarray, "P 2 E"]:
    """Compute how far each record sets each pair apart, if the first is true and if the second is.

        D = min over d of |W (y_true - y_other - J d)|^2 + d' H d

    J are the slopes of the other model, its initial state among them, W the noise's whitening filter, and H the
    information that the records at hand hold about its numbers: D / 2 is what the log-likelihood of both models will
    differ by more than now (T-optimality: Atkinson and Fedorov, Biometrika 62, 1975, eq. 2.2; its minimum linearised).
    """
    return np.concatenate([_of_chunk(question, chunk) for chunk in chunks(u)], axis=2)


def chunks(u: Float[np.ndarray, "E T nu"]) -> Iterator[Float[np.ndarray, "e T nu"]]:
    """Part many records into as many at a time as memory holds with all that is simulated of them."""
    size = max(1, CHUNK // u.shape[1])
    for first in range(0, len(u), size):
        yield np.ascontiguousarray(u[first : first + size])


def _of_chunk(question: Question, u: np.ndarray) -> np.ndarray:
    simulated = {i: simulate(question.rivals[i], u) for pair in question.pairs for i in pair}
    rows = []
    for pair in question.pairs:
        rows.append([_left(question, true, other, simulated, u) for true, other in (pair, pair[::-1])])
    return np.array(rows)


def _left(
    question: Question, true: int, other: int, simulated: dict[int, np.ndarray], u: np.ndarray
) -> Float[np.ndarray, " E"]:
    """Compute what a step of the other model leaves of the difference in each record."""
    rival, y = question.rivals[other], simulated[true]
    finite: np.ndarray = np.all(np.isfinite(y) & np.isfinite(simulated[other]), axis=(1, 2))
    plant, theta = rival.forecast.plant, rival.forecast.theta
    problem = Problem(plant, Records.measured(u, np.where(finite[:, None, None], y, 0.0), plant.dt), question.noise)
    jacobian = problem.jacobian(theta, rival.starts(len(u)), plant.free & ~rival.held[rival.places])
    e = np.where(finite[:, None, None], y - simulated[other], 0.0)
    e = question.noise.whiten(e).reshape(len(u), -1)  # [E, M]
    slopes = jacobian.slopes.swapaxes(0, 1)  # [E, p + q, M]
    finite = finite & np.all(np.isfinite(slopes), axis=(1, 2))
    slopes = np.where(finite[:, None, None], slopes, 0.0)
    known = np.zeros((slopes.shape[1],) * 2)
    known[: len(theta), : len(theta)] = rival.information[np.ix_(rival.places, rival.places)]
    h = slopes @ slopes.swapaxes(1, 2) + known
    gradient = (slopes @ e[:, :, None])[:, :, 0]
    scale = scales_of(np.diagonal(h, axis1=1, axis2=2))
    inverse = np.linalg.pinv(h / scale[:, :, None] / scale[:, None, :], rcond=1e-11, hermitian=True)
    gradient = gradient / scale
    taken = np.einsum("ei,eij,ej->e", gradient, inverse, gradient)
    return np.where(finite, np.maximum(np.einsum("em,em->e", e, e) - taken, 0.0), HUGE)


def refitted(question: Question, true: int, other: int, u: Float[np.ndarray, "T nu"]) -> tuple[float, np.ndarray]:
    """Compute the same by a fit: D, and the difference [T, ny] that is left in the record.

    The other model is fitted to the records at hand and to what the true one would show in the new record, together.
    """
    rival, records = question.rivals[other], question.records
    y = simulate(question.rivals[true], u[None])[0]
    if not np.isfinite(y).all():
        return HUGE, np.zeros_like(y)
    plant, theta = rival.estimate.plant, rival.estimate.theta
    new = np.zeros((1, plant.n_local))
    new[:, : plant.n_start] = rival.starts(1)[:, : plant.n_start]
    local = np.concatenate((rival.estimate.local, new))
    problem = Problem(plant, _with_one_more(records, u, y), question.noise)
    fit = descend(problem, theta, local, fixed=rival.held, max_steps=STEPS)
    before = Problem(plant, records, question.noise).squares(rival.estimate.errors)
    return max(fit.squares - before, 0.0), fit.errors[-1, : len(u)]


def _with_one_more(records: Records, u: np.ndarray, y: np.ndarray) -> Records:
    """Put a record beside others; the shorter ones are padded and masked."""
    longest = max(records.u.shape[1], len(u))

    def padded(values: np.ndarray, samples: int) -> np.ndarray:
        more = longest - samples
        return np.concatenate((values, np.repeat(values[:, -1:], more, axis=1)), axis=1) if more else values

    def joined(old: np.ndarray, new: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(np.concatenate((padded(old, old.shape[1]), padded(new[None], len(new)))))

    mask = np.zeros((len(records.u) + 1, longest), dtype=bool)
    mask[:-1, : records.mask.shape[1]] = records.mask
    mask[-1, : len(u)] = True
    past = records.past.beside(Past.none(u[None], records.past.u.shape[1]))
    return Records(joined(records.u, u), joined(records.y, y), mask, records.dt, past, records.soft)
