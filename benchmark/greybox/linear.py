"""The plain linear model of a plant: its order, its input between samples, and the baseline made of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from simgap.greybox import dynamics
from simgap.greybox.additions import add
from simgap.greybox.baseline import Baseline
from simgap.greybox.data_checks import check_numbers
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.held_out import as_good_as_best, block_errors, errors_on, in_most
from simgap.greybox.noise import Noise, log_likelihood, schwarz_order, white, white_as_large_as
from simgap.greybox.outliers import find_outliers, without_outliers
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import fit_from, fit_plain
from simgap.greybox.problem import Problem
from simgap.greybox.refits import refine
from simgap.greybox.samples import Records, excerpts, is_cut
from simgap.greybox.score_test import candidates
from simgap.greybox.signal_scales import scales_of
from simgap.greybox.subspace_start import linear_models, starts
from simgap.greybox.terms import Term
from simgap.greybox.trial import score_gain
from simgap.records import Channels, Experiment, Kind
from simgap.subspace.state_space import StateSpace

MAX_ORDER = 8
USUAL = 4  # beyond, an order must be likelier in training too, because so many poles fit any few held-out blocks
# A higher order must lower the held-out error by this share, or it is not worth it.
WORTH_AN_ORDER = 0.015
# Log-likelihood ratio, for each input, that speaks for an input that does not stand still between samples.
SMOOTH = 20.0
EARLY = 0.25  # samples
UNEXPLAINED = 0.5  # share of the output's variance

HeldOut = Callable[[Estimate], np.ndarray]  # the squared errors of held-out blocks


def find_baseline(
    train: Sequence[Experiment],
    valid: Sequence[Experiment],
    channels: Channels,
    outputs: Sequence[int],
    n_init: int,
    every_reading: bool = False,
) -> Baseline:
    """Fit the plain linear model of one plant to excerpts of the experiments. Raises UnusableInput.

    Single readings that are far off are left out, unless it is to be of `every_reading`. Held-out records are simulated
    from their first n_init samples, as the test will be.
    """
    check_numbers([*train, *valid], channels)
    chosen = excerpts(train)
    records = Records.of(chosen, outputs)
    held_out = Records.of(excerpts(valid), outputs) if valid else records
    cut = is_cut(chosen, train)
    models, orders = plain_models(records, held_out, channels, outputs, n_init)
    stepped = records.steps.any()
    outliers = [] if stepped or every_reading else find_outliers(models[-1].errors, records.mask, records.resolution)
    if outliers:
        records = without_outliers(records, models[-1].errors, outliers)
        held_out = without_outliers(held_out, errors_on(models[-1], held_out, n_init), outliers) if valid else records
        models, orders = plain_models(records, held_out, channels, outputs, n_init)
    plain = scaled(models[-1], records, channels, outputs)
    return _simplest(
        Baseline(records, held_out, tuple(outputs), plain, n_init, cut, tuple(outliers), orders), models, channels
    )


def as_other(baseline: Baseline, channels: Channels) -> Baseline:
    """Fit the plain linear model of the same readings again, of outputs of another kind."""
    models, orders = plain_models(baseline.train, baseline.valid, channels, baseline.outputs, baseline.n_init)
    return _simplest(with_plain(replace(baseline, orders=orders), models[-1], channels), models, channels)


def _simplest(baseline: Baseline, models: Sequence[Estimate], channels: Channels) -> Baseline:
    """Take a simpler plain model where an effect of fewer numbers does as well; ask whether the input is held."""
    held_out_errors = cache(baseline.held_out_errors)  # of orders that many candidates are compared with
    for simpler in (fit for fit in models[:-1] if fit.plant.by_rate or not fit.plant.zeros):
        # A higher order is no answer where a delay or another law of the plant, which cost less, do as well.
        other = with_plain(baseline, simpler, channels)
        instead = [term for term in candidates(other) if _instead_of_order(term, other.plant)]
        if any(
            _takes_its_place(fit, simpler, baseline, held_out_errors) for term in instead for fit in _laws(other, term)
        ):
            baseline = other
            break
    if baseline.plant.imposed:
        return baseline
    smooth = first_order_hold(baseline.estimate, baseline.train, baseline.valid, baseline.n_init)
    return baseline if smooth is None else with_plain(baseline, smooth, channels)


def _laws(baseline: Baseline, term: Term) -> Iterator[Estimate]:
    """Fit an effect to a simpler plant, then the form of its law that has more numbers."""
    fit = add(baseline, baseline.estimate, term)
    yield fit
    if (fine := refine(baseline, fit, term)) is not None:
        yield fine


def _takes_its_place(other: Estimate, simpler: Estimate, baseline: Baseline, held_out_errors: HeldOut) -> bool:
    """Tell whether an effect on a simpler plant does as well as the plain model.

    It must simulate held-out data better than the simpler plant, and no order of as few parameters do as well as it.
    """

    def does_as_well(one: Estimate, another: Estimate) -> bool:
        if in_most(held_out_errors(one) - held_out_errors(another)):  # it errs more, as nearly all do, at less cost
            return False
        return score_gain(baseline, one, baseline, another) > 0

    if held_out_errors(other).mean() >= held_out_errors(simpler).mean() or not does_as_well(other, baseline.estimate):
        return False
    as_few = [fit for fit in baseline.orders if fit.plant.free.sum() <= other.plant.free.sum()]
    return not any(does_as_well(fit, other) for fit in as_few)


def scaled(plain: Estimate, records: Records, channels: Channels, outputs: Sequence[int]) -> Estimate:
    """Measure the scales of the signals that effects choose bounds by."""
    moved = _under_load(plain, records)
    problem = Problem(moved.plant, records, white(records.sizes))
    return replace(plain, plant=replace(plain.plant, scales=scales_of(moved, problem, channels, outputs)))


def with_plain(baseline: Baseline, plain: Estimate, channels: Channels) -> Baseline:
    """Put another plain model into a baseline, and measure its scales."""
    return replace(baseline, estimate=scaled(plain, baseline.train, channels, baseline.outputs))


def _under_load(plain: Estimate, records: Records) -> Estimate:
    """Fit a constant force too, where the model without one explains less than half of the output.

    What a load carries away from an operating point that the model does not have says nothing of gain and forces.
    """
    before, sizes = plain.plant, records.sizes
    left = np.mean((plain.errors[records.mask] / sizes) ** 2)
    if left < UNEXPLAINED or before.offset or before.cascade or before.imposed or before.joint:
        return plain
    loaded = fit_plain(replace(before, offset=True, zeros=0, taps=(0,)), records)
    return loaded if np.mean((loaded.errors[records.mask] / sizes) ** 2) < UNEXPLAINED * left else plain


def _instead_of_order(term: Term, plant: Plant) -> bool:
    """Tell whether an effect may explain what else asks for a higher order.

    Behind an imposed motion play looks so; and whether its rate is that of a motion, only a friction shows.
    """
    effect = term.effect
    of_force = plant.imposed and (effect.memory > 0 or (plant.by_rate and effect.role == "friction"))
    return not term.channel and (effect.instead_of_order or of_force)


def plain_models(
    train: Records, valid: Records, channels: Channels, outputs: Sequence[int], n_init: int
) -> tuple[list[Estimate], tuple[Estimate, ...]]:
    """Fit plain linear models: order 1 for a velocity, 2 for a position, else up to what held-out data ask for.

    The last one of the list is the simplest whose held-out error is within a standard error of the best, and the ones
    before it are simpler; beside it stand all that were tried. An only input that is a velocity may be that of a motion
    which takes a force.
    """
    kind = channels.outputs[outputs[0]].kind
    by_rate = kind == "other" and [channel.kind for channel in channels.inputs] == ["velocity"]
    nu, dt = train.u.shape[2], train.dt
    if kind in ("position", "velocity"):
        plant = Plant(kind, 2 if kind == "position" else 1, nu, dt, two_outputs=train.y.shape[2] == 2)
        return [fit_plain(plant, train)], ()
    single = kind != "level" and nu == 1
    models = linear_models(train, range(2, MAX_ORDER + 1)) if single else []
    tried: list[tuple[Estimate, np.ndarray]] = []
    smaller: dict[bool, Estimate] = {}  # of one order less, without and with zeros
    rounds_in_vain = 0
    for order in range(kind == "level", MAX_ORDER + 1):
        of_order = _of_order(order, kind, train, smaller, models)
        if not of_order:
            break
        here = [(fit, block_errors(fit, valid, n_init, train)) for fit in of_order.values()]
        likely = order <= USUAL or _likelier([fit for fit, _ in here], [fit for fit, _ in tried], train)
        known = min((squares.mean() for _, squares in tried), default=np.inf)
        smaller = of_order
        # A resonance takes two orders.
        if likely and min(squares.mean() for _, squares in here) <= (1 - WORTH_AN_ORDER) * known:
            rounds_in_vain = 0
        else:
            rounds_in_vain += 1
        if likely:
            tried += here
        if rounds_in_vain == 2:
            break
    if by_rate:  # beside them all: what it simulates worse or better says nothing of the next order
        fit = fit_plain(Plant(kind, 0, nu, dt, zeros=1, offset=True, by_rate=True), train)
        tried.insert(0, (fit, block_errors(fit, valid, n_init, train)))
    fits = tuple(fit for fit, _ in tried)  # from the simplest on
    return list(fits[: 1 + as_good_as_best([squares for _, squares in tried])]), fits


def _of_order(
    order: int, kind: Kind, train: Records, smaller: dict[bool, Estimate], models: Sequence[StateSpace]
) -> dict[bool, Estimate]:
    """Fit the plain linear models of one order: without zeros, and with as many as it may have.

    A high order begins at projections alone, where there are any, and has zeros; it may have no model that acts.
    """
    fits: dict[bool, Estimate] = {}
    for zeros in {0: (0, 1), 1: (0,)}.get(order, (0,) if kind == "level" else (0, order - 1)):
        plant = Plant(kind, order, train.u.shape[2], train.dt, zeros=zeros, offset=True)
        found: list[Estimate] = []
        if order <= USUAL or not models:
            before = fits.get(False) if zeros else smaller.get(False) if order > 2 else None
            found.append(fit_plain(plant, train, before))
        begun = starts(plant, models)
        further = [fit_from(plant, train, begun)] if begun else []
        if zeros and order > 1 and not (begun and order > USUAL):
            # A slow pole beside its zero is found in no model without zeros.
            further.append(fit_plain(plant, train, smaller.get(True) or smaller[False]))
        found += [fit for fit in further if _is_of_the_input(fit, train)]
        if found:
            fits[zeros > 0] = min(found, key=lambda fit: float(np.sum(fit.errors**2)))
    return fits


def _is_of_the_input(fit: Estimate, train: Records) -> bool:
    """Tell whether all poles act within a record; a slower one beside its zero is an offset of each record."""
    return dynamics.slowest(fit.plant, fit.theta) * train.duration > 1


def _likelier(larger: Sequence[Estimate], smaller: Sequence[Estimate], train: Records) -> bool:
    """Tell whether one of the larger models is likelier than all smaller ones at what it costs (Schwarz 1978)."""
    order = max(schwarz_order(fit.errors, train.mask, train.resolution) for fit in (*larger, *smaller))

    def score(fit: Estimate) -> float:
        likely = log_likelihood(fit.errors, train.mask, order, train.resolution)
        return likely - 0.5 * int(fit.plant.free.sum()) * math.log(train.samples)

    return max(map(score, larger)) > max(map(score, smaller))


def first_order_hold(held: Estimate, train: Records, valid: Records, n_init: int) -> Estimate | None:
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
    of_smooth, of_held = (block_errors(fit, valid, n_init, train).mean() for fit in (smooth, held))
    return smooth if early > EARLY and gain > SMOOTH * plant.nu and of_smooth < of_held else None


def _with_taps(held: Estimate, train: Records, noise: Noise, taps: tuple[int, ...]) -> Estimate:
    before = held.plant
    simple = before.cascade or before.two_outputs or before.joint
    plant = replace(before, taps=taps, zeros=before.zeros if simple else before.order - 1)
    theta = np.zeros(plant.size)
    for name in ("poles", "offset", "velocity"):
        theta[getattr(plant.layout, name)] = held.theta[getattr(before.layout, name)]
    theta[plant.layout.zeros][: before.zeros] = held.theta[before.layout.zeros]
    theta[plant.layout.gains][:: len(taps)] = held.theta[before.layout.gains]
    return descend(Problem(plant, train, noise), theta, held.local)
