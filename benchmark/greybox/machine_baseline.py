"""The plain model of a machine of which something is known: inertia, damping and drive beside what is told."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from simgap.greybox.baseline import Baseline
from simgap.greybox.data_checks import check_numbers
from simgap.greybox.fitting import Estimate, best_descent, descend
from simgap.greybox.held_out import errors_on
from simgap.greybox.machine import DAMPING, INERTIA, NAMES, STIFFNESS, Machine, machine_of
from simgap.greybox.noise import white, white_as_large_as
from simgap.greybox.outliers import find_glitches, without_outliers
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records, excerpts, is_cut
from simgap.greybox.signal_scales import scales_of
from simgap.greybox.terms import PlantScales
from simgap.records import Channels, Experiment

# A machine has records of many conditions, and a search sees whole ones, so that each begins at rest.
SEARCH_SAMPLES = 12_000
HELD_OUT_SAMPLES = 18_000
LONG = 2_000  # samples of a record that is cut in pieces instead
FINALISTS = 2
ORDERS = {"position": 2, "velocity": 1, "level": 1}


def find_machine_baseline(
    train: Sequence[Experiment], valid: Sequence[Experiment], channels: Channels, outputs: Sequence[int], n_init: int
) -> Baseline:
    """Fit the plain model of a known machine to some of the experiments. Raises UnusableInput."""
    check_numbers([*train, *valid], channels)
    chosen = spread(train)
    records = Records.of(chosen, outputs)
    # What the search does not see of the training runs judges it too: few validation runs know few conditions.
    unseen = spread([x for x in train if not any(x is one for one in chosen)], HELD_OUT_SAMPLES)
    unseen = [x for x in unseen if not any(_overlap(x, one) for one in chosen)]
    held_out = Records.of([*spread(valid), *unseen], outputs) if valid or unseen else records
    machine = machine_of(channels, Records.of(train, outputs).u[:, :1])
    kind = channels.outputs[outputs[0]].kind
    plant = Plant(kind, ORDERS[kind], records.u.shape[2], records.dt, machine=machine)
    plain = fit_machine(plant, records)
    # Bad readings are few, so that all records are asked for them.
    every = Records.of(train, outputs)
    outliers = [] if records.steps.any() else find_glitches(errors_on(plain, every, n_init), every.mask)
    if outliers:
        records = without_outliers(records, plain.errors, outliers)
        held_out = (
            without_outliers(held_out, errors_on(plain, held_out, n_init), outliers) if valid or unseen else records
        )
        plain = fit_machine(plant, records)
    # A run in which the machine sticks must not bend the model of all others.
    soft = 1.4826 * float(np.median(np.abs(plain.errors[records.mask])))
    records, held_out = replace(records, soft=soft), replace(held_out, soft=soft)
    plain = fit_machine(plant, records, plain)
    plain = replace(plain, plant=replace(plant, scales=machine_scales(plain, records, channels, outputs)))
    cut = is_cut(chosen, train)
    return Baseline(records, held_out, tuple(outputs), plain, n_init, cut, tuple(outliers))


def spread(experiments: Sequence[Experiment], samples: int = SEARCH_SAMPLES) -> list[Experiment]:
    """Take whole experiments, evenly spread, of those that are not long."""
    if not experiments:
        return []
    wanted = max(2, samples * len(experiments) // sum(map(len, experiments)))
    if max(map(len, experiments)) > LONG:
        return excerpts(experiments, samples)
    if len(experiments) <= wanted:
        return list(experiments)
    return [experiments[i] for i in np.unique(np.linspace(0, len(experiments) - 1, wanted).round().astype(int))]


def _overlap(one: Experiment, other: Experiment) -> bool:
    """Tell whether two pieces are of one run and share samples."""
    apart = abs(one.since - other.since) > one.dt * (len(one if one.since < other.since else other) - 0.5)
    return one.name == other.name and not apart


def fit_machine(plant: Plant, records: Records, start: Estimate | None = None) -> Estimate:
    """Fit a machine without effects from `start`, or the best of a grid of its frequency, damping and inertia."""
    machine = plant.machine
    assert machine is not None
    problem = Problem(plant, records, white(np.maximum(np.std(records.y[records.mask], axis=0), records.rounding)))
    if start is not None:
        return _weighed(descend(problem, start.theta, start.local), records)
    gain = np.arange(plant.size) == plant.layout.gains.start
    tried = []
    for theta in _grid(machine, plant, records):
        fixed = np.ones(plant.size, dtype=bool) if machine.controlled else ~gain
        tried.append(descend(problem, theta, fixed=fixed, max_steps=2))
    tried.sort(key=lambda fit: fit.squares)
    return _weighed(best_descent(problem, [(fit.theta, fit.local) for fit in tried[:FINALISTS]]), records)


def _weighed(fit: Estimate, records: Records) -> Estimate:
    """Count the squares in units of the errors' own size, as those of all models with effects are counted."""
    noise = white_as_large_as(fit.errors, records.mask, records.resolution)
    return replace(fit, squares=Problem(fit.plant, records, noise).squares(fit.errors))


def _grid(machine: Machine, plant: Plant, records: Records) -> Iterator[Float[np.ndarray, " p"]]:
    """Yield first estimates: loops (or springs) from slow to as fast as the sampling shows, little and well damped."""
    known = machine.start()
    slow, fast = 2 / records.duration, 0.7 / records.dt
    free = plant.free
    for share in (0.1, 1.0) if machine.moment and free[INERTIA] else (1.0,):
        for rate in np.geomspace(slow, fast, 6):
            for ratio in (0.3, 1.0):
                theta = np.append(known, 1.0)
                if free[INERTIA]:
                    theta[INERTIA] = share * (machine.moment or 1.0)
                total = (theta[INERTIA] + machine.moment) * machine.known.radian
                if free[DAMPING]:
                    theta[DAMPING] = (2 * ratio * rate if plant.order > 1 else rate) * total
                if machine.controlled:
                    theta[len(NAMES)] = rate * rate * total / machine.drive
                elif free[STIFFNESS] and plant.order > 1:
                    theta[STIFFNESS] = rate * rate * total
                yield theta


def machine_scales(plain: Estimate, records: Records, channels: Channels, outputs: Sequence[int]) -> PlantScales:
    """Measure the scales of the signals, of the command of a controller inside too, as the input after the last."""
    plant, machine = plain.plant, plain.plant.machine
    assert machine is not None
    problem = Problem(plant, records, white(records.sizes))
    scales = scales_of(plain, problem, channels, outputs)
    known, unit = machine.known, machine.units[0]
    inputs = [replace(one, force=unit, order=plant.order) for one in scales.inputs]
    of_outputs = [replace(one, force=unit) for one in scales.outputs]
    if machine.controlled:
        x = problem.simulator.motion(plain.theta, plain.local)[0]
        error = records.u[:, :, machine.of_drive] * known.goal_factor - x
        command = machine.column(records.u, known.gain, 1.0) * error
        on = records.u[:, :, machine.names.index(known.enabled)] > 0 if known.enabled else np.ones_like(records.mask)
        mask = records.mask & on
        torque = plain.theta[len(NAMES)] * machine.column(records.u, known.supply, 1.0) * command
        size = float(np.sqrt(np.mean(torque[mask] ** 2))) or 1.0
        c = command[mask]
        inputs = [replace(one, force_rms=size) for one in inputs]
        of_outputs = [replace(one, force_rms=size) for one in of_outputs]
        inputs.append(
            replace(
                inputs[machine.of_drive], u_low=float(c.min()), u_high=float(c.max()),
                u_rms=float(np.sqrt(np.mean(c * c))), x_max=float(np.max(np.abs(error[mask]))), commanded=True,
                u_unit=outputs_unit(channels, machine),
            )
        )  # fmt: skip
    return PlantScales(tuple(inputs), tuple(of_outputs))


def outputs_unit(channels: Channels, machine: Machine) -> str:
    """Return the unit of a controller's command: that of the error, times that of the gain where it has one."""
    gain = machine.known.gain
    unit = channels.inputs[machine.names.index(gain.column)].unit if gain is not None and gain.column else ""
    return f"{unit} {channels.outputs[0].unit}".strip()
