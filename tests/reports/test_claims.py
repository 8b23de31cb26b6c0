import runpy
from pathlib import Path

import pytest

from simgap.reports.paper.claim_rules import RULES
from simgap.reports.paper.claims import claims, claims_table
from simgap.reports.rendering import to_markdown

EXAMPLE = runpy.run_path(str(Path(__file__).with_name("example_paper.py")))
NOT_EVEN_THERE = "TCNs reach very low validation losses on both sets"
NOT_PRINTED = (
    "the validation loss oscillates without regularisation and is smooth with it (models 5 and 6)",
    "ARX and ARMAX have very few parameters beside any network",
    "SRNN layers stop early because their gradients vanish",
    "dropout is better avoided in the last one or two layers",
    "in small networks regularisation is counterproductive",
)
OF_CONDITIONS = (
    "models trained on the delta set learn the drift of the measurements, those trained on the contiguous set do not",
    "with much more data, TCNs could be the best of all",
    "networks need much more data to avoid overfitting",
)
PHI, PHI_DOT = "MSE of phi on contiguous set", "MSE of phi_dot on contiguous set"
REGULARISED = "GRU-LSTM-CONV1D-reg"


CONDITIONS = EXAMPLE["conditions"]()


@pytest.fixture
def figures():
    return EXAMPLE["figures"]() | EXAMPLE["conditions"]()


def judgements(*figures):
    """The claims by their texts; each of the figures are of one seed, those of the paper and of conditions together."""
    rows, crossover = [], []
    for seed, found in enumerate(figures):
        of_conditions = {label: values for label, values in found.items() if label in CONDITIONS}
        rows += EXAMPLE["rows"]({label: values for label, values in found.items() if label not in CONDITIONS}, seed)
        crossover += EXAMPLE["condition_rows"](of_conditions, seed)
    return {claim.text: claim for claim in claims(rows, crossover)}


def scaled(label, column, factor):
    """A change of figures: those of the labels that contain `label`, in the column, times the factor."""

    def change(figures):
        for name, values in figures.items():
            if label in name and column in values:
                values[column] *= factor

    return change


# How to make each claim false where it holds on the paper's figures, or true where it does not.
FLIPS = {
    "models trained on the delta set are poor on the contiguous set": scaled(" delta", PHI, 0.5),
    "SRNN layers stop learning earlier than GRU, LSTM and CONV1D layers on average": scaled("SRNN", "best epoch", 1.2),
    "GRU, LSTM and CONV1D layers are almost equally good on both sets": scaled("GRU", PHI, 1.5),
    "GRU, LSTM and CONV1D in parallel (models 5 and 6) predict surprisingly well": scaled("GRU-LSTM", PHI_DOT, 9.0),
    "model 6 predicts best on average on both sets": scaled(REGULARISED, PHI_DOT, 9.0),
    "dropout and L2 regularisation keep a larger network from overfitting (model 6 against 5)": scaled(
        REGULARISED, "MSE valid", 1.3
    ),
    NOT_PRINTED[0]: scaled(REGULARISED, "rises", 6.0),
    "decoder and encoder predict comparably well on average": scaled("Decoder", PHI, 5.0),
    "the decoder is particularly good on phi of the contiguous set": scaled("Decoder", PHI, 1.2),
    "decoder and encoder are poor on the delta set": scaled("Encoder", "MSE of phi on delta set", 0.4),
    "TCNs reach very low training losses on both sets": scaled("TCN", "MSE train", 1.5),
    NOT_EVEN_THERE: scaled("TCN", "MSE valid", 0.5),
    "on the delta set networks and ARX, ARMAX are quite comparable": scaled("AR", "MSE of phi on delta set", 10.0),
    "on the contiguous set networks definitely outperform ARX and ARMAX": scaled("ARMAX", PHI, 0.3),
    NOT_PRINTED[1]: scaled("ARX", "parameters", 100.0),
    NOT_PRINTED[2]: scaled("SRNN", "reach", 2.0),
    NOT_PRINTED[3]: scaled("GRU-LSTM-CONV1D-last", "MSE valid", 0.5),
    NOT_PRINTED[4]: scaled("small-reg", "MSE valid", 0.5),
    OF_CONDITIONS[0]: scaled("delta", "MSE of phi on gimbal-drift16", 0.2),
    OF_CONDITIONS[1]: scaled("tcn windowed", "MSE of phi on gimbal-data4", 9.0),
    OF_CONDITIONS[2]: scaled("windowed", "MSE valid on gimbal-data0.125", 0.4),
}


def test_every_claim_is_decided_by_a_rule():
    assert {text for text, _, _ in RULES} == set(FLIPS)
    assert len(RULES) == 21
    assert all(rule.__doc__ for _, _, rule in RULES)


def test_the_papers_own_figures_bear_out_what_it_claims_but_for_the_validation_losses_of_tcns(figures):
    for text, claim in judgements(figures).items():
        expected = "does not hold" if text == NOT_EVEN_THERE else "holds"
        assert claim.judgement == expected, claim
        assert claim.printed == ("cannot be told" if text in (*NOT_PRINTED, *OF_CONDITIONS) else expected)


@pytest.mark.parametrize("text", FLIPS)
def test_a_claim_flips_when_the_figures_flip(text, figures):
    before = judgements(figures)[text].judgement
    FLIPS[text](figures)
    after = judgements(figures)[text].judgement
    assert {before, after} == {"holds", "does not hold"}


@pytest.mark.parametrize("text", FLIPS)
def test_no_claim_is_decided_without_results(text):
    claim = judgements()[text]
    assert claim.judgement == "cannot be told"
    assert claim.evidence.startswith("there is no figure ")


def test_two_seeds_of_three_decide(figures):
    text, changed = "the decoder is particularly good on phi of the contiguous set", EXAMPLE["figures"]()
    FLIPS[text](changed)
    claim = judgements(figures, changed, figures)[text]
    assert (claim.judgement, claim.evidence) == ("holds", "rank 1 of 10; 2 of 3 seeds agree")
    assert judgements(changed, changed, figures)[text].judgement == "does not hold"


def test_seeds_that_disagree_decide_nothing(figures):
    text, changed = "the decoder is particularly good on phi of the contiguous set", EXAMPLE["figures"]()
    FLIPS[text](changed)
    assert judgements(figures, changed)[text].judgement == "cannot be told"


def test_seeds_that_lack_a_model_have_no_vote(figures):
    text = "the decoder is particularly good on phi of the contiguous set"
    claim = judgements(figures, {"Decoder": figures["Decoder"]})[text]
    assert (claim.judgement, claim.evidence) == ("holds", "rank 1 of 10")


def test_a_diverged_network_is_the_last_of_its_column_and_breaks_nothing(figures):
    figures["Decoder"][PHI] = figures["Decoder delta"][PHI] = float("inf")
    found = judgements(figures)
    assert found["the decoder is particularly good on phi of the contiguous set"].judgement == "does not hold"
    assert found["model 6 predicts best on average on both sets"].judgement == "holds"


def test_the_checklist_shows_judgement_evidence_and_rule():
    table = claims_table(claims(EXAMPLE["rows"](EXAMPLE["figures"]())))
    assert len(table.rows) == len(RULES)
    text = to_markdown(table)
    line = "| SRNN layers stop learning earlier than GRU, LSTM and CONV1D layers on average \\[3\\] | 4.1 | holds |"
    assert f"{line} mean best epoch 22.5, of the others 24.3 | holds |" in text
    assert "\\[3\\] The best epoch, averaged over both sets," in text
