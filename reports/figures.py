"""Pictures and tables to take along: SVG, PDF and LaTeX, made from stored results."""

from __future__ import annotations

import math
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simgap.records import Dataset
from simgap.reports import confusion, crossover, recovery
from simgap.reports.collection import Collection, Run
from simgap.reports.diagnosis.traces import axis_range, thin
from simgap.reports.latex import to_latex
from simgap.reports.leaderboard import all_tables, read_suites
from simgap.reports.pooling import Standing
from simgap.reports.site.names import file_names
from simgap.reports.tables import with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BEST = 6  # models of a picture of errors against the horizon
OVERLAID = 2  # models of a picture of a free run
POINTS = 2000  # of one curve
WIDTH = 6.3  # inches, the text width of an A4 page
ENDINGS = (".svg", ".pdf")
COLOURS = ("#1f83c6", "#e0662b", "#2f9e63", "#a25fc4", "#c99700", "#d6336c")


def write_figures(folder: str | Path = "results", out: str | Path | None = None, public: bool = False) -> list[Path]:
    """Write every table as LaTeX (booktabs), and as SVG and PDF: errors against the horizon, the best models' free
    runs where artefacts and data are at hand, the curves of a crossover and the confusion matrix of a recovery study.

    `out` is `<folder>/figures` by default; `public` leaves out signals of data sets without a licence. The same results
    give the same files. Returns the files. Raises UnusableInput when there are no results.
    """
    folder = Path(folder)
    collection = Collection(folder, read_suites(folder), public)
    out = folder / "figures" if out is None else Path(out)
    out.mkdir(parents=True, exist_ok=True)
    if not public and not (out / ".gitignore").exists():
        (out / ".gitignore").write_text("*\n", encoding="utf-8")  # they may hold samples that are not ours to give
    written = []
    for suite, listed in all_tables(collection).items():
        tables = {f"{suite}-{table.title}": table for table in listed}
        for title, name in file_names(tables).items():
            written.append(out / f"{name}.tex")
            written[-1].write_text(to_latex(tables[title]), encoding="utf-8")
    datasets = [(suite, dataset) for suite in collection.standings for dataset in collection.datasets]
    names = file_names([*collection.standings, *(f"{suite}-{dataset}" for suite, dataset in datasets)])
    for suite, standings in collection.standings.items():
        if crossover.of_crossover(collection.suites[suite]):
            written += _saved(crossover.drawn(collection.suites[suite], COLOURS), out / names[suite])
        for dataset in collection.datasets:
            here = sorted((s for s in standings if s.dataset == dataset), key=attrgetter("median_fit"), reverse=True)
            name = names[f"{suite}-{dataset}"]
            if figure := _horizons(here[:BEST]):
                written += _saved(figure, out / f"{name}-horizon")
            copy = collection.copy_of(dataset).dataset
            runs = [
                run for s in here if (run := collection.runs.get((suite, s.model, dataset)))
                and collection.copy_behind(run).dataset is not None
            ]  # fmt: skip
            if runs and copy is not None:
                written += _saved(_free_run(runs[:OVERLAID], copy), out / f"{name}-free-run")
    if counts := recovery.read(folder).get("counts"):
        written += _saved(confusion.drawn(counts), out / "recovery-confusion")
    return written


def _saved(figure: Figure, stem: Path) -> list[Path]:
    from matplotlib import rc_context

    files = [stem.with_name(stem.name + ending) for ending in ENDINGS]
    with rc_context({"svg.hashsalt": "simgap", "pdf.fonttype": 42}):
        for file in files:
            figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else {"CreationDate": None})
    return files


def _horizons(standings: list[Standing]) -> Figure | None:
    """Draw the RMSE of each output against the horizon, the best models of the free run."""
    from matplotlib.figure import Figure

    units = {output: row.units.get(output, "") for s in standings for row in s.rows for output in row.metrics}
    curves = {output: [(s.model, points) for s in standings if (points := _points(s, output))] for output in units}
    curves = {output: listed for output, listed in curves.items() if listed}
    if not curves:
        return None
    figure = Figure(figsize=(WIDTH, 2.6 * len(curves)), layout="constrained")
    for axes, (output, listed) in zip(_column(figure, len(curves)), curves.items(), strict=True):
        for (model, points), colour in zip(listed, COLOURS, strict=False):
            axes.plot(*zip(*points, strict=True), "o-", label=_plain(model), color=colour, markersize=3)
        axes.set_xscale("log")
        ahead = sorted({h for _, points in listed for h, _ in points})
        axes.set_xticks(ahead, [str(h) for h in ahead], minor=False)
        axes.minorticks_off()
        axes.set_ylabel(_plain(with_unit(f"RMSE of {output}", units[output])))
    figure.axes[-1].set_xlabel("samples ahead")
    _legend_above(figure)
    return figure


def _points(standing: Standing, output: str) -> list[tuple[int, float]]:
    rows = [row for row in standing.rows if row.task == "forecast"]
    known = {h for row in rows for h in row.metrics.get(output, {}).get("rmse_by_horizon", {}) if h.isdigit()}
    spreads = [(int(h), standing.rmse_at(output, h)) for h in sorted(known, key=int)]
    return [(h, spread.median) for h, spread in spreads if spread is not None and math.isfinite(spread.median)]


def _free_run(runs: list[Run], dataset: Dataset) -> Figure:
    """Draw the first test experiment: each output measured and simulated, and below it the errors."""
    from matplotlib.figure import Figure

    experiment, n = dataset.test[0], dataset.n_init
    outputs = dataset.channels.outputs
    figure = Figure(figsize=(WIDTH, 3.2 * len(outputs)), layout="constrained")
    columns = _column(figure, 2 * len(outputs), [2.0, 1.0] * len(outputs))
    t = experiment.dt * np.arange(n, len(experiment))
    for i, channel in enumerate(outputs):
        signal, error = columns[2 * i : 2 * i + 2]
        y = experiment.y[n:, i]
        signal.plot(*thin(t, y, POINTS), color="0.45", linewidth=1.6, label="measured")
        simulated = []
        for run, colour in zip(runs, COLOURS, strict=False):
            y_hat = run.artefact.runs.get(experiment.name)
            if y_hat is not None and y_hat.shape == experiment.y[n:].shape:
                simulated.append(y_hat[:, i].astype(np.float64))
                label = _plain(run.standing.model)
                signal.plot(*thin(t, simulated[-1], POINTS), color=colour, linewidth=0.9, label=label)
                error.plot(*thin(t, y - simulated[-1], POINTS), color=colour, linewidth=0.7)
        signal.set_ylim(axis_range(y, simulated))
        signal.set_ylabel(_plain(with_unit(channel.name, channel.unit)))
        error.set_ylabel("error")
    columns[-1].set_xlabel("time [s]")
    _legend_above(figure)
    return figure


def _column(figure: Figure, count: int, heights: list[float] | None = None) -> list[Axes]:
    axes = figure.subplots(
        count, 1, squeeze=False, sharex=True, gridspec_kw={"height_ratios": heights or [1.0] * count}
    )
    for one in axes[:, 0]:
        one.grid(alpha=0.3)
        one.spines[["top", "right"]].set_visible(False)
    return list(axes[:, 0])


def _legend_above(figure: Figure) -> None:
    """Name the curves above the first axes, where they hide none of them."""
    lines, names = figure.axes[0].get_legend_handles_labels()
    figure.legend(lines, names, loc="outside upper left", ncols=min(len(names), 4), frameon=False, fontsize=8)


def _plain(text: str) -> str:
    """Keep matplotlib from reading mathematics into a name."""
    return text.replace("$", r"\$")
