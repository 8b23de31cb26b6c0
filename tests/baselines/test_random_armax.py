"""ARMAX on 300 random systems: does the search end, is its minimum the lowest, are the estimates efficient?"""

import numpy as np
import pytest

from simgap.baselines.armax import Armax

SYSTEMS = 300


@pytest.fixture(scope="module")
def estimated(random_armax):
    """(record, the fitted equation) of every system."""
    pairs = []
    for seed in range(SYSTEMS):
        record = random_armax(seed)
        model = Armax(record.na, record.nb, record.nc, offset=False)
        model.fit(record.training_set, 0)
        pairs.append((record, model.result.rows[0]))
    return pairs


def test_every_search_converges(estimated):
    assert [seed for seed, (_, row) in enumerate(estimated) if not row.converged] == []


def test_no_prediction_error_is_higher_than_that_of_the_true_parameters(estimated):
    higher = [s for s, (record, row) in enumerate(estimated) if record.cost(row.values) > record.cost(record.theta)]
    assert higher == []


def test_every_c_has_a_stable_inverse(estimated):
    assert all(np.abs(np.roots(r.polynomials(row.values)[2])).max() < 1 for r, row in estimated)


def test_estimates_scatter_as_little_as_the_information_in_the_data_allows(estimated):
    distances, parameters = 0.0, 0
    for record, row in estimated:
        error = row.values - record.theta
        distances += error @ record.information @ error
        parameters += len(error)
    # chi-squared with as many degrees of freedom as coefficients: the mean of 2,347 squares scatters by 3 %.
    assert distances / parameters == pytest.approx(1.0, abs=0.1)


def test_standard_errors_tell_how_far_the_estimates_are_off(estimated):
    # Between quantiles, because records of few samples with roots that nearly cancel have long tails.
    off = np.concatenate([(row.values - record.theta) / row.standard_errors for record, row in estimated])
    low, high = np.quantile(off, [0.1587, 0.8413])
    assert ((high - low) / 2) ** 2 == pytest.approx(1.0, abs=0.12)
