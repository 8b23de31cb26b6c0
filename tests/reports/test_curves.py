"""What is read from a learning-rate range test."""

import numpy as np

from simgap.reports.curves import LearningRates

RATES = np.logspace(-8, 0, 400)


def curve(dataset="made"):
    exponent = np.log10(RATES)
    losses = 1 - 0.9 / (1 + np.exp(-4 * (exponent + 3))) + np.where(exponent > -1, 5 * (exponent + 1), 0)
    return LearningRates("gru", dataset, RATES, losses + 0.02 * np.random.default_rng(0).standard_normal(400))


def test_the_steepest_fall_is_found_in_spite_of_noise():
    found = curve()
    assert 1e-4 < found.steepest < 1e-2
    assert found.steepest < found.lowest < 0.2
    assert "falls fastest" in str(found)


def test_the_page_holds_the_curve_and_no_script_of_a_stranger():
    page = curve("<script>alert(1)</script>").to_html()
    assert "learning rate" in page
    assert "<script>alert(1)" not in page
    assert set(curve().to_json()) == {"model", "dataset", "rates", "losses", "steepest", "lowest"}
