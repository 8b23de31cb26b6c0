"""Which test experiments a page shows, and long records thinned so that a plot of them still shows every peak."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from simgap.findings import Trace

Curve = tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]


def choose(traces: Sequence[Trace], named: bool) -> list[tuple[Trace, str]]:
    """Choose up to three test experiments, each with the reason why it is shown.

    With causes: the one that they improve most, one in the middle, and the one with the largest error left; without,
    those with the smallest, a middle and the largest error. Errors are in units of each output's spread.
    """
    if not traces:
        return []
    after = np.array([_error(trace, trace.after) for trace in traces])
    improvement = np.array([_error(trace, trace.before) for trace in traces]) - after if named else -after
    order = np.argsort(-np.nan_to_num(improvement, nan=0.0), kind="stable")
    worst = int(np.argmax(after))
    picked = [int(order[0]), int(order[len(order) // 2]), worst]
    if len(traces) == 1:
        return [(traces[0], "the only test experiment")]
    why = ("improved most", "improved a middling amount", "largest error left")
    reasons: dict[int, list[str]] = {}
    for i, reason in zip(picked, why if named else ("smallest error", "middling error", "largest error"), strict=True):
        reasons.setdefault(i, []).append(reason)
    return [(traces[i], ", ".join(listed)) for i, listed in reasons.items()]


def thin(t: Float[np.ndarray, " N"], y: Float[np.ndarray, " N"], points: int) -> Curve:
    """Thin a curve to at most `points` samples: the smallest and the largest of each bucket of time, in their order.

    What is not finite becomes NaN, a gap; it takes the place of others only in a bucket that holds nothing else.
    """
    y = np.where(np.isfinite(y), y, np.nan)  # [N]
    if len(y) <= points:
        return t, y
    buckets = max(points // 2, 1)
    size = -(-len(y) // buckets)
    rows = np.arange(-(-len(y) // size) * size).reshape(-1, size)  # [bucket, size], its end past the record
    inside = np.minimum(rows, len(y) - 1)
    lowest = rows[:, 0] + np.argmin(np.where(np.isnan(y), np.inf, y)[inside], axis=1)
    highest = rows[:, 0] + np.argmax(np.where(np.isnan(y), -np.inf, y)[inside], axis=1)
    kept = np.minimum(np.unique(np.concatenate([lowest, highest])), len(y) - 1)  # [n]
    return t[kept], y[kept]


def axis_range(y: Float[np.ndarray, " N"], simulated: Sequence[Float[np.ndarray, " N"]]) -> tuple[float, float] | None:
    """Find the range of the axis: the measurement, and of a simulation that leaves it at most as much again."""
    finite = y[np.isfinite(y)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    span = high - low or abs(high) or 1.0
    others = np.concatenate([y[:0], *(other[np.isfinite(other)] for other in simulated)])
    if len(others):
        others = np.clip(others, low - span, high + span)
        low, high = min(low, float(others.min())), max(high, float(others.max()))
    margin = 0.05 * (high - low or span)
    return low - margin, high + margin


def _error(trace: Trace, simulated: Float[np.ndarray, "N ny"]) -> float:
    """Compute the RMSE over all outputs, each in units of its spread; one that diverged has the largest there is."""
    spread = np.std(trace.y, axis=0)
    error = (trace.y - simulated) / np.where(spread > 0, spread, 1.0)
    if not (error.size and np.isfinite(error).all()):
        return 1e100
    scale = np.abs(error).max() or 1.0  # so that squares stay finite
    return float(min(scale * np.sqrt(np.mean((error / scale) ** 2)), 1e100))
