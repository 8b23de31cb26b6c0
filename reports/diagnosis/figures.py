"""The plots of a diagnosis: experiments, views of the error, profiles of parameters. Colours suit light and dark."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from simgap.error_views.wrong import Wrong
from simgap.findings import Budget, Findings, Profile, Trace, Value
from simgap.reports.diagnosis import numbers
from simgap.reports.diagnosis.traces import axis_range, thin
from simgap.reports.diagnosis.words import LAST, parts_of, shorten
from simgap.reports.rendering import printable

if TYPE_CHECKING:
    import plotly.graph_objects as go

MEASURED, BEFORE, AFTER, INPUT, ERROR = "#8b919a", "#e0662b", "#1f83c6", "#5f9e6e", "#8f6fbf"
CAUSES = (AFTER, "#6bb1e0", "#155a8a", "#a5d0ee", "#0f3f61")  # of an error budget
GRID = "rgba(128, 136, 148, 0.22)"
POINTS = 2000  # of one curve
ALL_POINTS = 36_000  # of all curves of a page
CHI_SQUARED = 3.84  # 95 % point with one degree of freedom
HIGHEST = 25.0  # deviance shown
# Views whose places are counted, not measured: drawn as bars, over these names.
COUNTED = {
    "experiment": "experiment",
    "size by experiment": "experiment",
    "kind of experiment": "kind of experiment",
    "size by kind of experiment": "kind of experiment",
    "drift within experiment": "experiment, its first and second half",
}
DIRECTIONS = {-1.0: "back", 0.0: "at rest", 1.0: "forwards"}


def label(name: str, unit: str = "") -> str:
    """Write a name with its unit for plotly, which obeys some HTML in texts, so that none may be left."""
    text = shorten(printable(name)) + (f" [{shorten(printable(unit), 20)}]" if unit else "")
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def trace_figure(trace: Trace, findings: Findings, curves: int) -> go.Figure:
    """Draw one experiment: each output measured and simulated, the inputs below; `curves` are those of the page."""
    from plotly.subplots import make_subplots

    outputs, inputs = list(findings.units.items()), findings.inputs
    heights = [210] * len(outputs) + [110] * len(inputs)
    gap, head, foot = 34, 26, 44  # pixels
    total = sum(heights) + gap * (len(heights) - 1)
    figure = make_subplots(
        len(heights), 1, shared_xaxes=True, vertical_spacing=gap / total, row_heights=[float(h) for h in heights]
    )
    points = min(POINTS, ALL_POINTS // max(curves, 1))
    simulated = [("before", trace.before, BEFORE, 1.3)]
    if findings.effects:
        simulated.append(("after", trace.after, AFTER, 1.5))
    for i, (name, unit) in enumerate(outputs):
        drawn = [("measured", trace.y, MEASURED, 2.4), *simulated]
        for key, y, colour, width in drawn:
            _line(figure, i + 1, thin(trace.t, y[:, i], points), key, colour, width)
        figure.update_yaxes(range=axis_range(trace.y[:, i], [y[:, i] for _, y, _, _ in simulated]), row=i + 1, col=1)
        _heading(figure, i + 1, label(name, unit))
    for i, (name, unit) in enumerate(inputs):
        row = len(outputs) + i + 1
        _line(figure, row, thin(trace.t, trace.u[:, i], points), "input", INPUT, 1.3, shape="hv")
        _heading(figure, row, f"input {label(name, unit)}")
    figure.update_xaxes(title_text="time [s]", row=len(heights), col=1)
    figure.update_xaxes(range=[float(trace.t[0]), float(trace.t[-1])] if len(trace.t) > 1 else None)
    return _styled(figure, total + head + foot, head, foot)


def curves_of(findings: Findings) -> int:
    """Count the curves of one experiment."""
    return len(findings.units) * (3 if findings.effects else 2) + len(findings.inputs)


def view_figure(view: Wrong, unit: str) -> go.Figure | None:
    """Draw the mean error (the RMS error of bands and sizes) over the view's places; `unit` is the output's."""
    import plotly.graph_objects as go

    at, error = np.array(view.at), np.array(view.error)
    if len(at) < 2:
        return None
    size = view.view == LAST or view.view.startswith("size")
    ticks: dict[str, Any] = {"title_text": label(view.label, view.unit)}
    if view.view == "sign of velocity":
        ticks |= {"tickvals": at, "ticktext": [DIRECTIONS.get(a, f"{a:g}") for a in view.at], "title_text": "direction"}
    if view.view in COUNTED:
        few = len(at) <= 20  # then every one has a tick
        ticks |= {"title_text": COUNTED[view.view], "dtick": 1 if few else None, "nticks": None if few else 10}
    if view.view in COUNTED or view.view == "sign of velocity":
        width = 0.42 if view.view.startswith("drift") else 0.7
        curve = go.Bar(x=at, y=error, width=width, marker={"color": ERROR})
    else:
        curve = go.Scatter(x=at, y=error, mode="lines+markers", line={"color": ERROR}, marker={"size": 8})
    if view.view == LAST:
        ticks |= {"type": "log", "dtick": 1}
    figure = go.Figure(curve)
    figure.update_xaxes(**ticks)
    figure.update_yaxes(zeroline=True, zerolinecolor="rgba(128, 136, 148, 0.8)", rangemode="tozero")
    _heading(figure, 1, f"{'RMS' if size else 'mean'} error of {label(view.output, unit)}")
    return _styled(figure, 270, 26, 48)


def budget_figure(findings: Findings) -> go.Figure | None:
    """Draw a bar per output: shares of the plain model's squared error, side by side; negative ones left of zero."""
    import plotly.graph_objects as go

    figure = go.Figure()
    outputs = [budget.output for budget in findings.budget if parts_of(budget, findings)]
    for budget in findings.budget:
        for i, (part, share) in enumerate(parts_of(budget, findings)):
            if share:
                figure.add_trace(
                    go.Bar(
                        x=[100 * share], y=[label(budget.output)], orientation="h", width=0.6, name=label(part),
                        marker={"color": colour_of(budget, i)}, hovertemplate=f"{label(part)}: {numbers.share(share)}",
                    )
                )  # fmt: skip
    if not outputs:
        return None
    figure.update_layout(barmode="relative")
    figure.update_xaxes(title_text="share of the squared error [%]")
    figure.update_yaxes(autorange="reversed", automargin=True, showticklabels=len(outputs) > 1)
    return _styled(figure, 60 + 46 * len(outputs), 10, 48)


def colour_of(budget: Budget, part: int) -> str:
    """Return the colour of one part of a budget: shades of blue for causes, then learnable, floor and unexplained."""
    causes = len(budget.causes)
    return CAUSES[part % len(CAUSES)] if part < causes else (ERROR, MEASURED, BEFORE)[part - causes]


def profile_figure(profile: Profile, estimate: Value | None) -> go.Figure | None:
    """Draw the deviance over the values of one parameter; what lies below the line is the 95 % interval."""
    import plotly.graph_objects as go

    pairs = {v: d for v, d in zip(profile.values, profile.deviance, strict=True) if math.isfinite(v + d)}
    values = np.array(sorted(pairs))
    if len(values) < 3:
        return None
    deviance = np.array([pairs[v] for v in values])
    figure = go.Figure(
        go.Scatter(x=values, y=deviance, mode="lines+markers", line={"color": AFTER}, marker={"size": 6})
    )
    figure.add_hline(y=CHI_SQUARED, line={"color": MEASURED, "width": 1.2, "dash": "dash"})
    if estimate is not None and estimate.low < estimate.high:
        figure.add_vrect(estimate.low, estimate.high, fillcolor=AFTER, opacity=0.13, line_width=0, layer="below")
        figure.add_vline(x=estimate.value, line={"color": AFTER, "width": 1.2})
    figure.update_xaxes(title_text=label(profile.name, profile.unit), nticks=5)
    top = min(max(float(deviance.max()), 2 * CHI_SQUARED), HIGHEST)
    figure.update_yaxes(range=[min(0.0, float(deviance.min())) - 0.03 * top, top])
    _heading(figure, 1, "deviance")
    return _styled(figure, 230, 26, 48)


def _line(
    figure: go.Figure, row: int, curve: tuple[Any, Any], name: str, colour: str, width: float, shape: str = "linear"
) -> None:
    import plotly.graph_objects as go

    line = {"color": colour, "width": width, "shape": shape}
    figure.add_trace(go.Scatter(x=curve[0], y=curve[1], mode="lines", line=line, name=name), row=row, col=1)


def _heading(figure: go.Figure, row: int, text: str) -> None:
    """Write what the axis shows above it: beside it there is no room on a phone."""
    axis = "" if row == 1 else str(row)
    figure.add_annotation(
        text=text, showarrow=False, x=0, xref=f"x{axis} domain", xanchor="left", y=1, yref=f"y{axis} domain",
        yanchor="bottom", font={"size": 13},
    )  # fmt: skip


def _styled(figure: go.Figure, height: int, top: int, bottom: int) -> go.Figure:
    figure.update_layout(
        template="none", height=height, showlegend=False, margin={"l": 52, "r": 10, "t": top, "b": bottom},
        paper_bgcolor="rgba(0,0,0,0)", plot_bgcolor="rgba(0,0,0,0)", hovermode="closest", bargap=0.2,
        font={"family": "system-ui, -apple-system, Segoe UI, Roboto, sans-serif", "size": 12, "color": "#5b6470"},
    )  # fmt: skip
    figure.update_xaxes(gridcolor=GRID, zeroline=False, title_standoff=6)
    figure.update_yaxes(gridcolor=GRID, zerolinecolor="rgba(128, 136, 148, 0.6)", nticks=6, fixedrange=True)
    return figure
