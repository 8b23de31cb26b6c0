"""The claims of the paper's sections 3.9 and 4, each with the rule on figures that decides it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import fmean, median

from simgap.reports.paper.tables import OUTPUTS, PRINTED, Values

APART = 1.05  # within this factor there is no difference
ALIKE = 1.25  # mean squares within this factor are "comparable", RMSE within 12 %
FAR = 2.0  # beyond this factor, "definitely"

CONTIGUOUS = tuple(PRINTED[2].rows)  # labels of the networks
DELTA = dict(zip(CONTIGUOUS, PRINTED[0].rows, strict=True))  # and of the same networks trained on the delta set
SINGLE = ("GRU", "LSTM", "CONV1D")
PARALLEL, REGULARISED = "GRU-LSTM-CONV1D", "GRU-LSTM-CONV1D-reg"  # models 5 and 6
TCNS = ("TCN", "TCNs-dropout")
# Of the crossover study.
ON_WINDOWS = ("gru windowed", "decoder windowed", "tcn windowed", "inception_regularised windowed")
GRUS = ("gru windowed", "gru windowed delta")
FEWEST, MOST = "gimbal-data0.125", "gimbal-data4"


class Undecided(Exception):
    """What keeps a claim from being decided."""


@dataclass(frozen=True)
class Figures:
    """Figures by label and column: of one seed, medians of all seeds, or those that the paper prints."""

    values: Mapping[str, Values]

    def __call__(self, label: str, column: str) -> float:
        """Decide a claim on figures and say which. Raises Undecided where some are missing."""
        try:
            return self.values[label][column]
        except KeyError:
            raise Undecided(f"there is no figure '{column}' of {label}") from None


# Whether the claim holds, and the figures that say so. Its docstring is the rule that readers see.
Rule = Callable[[Figures], tuple[bool, str]]
RULES: list[tuple[str, str, Rule]] = []


def _claim(text: str, section: str) -> Callable[[Rule], Rule]:
    def keep(rule: Rule) -> Rule:
        RULES.append((text, section, rule))
        return rule

    return keep


@_claim("models trained on the delta set are poor on the contiguous set", "3.9, 4")
def _delta_poor(f: Figures) -> tuple[bool, str]:
    """On both outputs, at least 1.25 times the MSE of the same network trained on contiguous (median of the ten)."""
    phi, phi_dot = (median(_ratio(f(DELTA[k], c), f(k, c)) for k in CONTIGUOUS) for c in PRINTED[3].columns)
    return min(phi, phi_dot) >= ALIKE, f"median ratio of the MSE {phi:.3g} for phi, {phi_dot:.3g} for phi_dot"


@_claim(
    "models trained on the delta set learn the drift of the measurements, those trained on the contiguous set do not",
    "3.9, 4",
)
def _learns_drift(f: Figures) -> tuple[bool, str]:
    """16 times the drift of the recordings adds to the MSE of a GRU on contiguous data at least 1.25 times as much
    where it was trained on the delta set, on both outputs. What it adds otherwise no model can know.
    """
    ratios = []
    for output in OUTPUTS:
        added = (f(k, f"MSE of {output} on gimbal-drift16") - f(k, f"MSE of {output} on gimbal-drift0") for k in GRUS)
        contiguous, delta = added
        ratios.append(_ratio(delta, contiguous))
    return min(ratios) >= ALIKE, f"{ratios[0]:.3g} times as much for phi, {ratios[1]:.3g} for phi_dot"


@_claim("SRNN layers stop learning earlier than GRU, LSTM and CONV1D layers on average", "4.1")
def _srnn_stops(f: Figures) -> tuple[bool, str]:
    """The best epoch, averaged over both sets, of the other three is in the mean at least 1.05 times that of SRNN."""
    srnn, others = _on_both(f, "SRNN", "best epoch"), fmean(_on_both(f, k, "best epoch") for k in SINGLE)
    return APART * srnn <= others, f"mean best epoch {srnn:.3g}, of the others {others:.3g}"


@_claim("SRNN layers stop early because their gradients vanish", "4.1")
def _srnn_vanishes(f: Figures) -> tuple[bool, str]:
    """SRNN layers stop earlier (see above), and of the slope of a trained network's output at most half as much belongs
    to the older half of its window as for GRU, LSTM and CONV1D on average.
    """
    earlier, told = _srnn_stops(f)
    srnn, others = f("SRNN", "reach"), fmean(f(k, "reach") for k in SINGLE)
    return earlier and 2 * srnn <= others, f"{told}; older half {100 * srnn:.3g} %, of the others {100 * others:.3g} %"


@_claim("GRU, LSTM and CONV1D layers are almost equally good on both sets", "4.1")
def _equally_good(f: Figures) -> tuple[bool, str]:
    """On the set that they were trained on, the worst of the three has at most 1.25 times the MSE of the best."""
    delta = [_spread([f(DELTA[k], c) for k in SINGLE]) for c in PRINTED[1].columns[:2]]
    contiguous = [_spread([f(k, c) for k in SINGLE]) for c in PRINTED[3].columns]
    told = ", ".join(f"{ratio:.3g}" for ratio in delta + contiguous)
    return max(delta + contiguous) <= ALIKE, f"worst by best {told} (delta phi, phi_dot, contiguous phi, phi_dot)"


@_claim("GRU, LSTM and CONV1D in parallel (models 5 and 6) predict surprisingly well", "4.1")
def _parallel_good(f: Figures) -> tuple[bool, str]:
    """The mean rank of models 5 and 6 in the columns of Tables 2 and 4 is better than that of the single layers."""
    ranks = _mean_ranks(f)
    both, single = fmean((ranks[PARALLEL], ranks[REGULARISED])), fmean(ranks[k] for k in SINGLE)
    told = (
        f"mean rank {ranks[PARALLEL]:.3g} of model 5, {ranks[REGULARISED]:.3g} of model 6, {single:.3g} of the layers"
    )
    return both < single, told


@_claim("model 6 predicts best on average on both sets", "4.1")
def _sixth_best(f: Figures) -> tuple[bool, str]:
    """Its mean rank among the networks in the columns of Tables 2 and 4 is the lowest of all."""
    ranks = _mean_ranks(f)
    rival = min((k for k in ranks if k != REGULARISED), key=ranks.__getitem__)
    return ranks[REGULARISED] < ranks[rival], f"mean rank {ranks[REGULARISED]:.3g}; next is {rival}, {ranks[rival]:.3g}"


@_claim("dropout and L2 regularisation keep a larger network from overfitting (model 6 against 5)", "4.2")
def _overfits_less(f: Figures) -> tuple[bool, str]:
    """The ratio of validation to training MSE, averaged over both sets, is at least 1.05 times as high for model 5."""
    fifth, sixth = (
        fmean(_ratio(f(k, "MSE valid"), f(k, "MSE train")) for k in (DELTA[model], model))
        for model in (PARALLEL, REGULARISED)
    )
    return APART * sixth <= fifth, f"mean ratio {sixth:.3g} of model 6, {fifth:.3g} of model 5"


@_claim("dropout is better avoided in the last one or two layers", "4.2")
def _no_last_dropout(f: Figures) -> tuple[bool, str]:
    """With 20 % dropout before its last layer too, model 6 has at least 1.05 times the validation MSE (contiguous)."""
    last, usual = f("GRU-LSTM-CONV1D-last", "MSE valid"), f(REGULARISED, "MSE valid")
    return last >= APART * usual, f"{last:.3g} with it, {usual:.3g} without"


@_claim("in small networks regularisation is counterproductive", "4.2")
def _small_without(f: Figures) -> tuple[bool, str]:
    """Models 5 and 6 with a quarter of the features: the regularised one has at least 1.05 times the validation MSE
    (contiguous).
    """
    regularised, plain = f("small-reg", "MSE valid"), f("small", "MSE valid")
    return regularised >= APART * plain, f"{regularised:.3g} with it, {plain:.3g} without"


@_claim("the validation loss oscillates without regularisation and is smooth with it (models 5 and 6)", "4.2")
def _smoother(f: Figures) -> tuple[bool, str]:
    """The mean rise of the validation loss per epoch, relative to its lowest value, is on average at least 1.05 times
    as high for model 5.
    """
    fifth, sixth = (100 * _on_both(f, model, "rises") for model in (PARALLEL, REGULARISED))
    return APART * sixth <= fifth, f"mean rise {sixth:.3g} % per epoch in model 6, {fifth:.3g} % in model 5"


@_claim("decoder and encoder predict comparably well on average", "4.3")
def _decoder_like_encoder(f: Figures) -> tuple[bool, str]:
    """The geometric mean over the columns of Tables 2 and 4 of their MSE's ratio is between 1/1.25 and 1.25."""
    ratios = [_ratio(a, b) for a, b in zip(_scores(f, "Decoder"), _scores(f, "Encoder"), strict=True)]
    ratio = _geometric(ratios)
    return 1 / ALIKE <= ratio <= ALIKE, f"MSE of the decoder {ratio:.3g} times that of the encoder"


@_claim("the decoder is particularly good on phi of the contiguous set", "4.3")
def _decoder_on_phi(f: Figures) -> tuple[bool, str]:
    """Its MSE in Table 4 is the lowest or second lowest of the networks."""
    rank = _ranks({k: f(k, PRINTED[3].columns[0]) for k in CONTIGUOUS})["Decoder"]
    return rank <= 2, f"rank {rank} of {len(CONTIGUOUS)}"


@_claim("decoder and encoder are poor on the delta set", "Tables 1, 2")
def _poor_on_delta(f: Figures) -> tuple[bool, str]:
    """They have the two highest MSE of the networks in validation and on phi of the delta set."""
    pair = ("Decoder", "Encoder")
    columns = ("MSE valid", PRINTED[1].columns[0])
    ranks = [_ranks({k: f(DELTA[k], c) for k in CONTIGUOUS}) for c in columns]
    told = "; ".join(f"{c}: ranks {r['Decoder']} and {r['Encoder']}" for c, r in zip(columns, ranks, strict=True))
    return all(min(r[k] for k in pair) >= len(CONTIGUOUS) - 1 for r in ranks), f"{told} of {len(CONTIGUOUS)}"


@_claim("TCNs reach very low training losses on both sets", "4.4")
def _tcn_trains(f: Figures) -> tuple[bool, str]:
    """A TCN model has the lowest training MSE of the networks in Table 1, and one in Table 3."""
    found = [_tcn_ranks(f, delta, "MSE train") for delta in (True, False)]
    return all(min(ranks) == 1 for ranks in found), _told(found)


@_claim("TCNs reach very low validation losses on both sets", "4.4")
def _tcn_validates(f: Figures) -> tuple[bool, str]:
    """On average over Tables 1 and 3, the validation MSE of the TCN models ranks in the better half of the networks."""
    found = [_tcn_ranks(f, delta, "MSE valid") for delta in (True, False)]
    return fmean(found[0] + found[1]) <= len(CONTIGUOUS) / 2, _told(found)


@_claim("with much more data, TCNs could be the best of all", "4.4")
def _tcn_with_more(f: Figures) -> tuple[bool, str]:
    """With four times the recordings a TCN has the lowest MSE of four networks on windows, by the geometric mean of
    both outputs.
    """
    scores = {k: _geometric([f(k, f"MSE of {o} on {MOST}") for o in OUTPUTS]) for k in ON_WINDOWS}
    usual = {k: _geometric([f(k, f"MSE of {o} on gimbal") for o in OUTPUTS]) for k in ON_WINDOWS}
    rank, before = _ranks(scores)["tcn windowed"], _ranks(usual)["tcn windowed"]
    return rank == 1, f"rank {rank} of {len(ON_WINDOWS)} with four times the recordings, {before} with the usual ones"


@_claim("on the delta set networks and ARX, ARMAX are quite comparable", "4.5")
def _comparable_on_delta(f: Figures) -> tuple[bool, str]:
    """The MSE of the median network by the better of ARX and ARMAX: geometric mean of both outputs from 1/2 to 2."""
    ratios = [
        _ratio(median(f(DELTA[k], c) for k in CONTIGUOUS), min(f("ARX321 delta", c), f("ARMAX2221 delta", c)))
        for c in PRINTED[1].columns[:2]
    ]
    ratio = _geometric(ratios)
    return 1 / FAR <= ratio <= FAR, f"{ratios[0]:.3g} for phi, {ratios[1]:.3g} for phi_dot, together {ratio:.3g}"


@_claim("on the contiguous set networks definitely outperform ARX and ARMAX", "4.5")
def _outperform(f: Figures) -> tuple[bool, str]:
    """On both outputs, the better of ARX and ARMAX has at least twice the MSE of the median network."""
    ratios = [
        _ratio(min(f("ARX221", c), f("ARMAX3331", c)), median(f(k, c) for k in CONTIGUOUS)) for c in PRINTED[3].columns
    ]
    return min(ratios) >= FAR, f"MSE of the better one {ratios[0]:.3g} times for phi, {ratios[1]:.3g} times for phi_dot"


@_claim("ARX and ARMAX have very few parameters beside any network", "4.5")
def _few_parameters(f: Figures) -> tuple[bool, str]:
    """The largest of the four has less than a tenth of the parameters of the smallest network."""
    classical = [f(k, "parameters") for k in ("ARX321 delta", "ARMAX2221 delta", "ARX221", "ARMAX3331")]
    smallest = min(f(k, "parameters") for k in (*CONTIGUOUS, *DELTA.values()))
    told = f"{min(classical):g} to {max(classical):g}, the smallest network {smallest:g}"
    return 10 * max(classical) < smallest, told


@_claim("networks need much more data to avoid overfitting", "4.5")
def _need_more(f: Figures) -> tuple[bool, str]:
    """With an eighth of the recordings the median network on windows has at least twice the ratio of validation to
    training MSE that it has with four times as many, and ARX at most 1.25 times the MSE (geometric mean of both).
    """
    few, many = (median(_ratio(f(k, f"MSE valid on {d}"), f(k, f"MSE train on {d}")) for k in ON_WINDOWS)
                 for d in (FEWEST, MOST))  # fmt: skip
    arx = _geometric([_ratio(f("arx", f"MSE of {o} on {FEWEST}"), f("arx", f"MSE of {o} on {MOST}")) for o in OUTPUTS])
    told = f"validation by training MSE {few:.3g} with an eighth, {many:.3g} with four times as many"
    return few >= FAR * many and arx <= ALIKE, f"{told}; ARX {arx:.3g} times"


def _scores(f: Figures, model: str) -> list[float]:
    """Collect the six columns of Tables 2 and 4."""
    return [f(DELTA[model], c) for c in PRINTED[1].columns] + [f(model, c) for c in PRINTED[3].columns]


def _on_both(f: Figures, model: str, column: str) -> float:
    return fmean((f(DELTA[model], column), f(model, column)))


def _ranks(values: Mapping[str, float]) -> dict[str, int]:
    """Rank values, 1 for the lowest; equal ones share the better rank."""
    return {k: 1 + sum(other < value for other in values.values()) for k, value in values.items()}


def _mean_ranks(f: Figures) -> dict[str, float]:
    scores = {k: _scores(f, k) for k in CONTIGUOUS}
    ranks = [_ranks({k: scores[k][i] for k in scores}) for i in range(len(scores["SRNN"]))]
    return {k: fmean(r[k] for r in ranks) for k in CONTIGUOUS}


def _tcn_ranks(f: Figures, delta: bool, column: str) -> list[int]:
    ranks = _ranks({k: f(DELTA[k] if delta else k, column) for k in CONTIGUOUS})
    return [ranks[k] for k in TCNS]


def _told(found: list[list[int]]) -> str:
    (a, b), (c, d) = found
    return f"ranks of model 9 and 10: {a} and {b} on delta, {c} and {d} on contiguous, of {len(CONTIGUOUS)}"


def _spread(values: list[float]) -> float:
    return _ratio(max(values), min(values))


def _ratio(a: float, b: float) -> float:
    """Divide a by b; 1 for two that are equal, infinities and zeros too."""
    if a == b:
        return 1.0
    return a / b if b else math.inf


def _geometric(ratios: list[float]) -> float:
    return math.prod(ratios) ** (1 / len(ratios))
