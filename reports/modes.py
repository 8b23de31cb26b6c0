"""Two ways to use a network, side by side: with a state found from measured samples, and on windows of inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simgap.records import Result
from simgap.reports.pooling import standings
from simgap.reports.tables import Cell, Table

WINDOWED = " windowed"  # ends the label of a network that sees windows of inputs only


def modes_table(results: Sequence[Result]) -> Table | None:
    """Compare the median fit of the networks in both modes, one row per data set; None where not both were run."""
    fits = {(s.dataset, s.model): fit.median for s in standings(results) if (fit := s.fit_percent()) is not None}
    networks = sorted({model.removesuffix(WINDOWED) for _, model in fits if model.endswith(WINDOWED)})
    rows = []
    for dataset in sorted({dataset for dataset, _ in fits}):
        pairs = [
            (fits[dataset, name], fits[dataset, name + WINDOWED]) for name in networks
            if (dataset, name) in fits and (dataset, name + WINDOWED) in fits
        ]  # fmt: skip
        if not pairs:
            continue
        with_state, on_windows = np.asarray(pairs).T
        medians = float(np.median(with_state)), float(np.median(on_windows))
        rows.append([
            Cell(dataset), *(Cell(f"{m:.1f}", m, best=m == max(medians)) for m in medians),
            *(Cell(f"{best:.1f}", best) for best in (with_state.max(), on_windows.max())),
            Cell(f"{sum(a > b for a, b in pairs)} of {len(pairs)}"),
        ])  # fmt: skip
    if not rows:
        return None
    columns = ["data set", "stateful, median", "windowed, median", "stateful, best", "windowed, best", "stateful wins"]
    notes = [
        "Free-run fit in percent of the same networks in two modes. Stateful: n_init measured samples find the state, "
        "then the network runs free, trained on sequences. Windowed (the paper's): 40 samples of time and inputs in, "
        "the next outputs out, no state."
    ]
    return Table("Networks with a state and on windows", columns, rows, notes)
