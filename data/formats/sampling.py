"""The time column of a table: checked against the sampling time, or the source of it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from simgap.data.formats.clock import Clock, read_clock
from simgap.data.formats.tables import Table
from simgap.records import UnusableInput

STEP_TOLERANCE = 0.1  # of dt, for each step
DRIFT_TOLERANCE = 0.01  # of dt, for the mean step
ROUNDING = 1e-9  # of a tolerance: a clock that counts whole milliseconds may be off by just 10 % of 10 ms
GAP = 1.5  # usual steps that are a gap between samples of an even clock
OFTEN_BACK = 0.1  # of all steps; pieces of a record that begins anew so often have less than ten rows
OFTEN_STILL = 0.05  # of all steps
FEW = 2  # steps that are not often, however short the record is
DIGITS = 12  # of a sampling time that is read off a clock

BY_HAND = "split the record there, resample it evenly, or correct the sampling time"
SORT = "sort the rows by this column"


def check_time(table: Table, column: str, dt: float) -> None:
    """Raise UnusableInput unless every step is dt to 10 % and the mean step is dt to 1 %."""
    check_clock(read_clock(table, column), dt, BY_HAND)


def check_clock(clock: Clock, dt: float, remedy: str = "") -> None:
    """Raise UnusableInput unless time runs forward in steps of dt; the remedy is by default the option that helps."""
    check_order(clock, remedy)
    check_even(clock, dt, remedy)


def check_even(clock: Clock, dt: float, remedy: str = "") -> None:
    """Raise UnusableInput unless every step is dt to 10 % and the mean step is dt to 1 %."""
    t = clock.seconds
    if len(t) < 2:
        return
    check_steps(clock, dt, remedy)
    _check_mean(clock, dt, DRIFT_TOLERANCE * dt)


def check_coarse(clock: Clock, dt: float) -> None:
    """Raise UnusableInput unless a coarse clock runs forward, without a gap, and agrees with dt to 1 % or one stamp."""
    steps = np.diff(clock.seconds)
    if np.any(steps < 0):
        raise refuse_step(clock, int(np.argmax(steps < 0)), dt, "split the file there")
    if np.any(steps > 0):
        stamps = np.flatnonzero(steps > 0)  # the last row before each new stamp
        late = steps[stamps[1:]] - dt * np.diff(stamps)  # rows that are missing between two new stamps
        if np.any(gap := late > GAP * dt + 0.5 * np.median(steps[stamps])):
            raise refuse_step(clock, int(stamps[1:][np.argmax(gap)]), dt, "rows are missing there: split the file")
        _check_mean(clock, dt, DRIFT_TOLERANCE * dt + float(np.median(steps[steps > 0])) / len(steps))


def _check_mean(clock: Clock, dt: float, tolerance: float) -> None:
    t = clock.seconds
    mean = (t[-1] - t[0]) / (len(t) - 1)
    if abs(mean - dt) > tolerance:
        why = f"time advances {mean:.6g} s a row where the sampling time is {dt:.6g} s; correct one of them"
        raise clock.table.refuse(len(t) - 1, clock.column, why)


def is_coarse(clock: Clock) -> bool:
    """Tell whether many rows share a time stamp, of a clock that goes back now and then at most."""
    steps = np.diff(clock.seconds)
    return _is_often(steps == 0, OFTEN_STILL) and not _is_often(steps < 0, OFTEN_BACK)


def check_order(clock: Clock, remedy: str = "") -> None:
    """Raise UnusableInput where the rows are out of order, or many share a time stamp: no option mends steps there."""
    steps = np.diff(clock.seconds)
    back, still = steps < 0, steps == 0
    if 10 * back.sum() >= 9 * len(steps) > 0:
        now = f"from {clock.shown(0)}{clock.unit} in the first row to {clock.shown(-1)}{clock.unit} in the last"
        raise clock.table.refuse(1, clock.column, f"time runs backwards, {now}; reverse the order of the rows")
    if _is_often(back, OFTEN_BACK):
        i = int(np.flatnonzero(back)[0])
        now = f"from {clock.shown(i)} to {clock.shown(i + 1)}{clock.unit}, and in {back.sum() - 1} more rows"
        raise clock.table.refuse(i + 1, clock.column, f"time goes back {now}; {SORT}")
    if _is_often(still, OFTEN_STILL):
        i = int(np.flatnonzero(still)[0])
        now = f"at {clock.shown(i)}{clock.unit}, and in {still.sum() - 1} more rows"
        mean = (clock.seconds[-1] - clock.seconds[0]) / len(steps)
        about = f", about {mean:.2g} s by this clock" if mean > 0 else ""
        give = f"give the true sampling time{about} (--dt, or dt=.. in Python)"
        help_ = "leave time out of dataset.toml" if remedy else give
        raise clock.table.refuse(i + 1, clock.column, f"time stands still {now}: the clock is too coarse; {help_}")


def _is_often(these: Bool[np.ndarray, " S"], share: float) -> bool:
    count = int(these.sum())
    return count > max(FEW, share * len(these)) or 2 * count > len(these)


def sampling_time(clock: Clock) -> float:
    """Take the mean step of the clock, s. Raises UnusableInput when time is uneven."""
    t = clock.seconds
    usual = usual_step(clock)
    check_order(clock)
    check_steps(clock, usual)
    return rounded((t[-1] - t[0]) / (len(t) - 1), clock.resolution / (len(t) - 1))


def usual_step(clock: Clock) -> float:
    """Take the median step of the clock, s. Raises UnusableInput for a single row."""
    if len(clock.seconds) < 2:
        raise UnusableInput(f"{clock.table.source}: one row has no time step; record more samples")
    return float(np.median(np.diff(clock.seconds)))


def rounded(step: float, uncertain: float) -> float:
    """Round a step to the fewest digits that its uncertainty allows, 12 at most.

    So 0.05 rather than the 0.04999999999999999 that a sum of decimals leaves, and 0.01 rather than the 0.0100000001
    that is left of the seconds since 1970.
    """
    for digits in range(1, DIGITS):
        if abs(float(f"{step:.{digits}g}") - step) <= uncertain:
            return float(f"{step:.{digits}g}")
    return float(f"{step:.{DIGITS}g}")


def check_steps(clock: Clock, dt: float, remedy: str = "") -> None:
    """Raise UnusableInput unless every step is dt to 10 %; the remedy is by default the option that helps."""
    steps = np.diff(clock.seconds)
    wrong = _wrong(steps, dt, clock.resolution)
    if wrong.size:
        sortable = np.any(steps < 0) and not _wrong(np.diff(np.sort(clock.seconds)), dt, clock.resolution).size
        raise refuse_step(clock, int(wrong[0]), dt, SORT if sortable else remedy)


def _wrong(steps: Float[np.ndarray, " S"], dt: float, resolution: float) -> Int[np.ndarray, " W"]:
    if dt <= 0:
        return np.flatnonzero(steps <= 0)
    tolerance = STEP_TOLERANCE * dt * (1 + ROUNDING) + 2 * resolution
    return np.flatnonzero(~((steps > 0) & (np.abs(steps - dt) <= tolerance)))


def refuse_step(clock: Clock, i: int, dt: float, remedy: str = "") -> UnusableInput:
    """Make the error about the step from row i to the next where one of dt is due."""
    step = clock.seconds[i + 1] - clock.seconds[i]
    split = "--split-gaps starts a new experiment there (split_gaps=True in Python)"
    resample = f"--resample {dt:.2g} interpolates onto an even grid (resample=.. in Python)"
    now = f"{clock.shown(i)} to {clock.shown(i + 1)}{clock.unit}"
    if step == 0:
        what, help_ = (
            f"time stands still at {clock.shown(i)}{clock.unit}",
            "delete the repeated row or correct its time",
        )
    elif step < 0:
        what, help_ = f"time goes back from {now}", split
    else:
        what, help_ = f"time goes from {now} where a step of {dt:.6g} s is due", f"{split}, {resample}"
        help_ = help_ if step > GAP * dt else resample
    return clock.table.refuse(i + 1, clock.column, f"{what}; {remedy or help_}")
