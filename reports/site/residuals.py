"""Tests of what a free run leaves: its correlation with itself and with each input, with bounds."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.fft import next_fast_len

from simgap.records import Dataset
from simgap.reports.site.curves import Chart, chart, line
from simgap.reports.site.names import plot_text
from simgap.results.artefacts import Artefact

LAGS = 25
RECORD_TO_LAG = 5  # a record shorter than so many times the largest lag says little of it

Pairs = list[tuple[np.ndarray, np.ndarray]]  # of records, each of a length of its own


def correlations(pairs: Pairs, lags: int) -> Float[np.ndarray, " L"]:
    """Correlate a(t) with b(t - k) for k = -lags .. lags over records (a [N], b [N]), each without its mean.

    r(k) = sum_t a(t) b(t - k) / sqrt(sum a^2 sum b^2), sums over all records, none of which is glued to the next.
    """
    products, of_a, of_b = np.zeros(2 * lags + 1), 0.0, 0.0
    for pair in pairs:
        a, b = (signal - signal.mean() for signal in pair)
        size = next_fast_len(len(a) + lags, real=True)
        whole = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)
        products += np.concatenate((whole[-lags:], whole[: lags + 1]))
        of_a, of_b = of_a + float(a @ a), of_b + float(b @ b)
    return products / np.sqrt(of_a * of_b) if of_a * of_b > 0 else products * 0


def bound(pairs: Pairs) -> float:
    """Compute the 95 % bound of r(k) for unrelated a and b, 1.96 sqrt(sum_k r_aa(k) r_bb(k) / N).

    Bartlett's formula (Box, Jenkins, Reinsel and Ljung 2016, section 12.1); for white b it is 1.96 / sqrt(N).
    """
    shortest = min(len(a) for a, _ in pairs)
    reach = max(1, min(shortest // 2, 500))
    own = [correlations([(x, x) for x in signal], reach) for signal in zip(*pairs, strict=True)]
    total = max(float(own[0] @ own[1]), 1.0)
    return float(1.96 * np.sqrt(total / sum(len(a) for a, _ in pairs)))


def correlation_charts(artefact: Artefact, dataset: Dataset) -> list[Chart]:
    """Draw, for each output, the error's correlation with its own past and with every input."""
    n = dataset.n_init
    known = [(e, artefact.runs[e.name]) for e in dataset.test if e.name in artefact.runs]
    known = [(e, y_hat) for e, y_hat in known if y_hat.shape == e.y[n:].shape and np.isfinite(y_hat).all()]
    if not known:
        return []
    lags = min(LAGS, min(len(y_hat) for _, y_hat in known) // RECORD_TO_LAG)
    if lags < 1:
        return []
    charts = []
    for i, output in enumerate(dataset.channels.outputs):
        errors = [e.y[n:, i] - y_hat[:, i] for e, y_hat in known]
        name = plot_text(output.name)
        own = correlations([(e, e) for e in errors], lags)[lags + 1 :]
        white = 1.96 / np.sqrt(sum(map(len, errors)))
        charts.append(_drawn(
            f"Error of {name} with its own past", np.arange(1, lags + 1), own, white,
            "For a model without an error the rest is the noise of the measurement; where that is white, the bars stay "
            "inside. Slow noise leaves them outside whatever the model.",
        ))  # fmt: skip
        for j, channel in enumerate(dataset.channels.inputs):
            pairs = [(e, x.u[n:, j]) for e, (x, _) in zip(errors, known, strict=True)]
            charts.append(_drawn(
                f"Error of {name} with input {plot_text(channel.name)}", np.arange(-lags, lags + 1),
                correlations(pairs, lags), bound(pairs),
                "Outside at lags from zero on: the input says something of the error that the model does not use.",
            ))  # fmt: skip
    return charts


def _drawn(title: str, lags: np.ndarray, values: np.ndarray, limit: float, reading: str) -> Chart:
    outside = int(np.sum(np.abs(values) > limit))
    ends = [lags[0] - 0.5, lags[-1] + 0.5]
    limits = [line(ends, [s * limit] * 2, "95 % bounds", role="bound") for s in (1, -1)]
    bars = {**line(lags, values, "correlation"), "mode": "bars"}
    about = (
        f"{outside} of {len(lags)} lags lie outside the 95 % bounds of ±{limit:.2g}, "
        f"{0.05 * len(lags):.1f} are expected by chance. {reading}"
    )
    return chart(title, "lag [samples]", "correlation", [bars, *limits], about)
