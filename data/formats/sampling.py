"""The time column of a table: checked against the sampling time, or the source of it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from simgap.data.formats.tables import Table
from simgap.records import UnusableInput

STEP_TOLERANCE = 0.1  # of dt, for each step
DRIFT_TOLERANCE = 0.01  # of dt, for the mean step


def check_time(table: Table, column: str, dt: float) -> None:
    """Raise UnusableInput unless every step is dt to 10 % and the mean step is dt to 1 %."""
    t = table.numbers(column)
    if len(t) < 2:
        return
    _check_steps(table, column, t, dt)
    mean = (t[-1] - t[0]) / (len(t) - 1)
    if abs(mean - dt) > DRIFT_TOLERANCE * dt:
        why = f"time advances {mean:.6g} s a row where the sampling time is {dt:.6g} s; correct one of them"
        raise table.refuse(len(t) - 1, column, why)


def sampling_time(table: Table, column: str) -> float:
    """Take the mean step of the time column, s, to 12 digits. Raises UnusableInput when time is uneven."""
    t = table.numbers(column)
    if len(t) < 2:
        raise UnusableInput(f"{table.source}: one row has no time step; add samples or give dt")
    usual = float(np.median(np.diff(t)))
    _check_steps(table, column, t, usual)
    mean = (t[-1] - t[0]) / (len(t) - 1)
    return float(f"{mean:.12g}")  # 0.05 rather than the 0.04999999999999999 that a sum of decimals leaves


def _check_steps(table: Table, column: str, t: Float[np.ndarray, " T"], dt: float) -> None:
    steps = np.diff(t)
    wrong = np.flatnonzero(~((steps > 0) & (np.abs(steps - dt) <= STEP_TOLERANCE * dt)))
    if not wrong.size:
        return
    i = int(wrong[0])
    if steps[i] == 0:
        what = f"time stands still at {t[i]:.9g} s"
    elif steps[i] < 0:
        what = f"time goes back from {t[i]:.9g} to {t[i + 1]:.9g} s"
    else:
        what = f"time goes from {t[i]:.9g} to {t[i + 1]:.9g} s where a step of {dt:.6g} s is due"
    why = f"{what}; split the record there, resample it evenly, or correct the sampling time"
    raise table.refuse(i + 1, column, why)
