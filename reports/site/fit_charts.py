"""What the rows of a fit show as curves: the error against the horizon, and the losses of a training."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from simgap.reports.pooling import Standing
from simgap.reports.site.curves import Chart, chart, line
from simgap.reports.site.names import plot_text


def horizon_charts(standing: Standing) -> list[Chart]:
    """Draw the RMSE of each output against the horizon of the forecast, and as a level that of the free run."""
    units = {output: row.units.get(output, "") for row in standing.rows for output in row.metrics}
    return [found for output, unit in units.items() if (found := _horizon(standing, output, unit))]


def _horizon(standing: Standing, output: str, unit: str) -> Chart | None:
    rows = [row for row in standing.rows if row.task == "forecast"]
    known = {h for row in rows for h in row.metrics.get(output, {}).get("rmse_by_horizon", {})}
    ahead = sorted(int(h) for h in known if h.isdigit())
    spreads = [spread for h in ahead if (spread := standing.rmse_at(output, str(h))) is not None]
    if len(ahead) < 2 or not all(math.isfinite(spread.median) for spread in spreads):
        return None
    steps = np.array(ahead)
    traces = [line(steps, [s.median for s in spreads], "forecast") | {"mode": "lines+markers"}]
    if any(s.low < s.high for s in spreads):
        traces += [line(steps, [getattr(s, end) for s in spreads], f"{word} seed", role="bound")
                   for end, word in (("low", "best"), ("high", "worst"))]  # fmt: skip
    words = f"{spreads[0].median:.3g} {unit} one sample ahead, {spreads[-1].median:.3g} {unit} {steps[-1]} ahead"
    free = standing.rmse(output, ())
    if free is not None and math.isfinite(free.median):
        ends = [float(steps[0]), float(steps[-1])]
        traces.append(line(ends, [free.median] * 2, "free run", role="bound", dash="dot"))
        words += f"; {free.median:.3g} {unit} in the free run"
    title = f"Error of {plot_text(output)} against the horizon"
    y = plot_text("RMSE", unit)
    return chart(title, "samples ahead", y, traces, f"RMSE: {words}.", log="x", ticks=ahead, legend=True)


def training_chart(standing: Standing) -> Chart | None:
    """Draw the losses of a network's training over its epochs, one pair of curves for each seed."""
    traces: list[dict[str, Any]] = []
    lasts = []
    fits = {row.seed: row.fitted for row in standing.rows if "train_loss" in row.fitted}
    for seed, fitted in sorted(fits.items()):
        for key, word, dash in (("train_loss", "training", "solid"), ("valid_loss", "validation", "dot")):
            losses = fitted.get(key)
            if isinstance(losses, list) and losses and all(isinstance(loss, int | float) for loss in losses):
                traces.append(line(np.arange(1, len(losses) + 1), losses, f"{word}, seed {seed}", dash=dash))
        if "best_epoch" in fitted:
            lasts.append(str(fitted["best_epoch"]))
    if not traces:
        return None
    best = f" The lowest loss on validation data: epoch {', '.join(lasts)}." if lasts else ""
    about = f"Losses of {len(fits)} training{'s' if len(fits) > 1 else ''}, on scaled data.{best}"
    return chart("Training", "epoch", "loss", traces, about, log="y", legend=len(fits) == 1)
