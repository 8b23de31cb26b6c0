"""When a larger model is believed: by likelihood, by what it explains, and by what it forecasts."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from .building import (
    best_of_round,
    by_the_other_half,
    candidates,
    chances,
    cut_in_pieces,
    detrended,
    names_of,
    of_single_experiments,
    plain_search,
    ranked,
    samples_held_out,
    score_of_trial,
    significant,
    trial,
    with_effects,
)
from .parts import experiments
from .plants import free_run, steps, velocity

FALSE_NAMES = 1e-3  # the chance, over the whole catalogue, that noise passes for an effect
WAYS = 2  # by one-step errors, or by free runs
LIKELY = 1000.0  # a log-likelihood ratio beyond doubt
BETTER = np.full(20, 0.5)  # held-out blocks that beat those of a trial, which are 1


def searched(load, seed=0, limit=np.inf, rate=1.5):
    rng = np.random.default_rng(seed)
    u = steps(rng, (4, 120), low=-0.6)
    y = free_run(velocity(rate), np.clip(u + load, -limit, limit), 0.1)[0] + 0.05 * rng.standard_normal((4, 120, 1))
    made = experiments(u, y, 0.1)
    return plain_search(made[:3], made[3:], "velocity")


@pytest.fixture(scope="module")
def search():
    return searched(0.0)


@pytest.mark.parametrize("more", [1, 2, 3])
def test_the_likelihood_must_make_chance_over_all_effects_tried_as_rare_as_promised(search, more):
    # Bonferroni: FALSE_NAMES over the number of tries is the chance left to one chi-squared of `more` degrees.
    threshold = 0.5 * chi2.isf(FALSE_NAMES / WAYS / chances(search), more)
    smaller = trial(search, parameters=2)
    for ratio, expected in ((1.001 * threshold, True), (0.999 * threshold, False)):
        larger = trial(search, squares=0.8, log_likelihood=ratio, parameters=2 + more, held_out=BETTER)
        assert significant(search, smaller, larger) is expected


def test_numbers_of_single_experiments_count_like_parameters_in_training(search):
    threshold = 0.5 * chi2.isf(FALSE_NAMES / WAYS / chances(search), 3)
    for ratio, expected in ((1.001 * threshold, True), (0.999 * threshold, False)):
        larger = trial(search, squares=0.8, log_likelihood=ratio, own=3, held_out=BETTER)
        assert significant(search, trial(search), larger) is expected


@pytest.mark.parametrize("plain_share", [1.0, 0.5])
def test_an_effect_must_explain_a_share_of_what_is_there_worth_a_name(search, plain_share):
    smaller = trial(search, squares=plain_share)
    for share, expected in ((0.0151, True), (0.0149, False)):
        larger = trial(search, squares=plain_share * (1 - share), log_likelihood=LIKELY, parameters=2, held_out=BETTER)
        assert significant(search, smaller, larger) is expected


def test_what_is_nothing_beside_the_plain_models_error_is_not_worth_a_name(search):
    smaller = trial(search, squares=0.05)  # 6.2 % of it are 0.31 % of the plain model's squares, 5.8 % are 0.29 %
    for share, expected in ((0.062, True), (0.058, False)):
        larger = trial(search, squares=0.05 * (1 - share), log_likelihood=LIKELY, parameters=2, held_out=BETTER)
        assert significant(search, smaller, larger) is expected


@pytest.mark.parametrize("memory", [0.5, 0.9])
def test_beside_others_an_effect_must_take_a_quarter_of_what_errors_remember(search, memory):
    first = {"effects": ["coulomb_friction"], "squares": 0.5}
    for share, expected in ((0.26 * memory, True), (0.24 * memory, False)):
        little = np.full(20, 0.99)
        made = {"squares": 0.5 * (1 - share), "log_likelihood": 16.0, "memory": memory, "held_out": little}
        assert significant(search, trial(search, **first), trial(search, **made)) is expected
        # The first effect of all is not judged by that, nor what takes its share of held-out errors, or of those of the
        # next sample.
        assert significant(search, trial(search, squares=0.5), trial(search, **made))
        assert significant(search, trial(search, **first), trial(search, **{**made, "held_out": BETTER}))
        assert significant(search, trial(search, **first), trial(search, **{**made, "log_likelihood": LIKELY}))


def believed(search, gains):
    """Whether a larger model with these gains of its twenty held-out blocks is."""
    smaller = trial(search, held_out=np.full(20, 9.0))
    larger = trial(search, squares=0.8, log_likelihood=LIKELY, parameters=2, held_out=9.0 - gains)
    return significant(search, smaller, larger)


@pytest.mark.parametrize(("lost", "expected"), [(8.0, True), (12.0, False)])
def test_one_block_far_off_does_not_outweigh_all_others_unless_it_loses_what_they_gain(search, lost, expected):
    assert believed(search, np.r_[np.linspace(0.4, 0.6, 19), -lost]) is expected


def test_a_gain_that_comes_and_goes_from_block_to_block_is_believed_in_one_case_of_ten(search):
    rng = np.random.default_rng(0)
    share = np.mean([believed(search, rng.standard_normal(20)) for _ in range(400)])
    assert 0.06 < share < 0.14


def test_what_simulates_held_out_data_worse_is_not_believed_however_likely(search):
    larger = trial(search, squares=0.5, log_likelihood=LIKELY, parameters=2, held_out=np.full(20, 1.01))
    assert not significant(search, trial(search), larger)


@pytest.mark.parametrize(("last", "expected"), [(0.5, True), (1.8, False)])
def test_what_held_out_records_leave_open_is_believed_if_training_records_forecast_it_of_each_other(last, expected):
    search = searched(0.0, limit=0.3)
    plain, limited = with_effects(search), with_effects(search, "input_saturation")
    before, after = (by_the_other_half(search, made) for made in (plain, limited))
    assert after.sum() < 0.5 * before.sum()
    # A held-out record that stands still three times: better, as it was, and better or worse.
    blocks = np.r_[np.full(7, 0.4), np.linspace(0.9, 1.1, 7), np.full(6, last)]
    limited = replace(limited, blocks=blocks, detrended=plain.detrended)
    assert significant(search, replace(plain, blocks=np.ones(20)), limited) is expected


@pytest.mark.parametrize(
    ("rate", "whole", "expected"), [(0.1, True, True), (0.1, False, False), (1.5, True, False)]
)  # an error fades in 10 s or in 0.7 s; the records last 12 s
def test_where_errors_stay_a_line_in_held_out_records_speaks_against_nothing(rate, whole, expected):
    search = searched(0.0, rate=rate)
    one = search if whole else cut_in_pieces(search)  # pieces of long records tell nothing of a drift
    made = {"squares": 0.5, "log_likelihood": LIKELY, "parameters": 2, "held_out": np.full(20, 1.5)}
    assert significant(one, trial(search), trial(search, **made, but_lines=BETTER)) is expected
    assert not significant(one, trial(search), trial(search, **made, but_lines=np.full(20, 1.01)))


def test_lines_are_taken_out_of_the_measured_samples_of_each_record():
    t = np.arange(50.0)
    waves = np.sin(t)[None, :, None] * np.array([1.0, 2.0])  # [1, T, ny]
    errors = np.concatenate([waves + 3.0 - 0.2 * t[:, None], waves - 5.0 + 0.7 * t[:, None]])
    mask = np.ones((2, 50), dtype=bool)
    mask[1, 40:] = False
    errors[1, 40:] = 0.0
    left = detrended(errors, mask)
    for k in range(2):
        for j in range(2):
            fitted = np.polyval(np.polyfit(t[mask[k]], errors[k, mask[k], j], 1), t[mask[k]])
            np.testing.assert_allclose(left[k, mask[k], j], errors[k, mask[k], j] - fitted, atol=1e-9)
    assert not left[~mask].any()


def with_errors(made, share):
    """The same trial with errors of this share of the plain model's."""
    return replace(made, estimate=replace(made.estimate, errors=share * made.estimate.errors))


@pytest.mark.parametrize("more", [1, 4])
def test_numbers_estimated_anew_from_held_out_data_must_pay_for_themselves_there(search, more):
    # Each costs half the log of the samples that it is estimated from (Schwarz); odds of 20 to 1 must be left: log 20.
    price = 0.5 * more * np.log(samples_held_out(search)) + 3.0
    assert samples_held_out(search) == 120
    smaller = trial(search, held_out_gain=-50.0)
    for gain, expected in ((price + 0.01, True), (price - 0.01, False)):
        larger = trial(search, squares=0.5, log_likelihood=LIKELY, own=3, own_there=more, held_out_gain=gain - 50.0)
        assert significant(search, smaller, with_errors(larger, 0.5)) is expected
        # A line through what wanders slowly forecasts the next sample well, and hardly makes free runs better.
        assert not significant(search, smaller, with_errors(larger, 0.99))


def test_a_trial_is_scored_by_schwarz_with_own_numbers_at_the_price_of_one_record(search):
    # 3 records of 120 samples in training: log 360 for all, log 120 for those of one record.
    made = trial(search, log_likelihood=10.0, held_out_gain=4.0, parameters=5, own=3, own_there=1)
    assert score_of_trial(made) == pytest.approx(14.0 - 2.5 * np.log(360) - 2.0 * np.log(120))


def test_of_trials_that_fit_alike_the_simplest_comes_first(search):
    best = trial(search, squares=0.5, log_likelihood=100.0, parameters=6, held_out=BETTER)
    simple = trial(search, squares=0.502, log_likelihood=90.0, parameters=3, held_out=np.ones(20))
    other = trial(search, squares=0.51, log_likelihood=80.0, parameters=2, held_out=np.ones(20))  # it fits worse
    assert ranked(search, [other, simple, best]) == [simple, best, other]


def test_without_one_that_fits_alike_the_best_score_comes_first(search):
    worse = trial(search, squares=0.6, log_likelihood=40.0, parameters=2)
    best = trial(search, squares=0.5, log_likelihood=100.0, parameters=6)
    assert ranked(search, [worse, best]) == [best, worse]
    assert ranked(search, []) == []


def test_a_load_that_is_there_is_found_and_believed():
    search = searched(0.1)
    plain, best = best_of_round(search)
    assert names_of(best) == ("constant_load",)
    assert significant(search, plain, best)


@pytest.mark.parametrize("seed", [0, 1])
def test_where_nothing_is_the_best_of_all_effects_is_not_believed(seed):
    search = searched(0.0, seed)
    assert not significant(search, *best_of_round(search))


def test_what_is_in_the_model_and_what_it_contains_are_no_candidates(search):
    assert "dead_zone" in candidates(search)
    assert "dead_zone" not in candidates(search, "dead_zone")
    assert "coulomb_friction" in candidates(search, "dead_zone")
    assert "coulomb_friction" not in candidates(search, "stribeck_friction")
    assert "outliers" not in candidates(search)  # left out by other means


def test_the_compiled_loop_holds_five_forces_and_a_sixth_is_a_candidate_only_in_the_place_of_one(search):
    four = ("constant_load", "coulomb_friction", "cubic_stiffness", "hysteresis")
    assert "quadratic_drag" in candidates(search, *four)
    with_five = candidates(search, *four, "periodic_disturbance")
    assert "quadratic_drag" not in with_five
    assert "stribeck_friction" in with_five  # instead of Coulomb friction
    assert "input_delay" in with_five


def test_in_pieces_of_experiments_biases_and_drifts_are_the_same_in_all(search):
    names = {"sensor_bias", "sensor_drift", "load_drift"}
    assert names <= of_single_experiments(search)
    assert not names & of_single_experiments(cut_in_pieces(search))
    assert names <= set(candidates(cut_in_pieces(search)))


def test_pieces_of_a_record_know_the_time_since_its_start(search):
    assert "gain_fade" in candidates(cut_in_pieces(search))


def test_a_tank_is_not_offered_what_belongs_to_bodies_nor_a_body_what_belongs_to_tanks(search):
    assert not {"sqrt_outflow", "overflow", "cubic_stiffness"} & set(candidates(search))  # only a velocity is known
