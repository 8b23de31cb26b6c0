import math
import runpy
from dataclasses import replace
from pathlib import Path

import pytest

from simgap.findings import Budget, InPieces, Value
from simgap.reports.diagnosis.numbers import interval, numbers
from simgap.reports.diagnosis.text import diagnosis_text

EXAMPLES = runpy.run_path(str(Path(__file__).with_name("example_findings.py")))
named, suspected, nothing_found, unexplained, hostile = (
    EXAMPLES[name] for name in ("named", "suspected", "nothing_found", "unexplained", "hostile")
)

CART = """\
cart: The simulation errs because of Coulomb friction (or backlash); with it the free-run error on
the test experiments falls by 38 % (33 to 43 %).

Plain linear model
  order 2
  x: free-run RMSE 1.24 mm, fit 81.2 %

What it gets wrong
  The simulation of x is 0.8 mm too high when moving forwards: 61 % of its squared error.
  The simulation of x is too high at high speed: 22 % of its squared error.

Cause 1: Coulomb friction
  Dry friction: a force of constant size against the motion.
  friction force = 6.84 mm/s^2 (6.71 to 6.97)
  It explains 91 % of the plain model's squared error in training (log-likelihood ratio 412); on
    held-out data the squared error is 62 % smaller with it than without.
  These data do not tell it from backlash - to separate them: stop and start again in the same
    direction: play is already taken up.

Runner-up
  Viscous drag; by itself it would make the held-out squared error 21 % smaller. By the
    log-likelihood of training and held-out data, less what its parameters cost, it is 35.2 behind
    the best of the causes by itself.

Free-run RMSE on the test experiments
  x: 1.24 -> 0.768 mm (-38 %)

Where the squared error of x goes: shares of the plain model's on the test experiments
    61.7 %  Coulomb friction
    13.0 %  learnable from the input, without a name
    10.0 %  floor: what repeated runs differ by
    15.3 %  unexplained

About the data
  Only 150 training samples: weak effects cannot be told from noise.

Ranges in brackets are 95 % intervals where nothing else is said. Forces are per unit of mass or
inertia, which these records do not tell.
"""


def in_one_line(text: str) -> str:
    return " ".join(text.split())


def test_a_named_cause_reads_like_this(named):
    assert diagnosis_text(named) == CART


def test_nothing_found_names_no_cause_and_no_gain(nothing_found):
    text = in_one_line(diagnosis_text(nothing_found))
    assert "cart: Nothing found:" in text
    assert "Cause 1" not in text
    assert "->" not in text


def test_what_is_learnable_without_a_name_is_not_called_hardly_anything(nothing_found):
    budget = (Budget("x", {}, 0.57, None, 0.43),)
    assert in_one_line(diagnosis_text(replace(nothing_found, budget=budget))).startswith(
        "cart: Nothing is named: no effect of the catalogue makes the plain linear model simulate these data better, "
        "although 57 % of its squared error on the test experiments can be learned from the input. Plain"
    )


def test_a_cause_that_explains_free_runs_alone_says_so(named):
    cause = replace(named.causes[0], log_likelihood_ratio=-814.0)
    assert (
        "It explains 91 % of the plain model's squared error in training, but only of free runs: the one-step errors "
        "are no likelier with it (log-likelihood ratio -814); on held-out data"
    ) in in_one_line(diagnosis_text(replace(named, causes=(cause,))))


@pytest.mark.parametrize(("kind", "said"), [("position", True), ("velocity", True), ("other", False)])
def test_only_of_motions_forces_are_per_unit_of_mass(named, kind, said):
    text = in_one_line(diagnosis_text(replace(named, kinds=dict.fromkeys(named.kinds, kind))))
    assert ("Forces are per unit of mass" in text) == said


def test_a_suspect_that_helps_a_simulation_worse_than_the_mean_says_so(suspected):
    gain = replace(suspected.gain, low=0.05, beats_mean=False)
    assert in_one_line(diagnosis_text(replace(suspected, gain=gain))).startswith(
        "cart: Suspected, not shown: Coulomb friction. The training data ask for it, but with it the simulation still "
        "errs more on the test experiments than their mean would: the free-run error falls by 11 % (5 to 27 %)."
    )


def test_a_suspect_is_called_a_suspect_with_its_gain_and_what_would_decide(suspected):
    text = in_one_line(diagnosis_text(suspected))
    assert text.startswith(
        "cart: Suspected, not shown: Coulomb friction. The training data ask for it, but the test experiments do not "
        "show that it helps: with it the free-run error falls by 11 % (-5 to 27 %). Plain linear model"
    )
    assert "Suspect 1: Coulomb friction" in text
    assert "To decide: record more and longer test experiments at several speeds, slow and fast." in text
    assert "Free-run RMSE on the test experiments, with the suspects x: 1.24 -> 1.1 mm (-11 %)" in text
    assert "Cause 1" not in text
    assert "errs because" not in text


def test_of_a_named_cause_nothing_is_left_to_decide(named):
    cause = replace(named.causes[0], confounded_with=(), deciding_experiment="record more")
    assert "To decide" not in diagnosis_text(replace(named, causes=(cause,)))


def test_a_confounded_suspect_says_its_experiment_once(suspected, named):
    confounded = named.causes[0].confounded_with
    suspect = replace(suspected.suspects[0], confounded_with=confounded, deciding_experiment=confounded[0].experiment)
    text = in_one_line(diagnosis_text(replace(suspected, suspects=(suspect,))))
    assert text.count("stop and start again in the same direction") == 1


def test_test_experiments_that_speak_against_suspects_are_said_to(suspected):
    worse = replace(suspected.gain, share=-0.04, low=-0.07, high=-0.01)
    both = (suspected.suspects[0], replace(suspected.suspects[0], title="backlash"))
    assert (
        "Nothing is named. The training data ask for Coulomb friction and backlash, but the test experiments speak "
        "against them: with them the free-run error rises by 4 % (1 to 7 %)."
    ) in in_one_line(diagnosis_text(replace(suspected, gain=worse, suspects=both)))


def test_an_interval_that_says_nothing_is_said_to_say_nothing(suspected):
    wide = replace(suspected.gain, low=-40.0, high=0.99)
    assert "falls by 11 %, in too few independent samples for an interval." in in_one_line(
        diagnosis_text(replace(suspected, gain=wide))
    )


def test_a_gain_that_only_pieces_of_the_test_records_show_is_said_of_both(named):
    pieces = InPieces(500, 0.93, 0.912, 0.941)
    kept = replace(named.gain, share=0.9, low=-40.0, high=0.99, in_pieces=pieces)
    assert kept.shown
    assert "falls by 90 %, and by 93 % (91 to 94 %) in free runs of 500 samples each." in in_one_line(
        diagnosis_text(replace(named, gain=kept))
    )
    assert kept.to_json()["in_pieces"] == {"samples": 500, "share": 0.93, "low": 0.912, "high": 0.941}
    assert not replace(kept, share=-0.1).shown
    assert not replace(kept, in_pieces=replace(pieces, low=0.4)).shown


def test_an_offer_is_called_an_offer(unexplained):
    text = in_one_line(diagnosis_text(unexplained))
    assert "Something is there, but nothing in the catalogue explains it: 27 % of" in text
    assert "An offer to look at, not a finding" in text
    assert "force ~ +1 x^3 -0.2 v" in text
    assert "explains 44 % of the squared error of x that is left in training" in text
    assert "Cause 1" not in text


def test_an_effect_of_single_experiments_says_that_it_cannot_be_forecast(named):
    slope = Value("slope, rms over experiments", "mm/s", 0.251, 0.0015, 0.644)
    cause = replace(named.causes[0], per_experiment=True, parameters=(slope,))
    text = in_one_line(diagnosis_text(replace(named, causes=(cause,))))
    assert "cannot be forecast: this is measured with the parameter estimated anew" in text
    assert "slope, rms over experiments = 0.25 mm/s (0 to 0.64 in single experiments)" in text


def test_causes_are_told_apart_by_channel_where_there_are_several(named):
    drifts = tuple(replace(named.causes[0], title="sensor drift", channel=name) for name in ("x", "v"))
    text = in_one_line(diagnosis_text(replace(named, causes=drifts, units={"x": "mm", "v": "mm/s"})))
    assert (
        "because of sensor drift (x) (or backlash) and sensor drift (v) (or backlash); with them the free-run error"
        in text
    )


def test_the_frequency_band_is_named_only_for_want_of_other_views(named):
    band = replace(named.wrong[0], view="frequency band", share=0.9, text="The error is slow.")
    assert "The error is slow." not in diagnosis_text(replace(named, wrong=(band, *named.wrong)))
    assert "The error is slow." in diagnosis_text(replace(named, wrong=(band,)))


def test_views_that_chance_explains_are_left_out(named):
    by_chance = replace(named.wrong[0], chance=0.04)
    assert "No view of its error shows more than chance" in diagnosis_text(replace(named, wrong=(by_chance,)))


def test_a_worse_simulation_is_said_to_be_worse(named):
    worse = replace(named.gain, share=-0.12, low=-0.2, high=-0.05)
    assert "error on the test experiments rises by 12 % (5 to 20 %)." in in_one_line(
        diagnosis_text(replace(named, gain=worse))
    )


def test_a_simulation_that_diverges_is_said_to_diverge(named):
    gain = replace(named.gain, before={"x": math.inf}, share=math.nan, low=math.nan, high=math.nan)
    text = diagnosis_text(replace(named, gain=gain, baseline={"order": 2, "rmse": {"x": math.inf}, "fit_percent": {}}))
    assert "x: free-run RMSE diverges" in text
    assert "x: diverges -> 0.768 mm" in text


def test_names_are_shown_and_not_obeyed(hostile):
    text = diagnosis_text(hostile)
    assert all(c.isprintable() or c == "\n" for c in text)
    assert "\x1b" not in text
    assert "[2J" in text


@pytest.mark.parametrize("width", [20, 40, 72, 100])
def test_lines_keep_to_the_width(named, width):
    assert max(map(len, diagnosis_text(named, width).splitlines())) <= width


@pytest.mark.parametrize(
    ("estimate", "shown"),
    [
        ((6.8432, 6.7112, 6.9743), ("6.84", "6.71", "6.97")),
        ((190.6, 154.4, 226.8), ("191", "154", "227")),
        ((0.0954, 0.0, 1.5), ("0.095", "0", "1.50")),
        ((0.0017575, -0.0066852, 0.0102), ("0.0018", "-0.0067", "0.0102")),
        ((1.0, 0.6175, 1.0), ("1", "0.62", "1")),
        ((1.234567e-7, 1.1e-7, 1.4e-7), ("1.23e-7", "1.10e-7", "1.40e-7")),
        ((123456789.0, 120000000.0, 126000000.0), ("1.235e8", "1.200e8", "1.260e8")),
        ((123456.0, 110000.0, 140000.0), ("123000", "110000", "140000")),
        ((2.0, math.nan, math.nan), ("2", "nan", "nan")),
    ],
)
def test_an_estimate_has_the_digits_that_its_interval_deserves(estimate, shown):
    assert numbers(*estimate) == shown


def test_a_parameter_that_was_not_estimated_has_no_interval():
    assert interval(Value("mid level", "V", 6.5, 6.5, 6.5)) == "read off the data or at its limit, not estimated"


def test_suspects_beside_a_cause_are_said_after_it(named):
    suspect = replace(named.causes[0], title="backlash", confounded_with=(), deciding_experiment="Push it slowly.")
    text = in_one_line(diagnosis_text(replace(named, suspects=(suspect,))))
    assert "Suspected besides, not shown: backlash." in text
    assert text.index("Cause 1: Coulomb friction") < text.index("Suspect 1: backlash") < text.index("To decide: Push")
    assert "with the suspects" not in text


def test_a_model_that_is_worse_than_the_mean_is_said_to_be(named):
    worse = replace(named, baseline=named.baseline | {"fit_percent": {"x": -192.1}})
    assert "fit -192.1 %: the mean is a better guess" in in_one_line(diagnosis_text(worse))
    assert "better guess" not in diagnosis_text(named)
