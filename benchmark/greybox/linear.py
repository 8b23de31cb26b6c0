"""Plain linear models, and what of the data a search looks at."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simgap.greybox.fitting import Estimate, Problem, Records
from simgap.greybox.noise import Noise, log_likelihood, white
from simgap.greybox.plain import fit_plain
from simgap.greybox.plant import Structure
from simgap.records import Experiment, Kind

# The search uses so many samples, spread over the records; the final fit uses all.
SEARCH_SAMPLES = 5000
PIECE = 500
MAX_ORDER = 4
# A higher order must lower the held-out error by this share, or it is in vain.
WORTH_AN_ORDER = 0.015
BLOCKS = 20
# Log-likelihood ratio, for each input, that speaks for an input that does not stand still between samples.
SMOOTH = 20.0
EARLY = 0.25  # samples


def excerpts(experiments: Sequence[Experiment], samples: int = SEARCH_SAMPLES) -> list[Experiment]:
    """Pieces of the experiments, evenly spread, when they are longer than a search needs; else all of them."""
    total = sum(map(len, experiments))
    if total <= 1.5 * samples:
        return list(experiments)
    pieces = [x[a : a + PIECE] for x in experiments for a in range(0, max(1, len(x) - PIECE // 2), PIECE)]
    wanted = max(2, samples * len(pieces) // sum(map(len, pieces)))
    return [pieces[i] for i in np.unique(np.linspace(0, len(pieces) - 1, wanted).round().astype(int))]


def plain_models(train: Records, valid: Records, kind: Kind) -> list[Estimate]:
    """Plain linear models: of order 1 for a velocity, 2 for a position, else up to what held-out data ask for.

    The last one is the simplest whose held-out error is within a standard error of the best.
    """
    nu, dt = train.u.shape[2], train.dt
    if kind in ("position", "velocity"):
        return [
            fit_plain(Structure(kind, 2 if kind == "position" else 1, nu, dt, two_outputs=train.y.shape[2] == 2), train)
        ]
    tried: list[tuple[Estimate, np.ndarray]] = []
    smaller, in_vain = None, 0
    for order in range(1, MAX_ORDER + 1):
        here = []
        for zeros in sorted({0, 0 if kind == "level" else order - 1}):
            structure = Structure(kind, order, nu, dt, zeros=zeros, offset=True)
            grid = order <= 2 and not zeros
            fit = fit_plain(structure, train, None if grid else here[0][0] if zeros else smaller)
            here.append((fit, block_errors(fit, valid)))
        known = min((squares.mean() for _, squares in tried), default=np.inf)
        tried += here
        smaller = here[0][0]
        # A resonance takes two orders.
        in_vain = in_vain + 1 if min(squares.mean() for _, squares in here) > (1 - WORTH_AN_ORDER) * known else 0
        if in_vain == 2:
            break
    best = min((squares for _, squares in tried), key=np.mean)
    chosen = []
    for fit, squares in tried:  # from the simplest on
        chosen.append(fit)
        worse = squares - best
        if worse.mean() <= worse.std() / math.sqrt(len(worse)):
            break
    return chosen


def let_run_on(held: Estimate, train: Records, valid: Records) -> Estimate | None:
    """The model with an input that runs on smoothly between samples, where it is felt clearly before it is held.

    Seen from held samples, such an input comes half a sample early: the mean time of its gains, zeros included,
    says so. A lag or a delay would make it late.
    """
    noise = white(np.sqrt(np.mean(held.errors[train.mask] ** 2, axis=0)) + 1e-300)
    smooth = _with_taps(held, train, noise, (0, -1, 1))
    structure, theta = smooth.structure, smooth.theta
    gains = theta[structure.at[1]].reshape(structure.nu, -1)
    early = float(np.sum(gains @ structure.taps * gains.sum(1)) / max(np.sum(gains.sum(1) ** 2), 1e-300))
    early += float(np.sum(theta[structure.at[3]][:1]) - np.sum(held.theta[held.structure.at[3]][:1])) / structure.dt
    gain = log_likelihood(smooth.errors, train.mask, 1) - log_likelihood(held.errors, train.mask, 1)
    better = block_errors(smooth, valid).mean() < block_errors(held, valid).mean()
    return smooth if early > EARLY and gain > SMOOTH * structure.nu and better else None


def _with_taps(held: Estimate, train: Records, noise: Noise, taps: tuple[int, ...]) -> Estimate:
    before = held.structure
    simple = before.cascade or before.two_outputs
    structure = replace(before, taps=taps, zeros=before.zeros if simple else before.order - 1)
    theta = np.zeros(structure.size)
    for part in (0, 2, 4):
        theta[structure.at[part]] = held.theta[before.at[part]]
    theta[structure.at[3]][: before.zeros] = held.theta[before.at[3]]
    theta[structure.at[1]][:: len(taps)] = held.theta[before.at[1]]
    return Problem(structure, train, noise).fit(theta, held.local)


def errors_on(fit: Estimate, records: Records) -> np.ndarray:
    """Errors [E, T, ny] of a fitted model on other records, each from the start that suits it best."""
    fixed = np.ones(fit.structure.size, dtype=bool)
    return (
        Problem(fit.structure, records, white(np.ones(fit.structure.ny)))
        .fit(fit.theta, fixed=fixed, max_steps=10)
        .errors
    )


def block_errors(fit: Estimate, valid: Records) -> np.ndarray:
    """Mean squares of held-out free runs, in about twenty blocks."""
    errors = errors_on(fit, valid)
    squares = np.where(valid.mask[:, :, None], errors**2, 0.0)
    blocks = np.array_split(squares, max(2, 20 // len(squares)), axis=1)
    return np.concatenate([block.mean(axis=(1, 2)) for block in blocks])
