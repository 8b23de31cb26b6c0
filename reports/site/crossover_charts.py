"""The curves of a crossover study as charts of its page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simgap.records import Result
from simgap.reports.crossover import Sweep, best_models, curves
from simgap.reports.pooling import Spread
from simgap.reports.site.curves import Chart, chart, line
from simgap.reports.site.names import plot_text

BEST = 6  # models; those that fail everywhere would set the scale


def crossover_charts(results: Sequence[Result]) -> list[Chart]:
    """Draw the fit of the best models against each condition that changes alone."""
    panels = curves(results)
    models = best_models(panels)[:BEST]
    return [_chart(sweep, {model: of_model[model] for model in models if model in of_model})
            for sweep, of_model in panels]  # fmt: skip


def _chart(sweep: Sweep, fits: dict[str, list[Spread]]) -> Chart:
    places = np.arange(len(sweep.datasets))
    words = [f"{value:g}" for value in sweep.datasets]
    traces = [
        line(places, [spread.median for spread in of_model], plot_text(model)) | {"mode": "lines+markers"}
        for model, of_model in fits.items()
    ]
    best = [max(fits, key=lambda model: fits[model][i].median) for i in places] if fits else []
    told = ", ".join(f"{model} at {word} ({fits[model][i].median:.1f})" for i, (model, word) in
                     enumerate(zip(best, words, strict=False)))  # fmt: skip
    title = f"Fit against {sweep.parameter}"
    return chart(
        title, sweep.words, "free-run fit [%]", traces, f"The best of these: {told}.", ticks=places.tolist(),
        tick_words=words, legend=True,
    )  # fmt: skip
