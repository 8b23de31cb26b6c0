"""The plain linear model of a plant: its order, its input between samples, and the baseline made of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simgap.greybox.baseline import Baseline
from simgap.greybox.data_checks import check_numbers
from simgap.greybox.fitting import Estimate, Problem
from simgap.greybox.noise import Noise, log_likelihood, white, white_as_large_as
from simgap.greybox.outliers import find_outliers, without_outliers
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import fit_plain
from simgap.greybox.samples import RESOLUTION, Records, excerpts
from simgap.greybox.score_test import add, candidates
from simgap.greybox.signal_scales import quantisation_step, scales_of
from simgap.records import Channels, Experiment, Kind

MAX_ORDER = 4
# A higher order must lower the held-out error by this share, or it is not worth it.
WORTH_AN_ORDER = 0.015
BLOCKS = 20
# Log-likelihood ratio, for each input, that speaks for an input that does not stand still between samples.
SMOOTH = 20.0
EARLY = 0.25  # samples


def find_baseline(
    train: Sequence[Experiment], valid: Sequence[Experiment], channels: Channels, outputs: Sequence[int]
) -> Baseline:
    """Fit the plain linear model of one plant to excerpts of the experiments. Raises UnusableInput."""
    check_numbers([*train, *valid], channels)
    records = Records.of(excerpts(train), outputs)
    held_out = Records.of(excerpts(valid), outputs) if valid else records
    cut = len(records.u) > len(train) or records.mask.shape[1] < max(map(len, train))
    kind = channels.outputs[outputs[0]].kind
    models = plain_models(records, held_out, kind)
    stepped = any(quantisation_step(records.y[..., j]) for j in range(len(outputs)))
    outliers = [] if stepped else find_outliers(models[-1].errors, records.mask, records.resolution)
    if outliers:
        records = without_outliers(records, models[-1].errors, outliers)
        held_out = without_outliers(held_out, errors_on(models[-1], held_out), outliers) if valid else records
        models = plain_models(records, held_out, kind)

    def baseline_of(plain: Estimate) -> Baseline:
        problem = Problem(plain.plant, records, white(records.sizes))
        plant = replace(plain.plant, scales=scales_of(plain, problem, channels, outputs))
        return Baseline(records, held_out, tuple(outputs), replace(plain, plant=plant), cut, tuple(outliers))

    baseline = baseline_of(models[-1])
    to_beat = _held_out_error(baseline, baseline.estimate)
    for simpler in (fit for fit in models[:-1] if not fit.plant.zeros):
        # A higher order is no answer where a delay or another law of the plant, which cost no more, do as well.
        other = baseline_of(simpler)
        instead = [term for term in candidates(other) if term.effect.instead_of_order and not term.channel]
        if any(_held_out_error(other, add(other, other.estimate, term)) <= to_beat for term in instead):
            baseline = other
            break
    smooth = first_order_hold(baseline.estimate, records, held_out)
    return baseline if smooth is None else baseline_of(smooth)


def _held_out_error(baseline: Baseline, fit: Estimate) -> float:
    """Mean square of held-out simulations."""
    return float(block_errors(fit, baseline.valid).mean())


def plain_models(train: Records, valid: Records, kind: Kind) -> list[Estimate]:
    """Fit plain linear models: order 1 for a velocity, 2 for a position, else up to what held-out data ask for.

    The last one is the simplest whose held-out error is within a standard error of the best.
    """
    nu, dt = train.u.shape[2], train.dt
    if kind in ("position", "velocity"):
        return [
            fit_plain(Plant(kind, 2 if kind == "position" else 1, nu, dt, two_outputs=train.y.shape[2] == 2), train)
        ]
    tried: list[tuple[Estimate, np.ndarray]] = []
    smaller, rounds_in_vain = None, 0
    for order in range(1, MAX_ORDER + 1):
        here = []
        for zeros in sorted({0, 0 if kind == "level" else order - 1}):
            plant = Plant(kind, order, nu, dt, zeros=zeros, offset=True)
            grid = order <= 2 and not zeros
            fit = fit_plain(plant, train, None if grid else here[0][0] if zeros else smaller)
            here.append((fit, block_errors(fit, valid)))
        known = min((squares.mean() for _, squares in tried), default=np.inf)
        tried += here
        smaller = here[0][0]
        # A resonance takes two orders.
        rounds_in_vain = (
            rounds_in_vain + 1 if min(squares.mean() for _, squares in here) > (1 - WORTH_AN_ORDER) * known else 0
        )
        if rounds_in_vain == 2:
            break
    best = min((squares for _, squares in tried), key=np.mean)
    chosen = []
    for fit, squares in tried:  # from the simplest on
        chosen.append(fit)
        worse = squares - best
        if worse.mean() <= worse.std() / math.sqrt(len(worse)):
            break
    return chosen


def first_order_hold(held: Estimate, train: Records, valid: Records) -> Estimate | None:
    """Fit the model with an input that runs on smoothly between samples; None where the records show a held one.

    Seen from held samples, such an input comes half a sample early: the mean time of its gains, zeros included,
    says so. A lag or a delay would make it late.
    """
    noise = white_as_large_as(held.errors, train.mask, train.resolution)
    smooth = _with_taps(held, train, noise, (0, -1, 1))
    plant, theta = smooth.plant, smooth.theta
    gains = theta[plant.layout.gains].reshape(plant.nu, -1) * train.input_sizes[:, None]
    gains /= np.max(np.abs(gains)) or 1.0
    late = np.sum(gains @ plant.taps * gains.sum(1))
    early = float(late / (np.sum(gains.sum(1) ** 2) or 1.0))
    early += float(np.sum(theta[plant.layout.zeros][:1]) - np.sum(held.theta[held.plant.layout.zeros][:1])) / plant.dt
    likely = [log_likelihood(fit.errors, train.mask, 1, train.resolution) for fit in (smooth, held)]
    gain = likely[0] - likely[1]
    better = block_errors(smooth, valid).mean() < block_errors(held, valid).mean()
    return smooth if early > EARLY and gain > SMOOTH * plant.nu and better else None


def _with_taps(held: Estimate, train: Records, noise: Noise, taps: tuple[int, ...]) -> Estimate:
    before = held.plant
    simple = before.cascade or before.two_outputs
    plant = replace(before, taps=taps, zeros=before.zeros if simple else before.order - 1)
    theta = np.zeros(plant.size)
    for name in ("poles", "offset", "velocity"):
        theta[getattr(plant.layout, name)] = held.theta[getattr(before.layout, name)]
    theta[plant.layout.zeros][: before.zeros] = held.theta[before.layout.zeros]
    theta[plant.layout.gains][:: len(taps)] = held.theta[before.layout.gains]
    return Problem(plant, train, noise).fit(theta, held.local)


def errors_on(fit: Estimate, records: Records) -> np.ndarray:
    """Simulate other records with a fitted model, each from the best initial state: errors [E, T, ny]."""
    fixed = np.ones(fit.plant.size, dtype=bool)
    return Problem(fit.plant, records, white(records.sizes)).fit(fit.theta, fixed=fixed, max_steps=10).errors


def block_errors(fit: Estimate, valid: Records) -> np.ndarray:
    """Average the squared errors of held-out free runs, in units of the outputs' sizes, over about twenty blocks."""
    errors = errors_on(fit, valid) / valid.sizes
    squares = np.where(valid.mask[:, :, None], errors**2 + RESOLUTION**2, 0.0)
    blocks = np.array_split(squares, min(max(2, BLOCKS // len(squares)), squares.shape[1]), axis=1)
    return np.concatenate([block.mean(axis=(1, 2)) for block in blocks])
