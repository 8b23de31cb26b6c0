"""What a fitted model leaves in its errors that the input and the motion would still predict."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.findings import Offer
from simgap.greybox import dynamics
from simgap.greybox.fitting import Estimate
from simgap.greybox.noise import white
from simgap.greybox.normal_equations import LARGEST_SLOPE, Jacobian
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records, sizes_of
from simgap.greybox.simulation import Simulator
from simgap.records import Channel

RIDGES = (1e-4, 1e-2, 1.0)
# Of the share that is predicted, as many standard errors over the folds must be above zero.
CERTAIN = 2.5
FOLDS = 8
# Of the regression that a formula comes from.
THRESHOLDS = (0.5, 0.3, 0.2, 0.1, 0.05)
WORSE = 0.05  # of the variance that the fullest formula explains may be lost for a shorter one


@dataclass(frozen=True, eq=False)
class Leftover:
    """Candidate forces phi along the simulation, what each would do to the output, and how much they predict.

    share is that of the squared error in folds that the coefficients were not fitted to; 0 when it may be chance.
    """

    names: tuple[str, ...]
    forces: Float[np.ndarray, "N f"]
    effects: Float[np.ndarray, "N f"]  # at the output
    errors: Float[np.ndarray, " N"]
    share: float


def look_for_more(estimate: Estimate, records: Records) -> Leftover:
    """Regress the errors on what forces of many shapes would do to the output, filtered through the linear plant."""
    plant, problem = estimate.plant, Problem(estimate.plant, records, white(records.sizes))
    n, order = len(records.u), plant.order
    x, v = problem.simulator.motion(estimate.theta, estimate.local)  # [E, T]
    driven = records.u if plant.machine is None else records.u[:, :, [plant.machine.of_drive]]
    names, phi = library(plant, x, v, driven)
    zeros = 0 if plant.imposed else plant.zeros  # of an imposed motion they belong to the damper, not to forces
    plain = Plant(plant.kind, order, len(names), plant.dt, zeros=zeros, two_outputs=plant.two_outputs,
                  joint=plant.joint)  # fmt: skip
    simulator = Simulator(plain, np.ascontiguousarray(phi))
    theta = np.zeros(plain.size)
    for part in ("poles", "zeros", "velocity") if plant.machine is None else ():
        if plain.zeros or part != "zeros":
            theta[getattr(plain.layout, part)] = estimate.theta[getattr(plant.layout, part)]
    if plant.machine is not None:  # as linear as it is where it hangs
        theta[: plant.order] = -dynamics.matrix(plant, estimate.theta)[-1, ::-1]
    thetas = np.repeat(theta[None], len(names), axis=0)
    thetas[:, plain.layout.gains] = np.eye(len(names))
    runs = simulator.run_many(thetas, np.zeros((len(names), n, plain.n_start)))
    responses = np.moveaxis(runs[..., 0], 0, 2)  # [E, T, f]
    jacobian = problem.jacobian(estimate.theta, estimate.local, plant.free)
    share = _predicted(estimate, records, responses, jacobian)
    mask = records.mask
    return Leftover(names, phi[mask], responses[mask], estimate.errors[..., 0][mask], share)


def library(plant: Plant, x: np.ndarray, v: np.ndarray, u: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
    """Shapes of a missing force in x, v and the inputs, each scaled to rms 1."""
    x, v = (signal / sizes_of(signal.reshape(-1, 1))[0] for signal in (x, v))
    shapes = {"x^2": x * x, "x^3": x**3, "v |v|": v * np.abs(v), "sign v": np.tanh(10 * v), "v^3": v**3, "v^2": v * v}
    if plant.order > 1:
        shapes |= {"x v": x * v, "x^2 v": x * x * v, "x |x|": x * np.abs(x)}
    for i in range(u.shape[2]):
        w = u[..., i] / (_rms(u[..., i]) or 1.0)
        name = "u" if u.shape[2] == 1 else f"u{i + 1}"
        shapes |= {f"{name}^2": w * w, f"{name}^3": w**3, f"{name} |{name}|": w * np.abs(w), f"x {name}": x * w,
                   f"x^2 {name}": x * x * w, f"sign {name}": np.tanh(10 * w)}  # fmt: skip
        shapes |= {f"sin(2x) {name}": np.sin(2 * x) * w, f"cos(2x) {name}": np.cos(2 * x) * w}
        before = np.concatenate((w[:, :1], w[:, :-1]), axis=1)
        shapes |= {f"{name} before": before}
    return tuple(shapes), normalised(np.stack(list(shapes.values()), axis=2))


def _rms(values: np.ndarray) -> float:
    largest = float(np.max(np.abs(values), initial=0.0))
    return largest * float(np.sqrt(np.mean((values / largest) ** 2))) if largest else 0.0


def normalised(columns: Float[np.ndarray, "... f"]) -> Float[np.ndarray, "... f"]:
    """Scale each column to rms 1; one that is zero, or grows without bound, becomes zero."""
    kept = np.abs(columns).reshape(-1, columns.shape[-1]).max(axis=0) < LARGEST_SLOPE  # nor is NaN
    columns = np.where(kept, columns, 0.0)
    rms = np.array([_rms(columns[..., i]) for i in range(columns.shape[-1])])
    return columns / np.where(rms > 0, rms, 1.0)


def _predicted(estimate: Estimate, records: Records, responses: np.ndarray, jacobian: Jacobian) -> float:
    """Held-out share, over folds of whole experiments, or of blocks where there are few; 0 when it may be chance."""
    mask = records.mask
    fold = np.zeros(mask.shape, dtype=int)
    if len(mask) >= FOLDS:
        fold += np.arange(len(mask))[:, None] % FOLDS
    else:
        fold += (np.arange(mask.shape[1]) * FOLDS // mask.shape[1])[None]
    fold, e = fold[mask], estimate.errors[..., 0][mask]
    of_theta = np.moveaxis(jacobian.theta[estimate.plant.free], 0, 2).reshape(*mask.shape, estimate.plant.ny, -1)[
        :, :, 0
    ]
    model = of_theta[mask]  # what the model's own parameters would do
    if len(np.unique(fold)) < FOLDS:
        return 0.0  # too few samples to hold any out
    features = normalised(np.concatenate((model, responses[mask]), axis=1))
    own = model.shape[1]
    rounding = len(e) * float(records.rounding[0]) ** 2
    shares = []
    best = 0.0
    for ridge in RIDGES:
        gains, total = [], 0.0
        for k in range(FOLDS):
            inside = fold != k
            f, y = features[inside], e[inside]
            penalty = np.full(features.shape[1], ridge * len(y))
            penalty[:own] = 1e-9 * len(y)
            coefficients = np.linalg.solve(f.T @ f + np.diag(penalty), f.T @ y)
            there = e[~inside]
            gains.append(np.sum(there**2) - np.sum((there - features[~inside] @ coefficients) ** 2))
            total += np.sum(there**2)
        gains = np.array(gains)
        shares.append(gains.sum() / (total + rounding))
        certain = gains.mean() > CERTAIN * gains.std() / np.sqrt(FOLDS - 1)
        if certain:
            best = max(best, float(shares[-1]))
    return best


def formula(leftover: Leftover, channel: Channel) -> Offer | None:
    """Find the shortest formula for the missing force that predicts the error nearly as well as the fullest one.

    None where no force is left in it.

    Sequentially thresholded least squares (Brunton, Proctor, Kutz 2016), by pysindy, of the error on what each
    candidate force would do to the output; x, v and the inputs are in units of their spread.
    """
    from pysindy.optimizers import STLSQ

    responses = normalised(leftover.effects)
    scale = float(np.std(leftover.errors)) or 1.0
    target = (leftover.errors / scale)[:, None]
    tried = []
    for threshold in THRESHOLDS:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            optimizer = STLSQ(threshold=threshold, alpha=1e-3)
            optimizer.fit(responses, target)
        coefficients = np.asarray(optimizer.coef_)[0]
        rest = target[:, 0] - responses @ coefficients
        tried.append((1 - float(np.mean(rest**2)), coefficients))
    best = max(share for share, _ in tried)
    share, coefficients = min(
        (trial for trial in tried if trial[0] > best - WORSE), key=lambda trial: np.count_nonzero(trial[1])
    )
    if not coefficients.any():
        return None
    order, largest = np.argsort(-np.abs(coefficients)), np.max(np.abs(coefficients))
    parts = [f"{coefficients[i] / largest:+.2g} {leftover.names[i]}" for i in order if coefficients[i]]
    return Offer(channel.name, "force ~ " + " ".join(parts), max(0.0, share), "relative")
