"""What a fitted model leaves in its errors that the input and the motion would still predict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.greybox.fitting import Estimate, Problem, Records, Slopes
from simgap.greybox.plant import Structure
from simgap.greybox.simulation import Simulator

RIDGES = (1e-4, 1e-2, 1.0)
# Of the share that is predicted, as many standard errors over the folds must be above zero.
CERTAIN = 2.5
FOLDS = 8


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


def look_for_more(found: Estimate, records: Records) -> Leftover:
    """Regress the errors on what forces of many shapes would do to the output, filtered through the linear plant."""
    structure, problem = found.structure, Problem(found.structure, records, _unit(found.structure.ny))
    n, order = len(records.u), structure.order
    states = problem.simulator.states(found.theta[None], found.local[None, :, :order])[0]  # [E, T, n]
    names, phi = library(structure, states, records.u)
    plain = Structure(
        structure.kind, order, len(names), structure.dt, zeros=structure.zeros, two_outputs=structure.two_outputs
    )
    simulator = Simulator(plain, np.ascontiguousarray(phi))
    theta = np.zeros(plain.size)
    for part in (0, 3, 4):
        theta[plain.at[part]] = found.theta[structure.at[part]]
    thetas = np.repeat(theta[None], len(names), axis=0)
    thetas[:, plain.at[1]] = np.eye(len(names))
    responses = np.moveaxis(simulator.run_many(thetas, np.zeros((len(names), n, order)))[..., 0], 0, 2)  # [E, T, f]
    slopes = problem.slopes(found.theta, found.local, structure.free)
    share = _predicted(found, records, responses, slopes)
    mask = records.mask
    return Leftover(names, phi[mask], responses[mask], found.errors[..., 0][mask], share)


def library(structure: Structure, states: np.ndarray, u: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
    """Shapes of a missing force in x, v and the inputs, each scaled to rms 1."""
    x, v = states[..., 0], states[..., min(1, structure.order - 1)]
    place, rate = np.std(x) + 1e-300, np.std(v) + 1e-300
    x, v = x / place, v / rate
    shapes = {"x^2": x * x, "x^3": x**3, "v |v|": v * np.abs(v), "sign v": np.tanh(10 * v), "v^3": v**3, "v^2": v * v}
    if structure.order > 1:
        shapes |= {"x v": x * v, "x^2 v": x * x * v, "x |x|": x * np.abs(x)}
    for i in range(u.shape[2]):
        w = u[..., i] / (np.sqrt(np.mean(u[..., i] ** 2)) + 1e-300)
        name = "u" if u.shape[2] == 1 else f"u{i + 1}"
        shapes |= {f"{name}^2": w * w, f"{name}^3": w**3, f"{name} |{name}|": w * np.abs(w), f"x {name}": x * w,
                   f"x^2 {name}": x * x * w, f"sign {name}": np.tanh(10 * w)}  # fmt: skip
        shapes |= {f"sin(2x) {name}": np.sin(2 * x) * w, f"cos(2x) {name}": np.cos(2 * x) * w}
        before = np.concatenate((w[:, :1], w[:, :-1]), axis=1)
        shapes |= {f"{name} before": before}
    phi = np.stack([np.nan_to_num(shape) for shape in shapes.values()], axis=2)
    return tuple(shapes), phi / (np.sqrt(np.mean(phi * phi, axis=(0, 1))) + 1e-300)


def _predicted(found: Estimate, records: Records, responses: np.ndarray, slopes: Slopes) -> float:
    """Held-out share, over folds of whole experiments, or of blocks where there are few; 0 when it may be chance."""
    mask = records.mask
    fold = np.zeros(mask.shape, dtype=int)
    if len(mask) >= FOLDS:
        fold += np.arange(len(mask))[:, None] % FOLDS
    else:
        fold += (np.arange(mask.shape[1]) * FOLDS // mask.shape[1])[None]
    fold, e = fold[mask], found.errors[..., 0][mask]
    of_theta = np.moveaxis(slopes.theta[found.structure.free], 0, 2).reshape(*mask.shape, found.structure.ny, -1)[
        :, :, 0
    ]
    model = of_theta[mask]  # what the model's own parameters would do
    features = np.concatenate((model, responses[mask]), axis=1)
    features = features / (np.sqrt(np.mean(features**2, axis=0)) + 1e-300)
    own = model.shape[1]
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
        shares.append(gains.sum() / max(total, 1e-300))
        certain = gains.mean() > CERTAIN * gains.std() / np.sqrt(FOLDS - 1)
        if certain:
            best = max(best, float(shares[-1]))
    return best


def _unit(ny: int):
    from simgap.greybox.noise import white

    return white(np.ones(ny))
