"""The time column of a table: checked against the sampling time, or the source of it."""

from __future__ import annotations

import numpy as np

from simgap.data.formats.clock import Clock, read_clock
from simgap.data.formats.tables import Table
from simgap.records import UnusableInput

STEP_TOLERANCE = 0.1  # of dt, for each step
DRIFT_TOLERANCE = 0.01  # of dt, for the mean step
ROUNDING = 1e-9  # of a tolerance: a clock that counts whole milliseconds may be off by just 10 % of 10 ms
GAP = 1.5  # usual steps that are a gap between samples of an even clock
DIGITS = 12  # of a sampling time that is read off a clock

BY_HAND = "split the record there, resample it evenly, or correct the sampling time"


def check_time(table: Table, column: str, dt: float) -> None:
    """Raise UnusableInput unless every step is dt to 10 % and the mean step is dt to 1 %."""
    check_clock(read_clock(table, column), dt, BY_HAND)


def check_clock(clock: Clock, dt: float, remedy: str = "") -> None:
    """Raise UnusableInput unless every step is dt to 10 % and the mean step is dt to 1 %."""
    t = clock.seconds
    if len(t) < 2:
        return
    check_steps(clock, dt, remedy)
    mean = (t[-1] - t[0]) / (len(t) - 1)
    if abs(mean - dt) > DRIFT_TOLERANCE * dt:
        why = f"time advances {mean:.6g} s a row where the sampling time is {dt:.6g} s; correct one of them"
        raise clock.table.refuse(len(t) - 1, clock.column, why)


def sampling_time(clock: Clock) -> float:
    """Take the mean step of the clock, s. Raises UnusableInput when time is uneven."""
    t = clock.seconds
    check_steps(clock, usual_step(clock))
    return rounded((t[-1] - t[0]) / (len(t) - 1), clock.resolution / (len(t) - 1))


def usual_step(clock: Clock) -> float:
    """Take the median step of the clock, s. Raises UnusableInput for a single row."""
    if len(clock.seconds) < 2:
        raise UnusableInput(f"{clock.table.source}: one row has no time step; add samples or give dt")
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
    t, table = clock.seconds, clock.table
    steps = np.diff(t)
    tolerance = STEP_TOLERANCE * dt * (1 + ROUNDING) + 2 * clock.resolution
    wrong = np.flatnonzero(~((steps > 0) & (np.abs(steps - dt) <= tolerance)))
    if not wrong.size:
        return
    i = int(wrong[0])
    split = "--split-gaps starts a new experiment there (split_gaps=True in Python)"
    resample = f"--resample {max(dt, 1e-9):.2g} interpolates onto an even grid (resample=.. in Python)"
    now = f"{clock.shown(i)} to {clock.shown(i + 1)}{'' if clock.counts == 'dates' else ' s'}"
    if steps[i] == 0:
        what, help_ = f"time stands still at {now.partition(' to ')[0]}", "delete the repeated row or correct its time"
        what += "" if clock.counts == "dates" else " s"
    elif steps[i] < 0:
        what, help_ = f"time goes back from {now}", split
    else:
        what, help_ = f"time goes from {now} where a step of {dt:.6g} s is due", f"{split}, {resample}"
        help_ = help_ if steps[i] > GAP * dt else resample
    raise table.refuse(i + 1, clock.column, f"{what}; {remedy or help_}")
