"""Uneven time, put right where the user asks for it: new experiments at gaps, and interpolation onto an even grid."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from simgap.data.formats.clock import Clock
from simgap.data.formats.sampling import GAP, check_clock, check_steps, rounded, usual_step
from simgap.data.formats.tables import Table
from simgap.records import Experiment, UnusableInput

GAP_IN_UNEVEN_TIME = 10  # usual steps across which nothing is interpolated
SHORTEST_PIECE = 10  # rows; a shorter piece is left out, and that is said
MOST_SAMPLES_PER_ROW = 100  # that interpolation makes
ON_THE_GRID = 1e-6  # of a step
COARSER = 1.5  # usual steps from which on a sample stands for several rows, so that it has to be their mean


def pieces_of(
    table: Table, clock: Clock, inputs: Sequence[str], outputs: Sequence[str], dt: float | None,
    resample: float | None, split_gaps: bool,
) -> tuple[tuple[Experiment, ...], tuple[str, ...]]:  # fmt: skip
    """Cut a record at its gaps, put it onto an even grid, or both; with what was done, in words.

    Raises UnusableInput where time stands still, and for what the options do not cover.
    """
    u = np.column_stack([table.numbers(column) for column in inputs])  # [T, nu]
    y = np.column_stack([table.numbers(column) for column in outputs])  # [T, ny]
    usual = dt or _positive(clock)
    widest = max(GAP_IN_UNEVEN_TIME * usual, GAP * resample) if resample else GAP * usual
    parts, said = _parts(clock, widest) if split_gaps else ([slice(0, len(u))], [])
    if resample is None:
        step = dt or _common_step(clock, parts)
        for part in parts:
            check_clock(_part(clock, part), step)
        made = [(u[part], y[part]) for part in parts]
    else:
        step, made, interpolated = resample, [], 0
        coarse = resample >= COARSER * usual
        for part in parts:
            t = _part(clock, part)
            _check_bridges(t, widest)
            _check_length(t, resample)
            grid, new = even_grid(t.seconds, resample)
            interpolated += new
            width = resample if coarse else 0.0
            made.append((_on_grid(grid, t.seconds, u[part], width), _on_grid(grid, t.seconds, y[part], width)))
        rows = sum(part.stop - part.start for part in parts)
        samples = sum(len(values) for values, _ in made)
        how = f"each the mean over {resample:g} s" if coarse else f"{interpolated} interpolated"
        said = [*said, f"{rows} rows resampled to {samples} samples every {resample:g} s, {how}"]
    names = ["record"] if len(made) == 1 else [f"piece_{k}" for k in range(1, len(made) + 1)]
    return tuple(Experiment(name, *uy, step) for name, uy in zip(names, made, strict=True)), tuple(said)


def even_grid(t: Float[np.ndarray, " T"], dt: float) -> tuple[Float[np.ndarray, " N"], int]:
    """Lay a grid of step dt from the first time on, and count its points that no row was measured at."""
    grid = t[0] + dt * np.arange(int((t[-1] - t[0]) / dt + ON_THE_GRID) + 1)  # [N]
    after = np.searchsorted(t, grid).clip(1, len(t) - 1)
    nearest = np.minimum(np.abs(t[after] - grid), np.abs(t[after - 1] - grid))
    return grid, int(np.sum(nearest > ON_THE_GRID * dt))


def _positive(clock: Clock) -> float:
    usual = usual_step(clock)
    if usual <= 0:
        check_steps(clock, usual)  # says where time stands still
    return usual


def _parts(clock: Clock, widest: float) -> tuple[list[slice], list[str]]:
    steps = np.diff(clock.seconds)
    cuts = [0, *(np.flatnonzero((steps < 0) | (steps > widest)) + 1).tolist(), len(clock.seconds)]
    every = [slice(a, b) for a, b in pairwise(cuts)]
    kept = [part for part in every if part.stop - part.start >= SHORTEST_PIECE]
    if not kept:
        raise UnusableInput(
            f"{clock.table.source}: between its gaps no piece has {SHORTEST_PIECE} rows; record without gaps"
        )
    said = [f"{len(every)} experiments of one file, cut at {len(every) - 1} gaps in column {clock.column}"]
    if short := len(every) - len(kept):
        rows = sum(part.stop - part.start for part in every) - sum(part.stop - part.start for part in kept)
        said.append(f"{short} of them of fewer than {SHORTEST_PIECE} rows left out, {rows} rows in all")
    return kept, said


def _part(clock: Clock, part: slice) -> Clock:
    """Cut a clock; its rows and cells keep their numbers in the file."""
    table = clock.table
    cells = tuple(getattr(column, "iloc", column)[part] for column in table.cells)
    rows = Table(table.source, table.names, cells, table.first_row + part.start, table.parse, table.header_row,
                 table.layout)  # fmt: skip
    return Clock(rows, clock.column, clock.seconds[part], clock.counts)


def _common_step(clock: Clock, parts: Sequence[slice]) -> float:
    t = clock.seconds
    steps = sum(part.stop - part.start - 1 for part in parts)
    total = sum(float(t[part.stop - 1] - t[part.start]) for part in parts)
    return rounded(total / steps, clock.resolution * len(parts) / steps)


def _check_bridges(clock: Clock, widest: float) -> None:
    """Raise UnusableInput where interpolation would bridge a gap, or time does not run forward."""
    steps = np.diff(clock.seconds)
    for wrong in (np.flatnonzero(steps <= 0), np.flatnonzero(steps > widest)):
        if wrong.size:
            i = int(wrong[0])
            if steps[i] <= 0:
                check_steps(_part(clock, slice(i, i + 2)), widest)
            why = f"time goes from {clock.shown(i)} to {clock.shown(i + 1)}, too far to interpolate"
            remedy = "--split-gaps starts a new experiment there (split_gaps=True in Python)"
            raise clock.table.refuse(i + 1, clock.column, f"{why}; {remedy}")


def _check_length(clock: Clock, dt: float) -> None:
    t = clock.seconds
    if len(t) < 2 or (t[-1] - t[0]) / dt > MOST_SAMPLES_PER_ROW * len(t):
        raise UnusableInput(
            f"{clock.table.source}: {len(t)} rows over {t[-1] - t[0]:.6g} s cannot be resampled every {dt:g} s; "
            f"give a longer step"
        )


def _on_grid(
    grid: Float[np.ndarray, " N"], t: Float[np.ndarray, " T"], values: Float[np.ndarray, "T n"], width: float
) -> Float[np.ndarray, "N n"]:
    """Interpolate between rows, or take the mean over `width` seconds around each point of the grid.

    Without the mean what swings faster than the grid can show would come back as a slow swing that is not there. Inputs
    and outputs get the same filter, without delay, so that what leads from one to the other stays as it is.
    """
    from scipy.interpolate import make_interp_spline  # slow to load, and few records need it

    between = make_interp_spline(t, values, k=1)
    on_grid = between(grid)
    if not width:
        return on_grid
    half = np.minimum(width / 2, np.minimum(grid - t[0], t[-1] - grid))  # shorter at both ends, and symmetric there too
    wide = half > ON_THE_GRID * width
    area, half = between.antiderivative(), half[wide]
    on_grid[wide] = (area(grid[wide] + half) - area(grid[wide] - half)) / (2 * half[:, None])
    return on_grid
