"""The answer of a diagnosis as one HTML page with plots, which needs nothing else and no network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from simgap import wording
from simgap.error_views.wrong import Wrong
from simgap.findings import Cause, Findings
from simgap.reports.diagnosis import figures, numbers, their_simulation, words
from simgap.reports.diagnosis.traces import choose
from simgap.reports.rendering import printable

if TYPE_CHECKING:
    import plotly.graph_objects as go

TEMPLATES = Path(__file__).parent
CONFIG = {"responsive": True, "displayModeBar": False, "displaylogo": False}
VIEWS = 3  # beside one cause


class _Plots:
    """Turns figures into parts of the page, which share one copy of plotly.js."""

    def __init__(self) -> None:
        self.count = 0

    def draw(self, figure: go.Figure | None) -> str:
        """Draw a plot as HTML, which is safe: no < in its JSON can end the script around it, plotly writes \\u003c."""
        if figure is None:
            return ""
        from plotly.io import to_html

        self.count += 1
        name = f"plot-{self.count}"  # not drawn by chance, so that the same findings give the same page
        return to_html(figure, CONFIG, full_html=False, include_plotlyjs=False, default_width="100%", div_id=name)


def diagnosis_page(findings: Findings, bar: str = "") -> str:
    """Write the whole answer: headline, gain, experiments, causes and suspects, what else the simulation gets wrong.

    Whatever comes from a data set is text there: it is escaped, in plots too, and the page may load nothing. `bar` is
    HTML that stands above the headline.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from plotly.offline import get_plotlyjs

    plots = _Plots()
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, undefined=StrictUndefined, finalize=_finalize,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    shown: set[int] = set()
    content = {
        "findings": findings,
        "bar": bar,
        "numbers": numbers,
        "wording": wording,
        "words": words,
        "theirs": their_simulation,
        "colour_of": figures.colour_of,
        "budget": plots.draw(figures.budget_figure(findings)),
        "traces": _traces(findings, plots),
        "causes": [
            _cause(cause, findings, plots, shown) | {"called": f"{called} {i} of {len(causes)}"}
            for called, causes in (("Cause", findings.causes), ("Suspect", findings.suspects))
            for i, cause in enumerate(causes, start=1)
        ],
    }
    rest = [view for view in words.beyond_chance(findings) if id(view) not in shown]
    content["views"] = [(view, _view(view, findings, plots)) for view in rest]
    return environment.get_template("diagnosis.html").render(content, plotly=get_plotlyjs() if plots.count else "")


def _finalize(value: Any) -> Any:
    """Strip what is not printable from a string on its way into the page; markup stays."""
    return printable(value) if isinstance(value, str) and not hasattr(value, "__html__") else value


def _traces(findings: Findings, plots: _Plots) -> list[dict[str, Any]]:
    picked = choose(findings.traces, bool(findings.effects))
    curves = len(picked) * figures.curves_of(findings)
    return [
        {"name": trace.experiment, "why": why, "plot": plots.draw(figures.trace_figure(trace, findings, curves))}
        for trace, why in picked
    ]


def _cause(cause: Cause, findings: Findings, plots: _Plots, shown: set[int]) -> dict[str, Any]:
    """Describe one cause with its plots. A view stands beside the first cause that it shows; `shown` collects them."""
    sensed = cause.channel if cause.channel in findings.units else cause.output
    showing = [v for v in words.beyond_chance(findings) if words.shows(v, cause) and sensed in ("", v.output)]
    views = [view for view in showing if id(view) not in shown][:VIEWS]
    above = [view for view in showing if id(view) in shown]
    shown |= {id(view) for view in views}
    estimates = {parameter.name: parameter for parameter in cause.parameters}
    profiles = [plots.draw(figures.profile_figure(p, estimates.get(p.name))) for p in cause.profiles]
    return {
        "cause": cause,
        "profiles": [plot for plot in profiles if plot],
        "views": [(view, _view(view, findings, plots)) for view in views],
        "above": above,
    }


def _view(view: Wrong, findings: Findings, plots: _Plots) -> str:
    return plots.draw(figures.view_figure(view, findings.units.get(view.output, "")))
