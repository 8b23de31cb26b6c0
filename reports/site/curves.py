"""Curves and charts as plotly reads them: numbers as base64 of float32, long records thinned."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from simgap.reports.diagnosis.traces import thin

POINTS = 4000  # of one curve; longer ones keep the smallest and the largest value of each stretch

Chart = dict[str, Any]


def packed(values: Any) -> dict[str, str]:
    """Pack numbers as plotly's typed array; what is not finite becomes a gap."""
    array = np.asarray(values, dtype=np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        single = array.astype("<f4")
    single[~np.isfinite(single)] = np.nan
    return {"dtype": "f4", "bdata": base64.b64encode(single.tobytes()).decode()}


def curve(t: np.ndarray, y: np.ndarray) -> dict[str, Any]:
    """Pack one curve over time t = t0 + k dt; a long one is thinned and has a time for each of its points."""
    if len(y) <= POINTS:
        return {"x0": float(t[0]), "dx": float(t[-1] - t[0]) / max(len(t) - 1, 1), "y": packed(y)}
    x, y = thin(np.asarray(t, dtype=np.float64), np.asarray(y, dtype=np.float64), POINTS)
    return {"x": packed(x), "y": packed(y)}


def line(x: Any, y: Any, name: str = "", **more: Any) -> dict[str, Any]:
    """Pack one line of a chart."""
    return {"x": packed(x), "y": packed(y), "name": name, "mode": "lines", **more}


def chart(title: str, x: str, y: str, traces: list[dict[str, Any]], about: str, **more: Any) -> Chart:
    """Describe a chart: `about` says in words what it shows, for those who cannot see it and below it."""
    return {"title": title, "x": x, "y": y, "traces": traces, "about": about, **more}
