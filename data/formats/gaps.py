"""Uneven time, put right where the user asks for it: new experiments at gaps, and interpolation onto an even grid."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from simgap.data.formats.clock import Clock
from simgap.data.formats.sampling import GAP, check_even, check_order, check_steps, refuse_step, rounded, usual_step
from simgap.data.formats.tables import Table
from simgap.records import Experiment, UnusableInput

GAP_IN_UNEVEN_TIME = 10  # usual steps across which nothing is interpolated
SHORTEST_PIECE = 10  # rows; a shorter piece is left out, and that is said
MOST_SAMPLES_PER_ROW = 100  # that interpolation makes
ON_THE_GRID = 1e-6  # of a step
COARSER = 1.5  # usual steps from which on a sample stands for several rows, so that it has to be their mean


def pieces_of(
    table: Table, clock: Clock, inputs: Sequence[str], outputs: Sequence[str], dt: float | None,
    resample: float | None, split_gaps: bool, left_out: int = 0,
) -> tuple[tuple[Experiment, ...], tuple[str, ...]]:  # fmt: skip
    """Cut a record at its gaps and where rows were left out, put it onto an even grid, or both; and say so in words.

    Raises UnusableInput where time stands still, and for what the options do not cover.
    """
    check_order(clock)
    u = np.column_stack([table.numbers(column) for column in inputs])  # [T, nu]
    y = np.column_stack([table.numbers(column) for column in outputs])  # [T, ny]
    usual = dt or _positive(clock)
    widest = max(GAP_IN_UNEVEN_TIME * usual, GAP * resample) if resample else GAP * usual
    parts, said = _parts(clock, widest, left_out) if split_gaps else ([slice(0, len(u))], [])
    if resample is None:
        step = dt or _common_step(clock, parts)
        for part in parts:
            check_even(_part(clock, part), step)
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
    since = _since(clock, parts)
    return tuple(Experiment(name, *uy, step, s) for name, uy, s in zip(names, made, since, strict=True)), tuple(said)


def _since(clock: Clock, parts: Sequence[slice]) -> list[float]:
    """Return for how long the machine had run when each part began; where time starts again, it began to run anew."""
    t, since, began = clock.seconds, [], float(clock.seconds[0])
    last = began
    for part in parts:
        first = float(t[part.start])
        began = first if first < last else began
        since.append(first - began)
        last = float(t[part.stop - 1])
    return since


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


def _parts(clock: Clock, widest: float, left_out: int) -> tuple[list[slice], list[str]]:
    """Part the rows at gaps and where rows were left out; with how many pieces and cuts there are, in words."""
    steps = np.diff(clock.seconds)
    skips = np.diff(clock.table.rows) > 1 if clock.table.rows is not None else np.zeros(len(steps), bool)
    gaps = ((steps < 0) | (steps > widest)) & ~skips
    cuts = [0, *(np.flatnonzero(gaps | skips) + 1).tolist(), len(clock.seconds)]
    every = [slice(a, b) for a, b in pairwise(cuts)]
    kept = [part for part in every if part.stop - part.start >= SHORTEST_PIECE]
    if not kept:
        where = "missing cells and gaps" if left_out else "gaps"
        help_ = "fill the cells in, or record without gaps" if left_out else "record without gaps"
        raise UnusableInput(f"{clock.table.source}: between its {where} no piece has {SHORTEST_PIECE} rows; {help_}")
    there = f" in column {clock.column}" if clock.column else ""
    where = [counted(int(gaps.sum()), "gap") + there] if gaps.any() or not left_out else []
    where += [counted(left_out, "row") + " with missing cells"] if left_out else []
    said = [f"{counted(len(every), 'experiment')} of one file, cut at {' and at '.join(where)}"]
    if short := len(every) - len(kept):
        rows = sum(part.stop - part.start for part in every) - sum(part.stop - part.start for part in kept)
        said.append(f"{short} of them of fewer than {SHORTEST_PIECE} rows left out, {counted(rows, 'row')} in all")
    return kept, said


def counted(number: int, what: str) -> str:
    """Write how many there are of something: 1 gap, 2 gaps."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _part(clock: Clock, part: slice) -> Clock:
    """Cut a clock; its rows keep their numbers in the file."""
    return Clock(clock.table.only(part), clock.column, clock.seconds[part], clock.counts)


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
                raise refuse_step(clock, i, widest)
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
