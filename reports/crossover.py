"""The crossover study: who wins as one condition of a simulated machine changes at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from simgap.data.named import parameters_of, usual_parameters
from simgap.records import Result
from simgap.reports.pooling import Spread, Standing, standings
from simgap.reports.tables import Cell, Table, spread_cell

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEWEST = 3  # data sets that differ in their conditions make a study
RESAMPLINGS = 2000
WORDS = {
    "data": "training data, times the usual",
    "noise": "noise of the readings, times the usual",
    "friction": "Coulomb friction, times the usual",
    "drift": "drift of the readings, times the usual",
    "stiffness": "stiffness of the cable, times the usual",
    "delay": "delay of the input [s]",
    "n_init": "measured samples at the start",
}


@dataclass(frozen=True)
class Sweep:
    """The data sets in which one parameter differs, the usual one among them, by the value of it."""

    parameter: str
    datasets: dict[float, str]

    @property
    def words(self) -> str:
        """What the parameter is."""
        return WORDS.get(self.parameter, self.parameter)


def of_crossover(results: Sequence[Result]) -> bool:
    """Tell whether results are of one machine under several conditions."""
    return sum(bool(parameters_of(dataset)[1]) for dataset in {row.dataset for row in results}) >= FEWEST


def sweeps(datasets: Sequence[str]) -> list[Sweep]:
    """Collect the data sets that differ from the usual one in a single parameter, by that parameter."""
    found: dict[str, dict[float, str]] = {}
    for dataset in datasets:
        name, changed = parameters_of(dataset)
        if len(changed) == 1:
            ((parameter, value),) = changed.items()
            usual = {usual_parameters(name)[parameter]: name} if name in datasets else {}
            known = found.setdefault(parameter, usual)
            known[value] = dataset
    return [Sweep(parameter, dict(sorted(known.items()))) for parameter, known in found.items()]


def crossover_tables(results: Sequence[Result]) -> list[Table]:
    """Make the table of winners, and of each condition that changes alone one with the fits of all models."""
    found = standings(results)
    datasets = list(dict.fromkeys(s.dataset for s in found))
    return [_winners(found, datasets), *(_fits(found, sweep) for sweep in sweeps(datasets))]


def _winners(found: Sequence[Standing], datasets: Sequence[str]) -> Table:
    rows = []
    for dataset in sorted(datasets, key=_place):
        here = [s for s in found if s.dataset == dataset and math.isfinite(s.median_fit)]
        groups = [s for s in here if not _is_network(s)], [s for s in here if _is_network(s)]
        if not all(groups):
            continue
        classical, network = (max(group, key=attrgetter("median_fit")) for group in groups)
        ratio, low, high = _ratio(network, classical)
        winner = "network" if high < 1 else "classical" if low > 1 else "neither"
        cells = [Cell(text) for s in (classical, network) for text in (s.model, f"{s.median_fit:.1f}")]
        rows.append([Cell(dataset), *cells, Cell(f"{ratio:.2f} ({low:.2f} to {high:.2f})"), Cell(winner)])
    columns = ["data set", "best classical", "fit %", "best network", "fit %", "error ratio", "winner"]
    notes = [
        "Error ratio: the free-run error of the network divided by that of the classical model, with its 95 % interval "
        "(bootstrap over test experiments, the squared errors of several seeds averaged). The best of each kind is "
        "taken on the test itself, which favours the kind with more models. Neither wins where the interval holds 1."
    ]
    return Table("Who wins", columns, rows, notes)


def _fits(found: Sequence[Standing], sweep: Sweep) -> Table:
    models = list(dict.fromkeys(s.model for s in found if s.dataset in sweep.datasets.values()))
    rows = []
    for model in models:
        fits = [_spread(found, model, dataset) for dataset in sweep.datasets.values()]
        rows.append([Cell(model), *(spread_cell(fit, "z.1f", failed=True) for fit in fits)])
    columns = ["model", *(f"{value:g}" for value in sweep.datasets)]
    return Table(f"Free-run fit in percent against the {sweep.words}", columns, rows)


def curves(results: Sequence[Result]) -> list[tuple[Sweep, dict[str, list[Spread]]]]:
    """Collect the fits of each model for each condition that changes alone, where all of them are known."""
    found = standings(results)
    collected = []
    for sweep in sweeps(list(dict.fromkeys(s.dataset for s in found))):
        of_model: dict[str, list[Spread]] = {}
        for model in dict.fromkeys(s.model for s in found):
            fits = [_spread(found, model, dataset) for dataset in sweep.datasets.values()]
            known = [fit for fit in fits if fit is not None and math.isfinite(fit.median)]
            if len(known) == len(fits):
                of_model[model] = known
        collected.append((sweep, of_model))
    return collected


def drawn(results: Sequence[Result], colours: Sequence[str]) -> Figure:
    """Draw one panel for each condition: the fits of the best models; a band is the range of the seeds."""
    from matplotlib.figure import Figure

    panels = curves(results)
    models = best_models(panels)[: len(colours)]
    rows = max(1, -(-len(panels) // 2))
    figure = Figure(figsize=(7.0, 2.3 * rows), layout="constrained")
    all_axes: list[Any] = list(figure.subplots(rows, 2, squeeze=False, sharey=True).flat)
    for axes, (sweep, of_model) in zip(all_axes, panels, strict=False):
        x = np.arange(len(sweep.datasets))
        for model, colour in zip(models, colours, strict=False):
            if model in of_model:
                median, low, high = np.array([(s.median, s.low, s.high) for s in of_model[model]]).T
                axes.plot(x, median, "o-", color=colour, label=model, markersize=3)
                axes.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.set_xticks(x, [f"{value:g}" for value in sweep.datasets])
        axes.set_xlabel(sweep.words, fontsize=8)
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    for axes in all_axes[len(panels) :]:
        axes.set_visible(False)
    figure.axes[0].set_ylim(0, 100)
    figure.supylabel("free-run fit [%]", fontsize=9)
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False, fontsize=8
    )
    return figure


def best_models(panels: Sequence[tuple[Sweep, dict[str, list[Spread]]]]) -> list[str]:
    """List the models by their median fit over all conditions, the best first."""
    fits: dict[str, list[float]] = {}
    for _, of_model in panels:
        for model, spreads in of_model.items():
            fits.setdefault(model, []).extend(spread.median for spread in spreads)
    return sorted(fits, key=lambda model: -float(np.median(fits[model])))


def _ratio(a: Standing, b: Standing) -> tuple[float, float, float]:
    """Divide the free-run error of one model by that of another, with the 95 % interval (Efron and Tibshirani 1993)."""
    from scipy.stats import bootstrap

    losses = _losses(a), _losses(b)

    def log_ratio(of_a: np.ndarray, of_b: np.ndarray, axis: int = -1) -> Any:
        return 0.5 * np.log(of_a.mean(axis=axis) / of_b.mean(axis=axis))

    ratio = float(np.exp(log_ratio(*losses)))
    if not math.isfinite(ratio):
        return ratio, ratio, ratio
    if len(losses[0]) < 2 or len(losses[0]) != len(losses[1]):
        return ratio, 0.0, math.inf
    found = bootstrap(
        losses, log_ratio, paired=True, n_resamples=RESAMPLINGS, method="percentile", rng=np.random.default_rng(0)
    )
    low, high = np.exp(found.confidence_interval)
    return ratio, float(low), float(high)


def _losses(standing: Standing) -> Float[np.ndarray, " E"]:
    """Average the squared error of each test experiment over outputs, each in units of its spread, and seeds."""
    rows = [row for row in standing.rows if row.task == "free_run"]
    outputs = list(rows[0].metrics)
    spreads = {o: [row.metrics[o]["std"] for row in rows if row.metrics[o].get("n_scored")] for o in outputs}
    squares = {output: np.mean(np.square(of_output)) for output, of_output in spreads.items()}
    by_experiment: dict[str, list[float]] = {}
    for row in rows:  # the error of what was not simulated is infinite
        loss = np.mean([row.metrics[output]["rmse"] ** 2 / squares[output] for output in outputs])
        by_experiment.setdefault(row.experiment, []).append(float(loss))
    return np.array([np.mean(losses) for losses in by_experiment.values()])


def _place(dataset: str) -> tuple[Any, ...]:
    """Sort by how many parameters are unusual, which ones, and their values."""
    name, changed = parameters_of(dataset)
    order = list(usual_parameters(name)) if changed else []
    return len(changed), [order.index(key) for key in changed], list(changed.values())


def _spread(found: Sequence[Standing], model: str, dataset: str) -> Spread | None:
    return next((s.fit_percent() for s in found if (s.model, s.dataset) == (model, dataset)), None)


def _is_network(standing: Standing) -> bool:
    return any(row.provenance.get("stochastic") for row in standing.rows)
