"""ARMAX beside SIPPY's three methods: who finds the lower prediction error on the same data?"""

import contextlib
import io
import warnings
from functools import partial

import numpy as np
import pytest

from simgap.baselines.armax import Armax

METHODS = ("ILLS", "RLLS", "OPT")
# Our search ends where a millionth of the variance of one sample may be left to gain, of 300 samples and more.
EQUAL = 1e-8


@pytest.fixture(scope="module")
def sippy():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip("sippy_unipi", reason="SIPPY is not installed: pip install simgap[peers]")


def by_sippy(sippy, record, method: str) -> np.ndarray:
    """theta with C reflected into the unit circle, since SIPPY's may have no stable inverse and so predict nothing."""
    orders = [record.na, record.nb, record.nc, 0]
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        model = sippy.system_identification(
            record.y, record.u, "ARMAX", ARMAX_orders=orders, ARMAX_mod=method, max_iterations=200
        )
    parts = (model.DENOMINATOR, model.NUMERATOR, model.NUMERATOR_H)
    a, b, c = (np.ravel(part[0]) for part in parts)
    roots = np.roots(c[: record.nc + 1])
    size = np.maximum(np.abs(roots), 1e-12)
    inside = np.poly(np.where(size > 1, roots / size**2, roots)).real
    return np.r_[a[1 : record.na + 1], b[: record.nb], inside[1:]]


@pytest.fixture(scope="module")
def excess(sippy, random_armax):
    """How far our prediction error is above SIPPY's lowest, relative, for each definition of it; negative below."""

    def compare(seed: int) -> tuple[float, float, float]:
        record = random_armax(seed)
        model = Armax(record.na, record.nb, record.nc, offset=False)
        model.fit(record.training_set, 0)
        theirs = [by_sippy(sippy, record, method) for method in METHODS]
        costs = (record.cost, record.cost_from_zero, partial(record.cost_from_zero, skip=100))
        above = [cost(model.result.rows[0].values) / min(map(cost, theirs)) - 1 for cost in costs]
        return above[0], above[1], above[2]

    return compare


def test_sippy_never_finds_a_lower_prediction_error(excess):
    above = {seed: excess(seed)[0] for seed in range(12)}
    assert max(above.values()) <= EQUAL, above


@pytest.mark.slow
def test_sippy_never_finds_a_lower_prediction_error_on_300_systems(excess):
    above, from_zero, later = np.array([excess(seed) for seed in range(300)]).T
    assert above.max() <= EQUAL
    # Errors before the record taken as zero is what SIPPY's OPT minimises, so there it is below us by a hair, and by
    # more where that untruth is large against the noise. Once it has died out, nobody is ahead by half a percent.
    assert np.median(from_zero) < 1e-5
    assert np.mean(from_zero < 1e-3) > 0.9
    assert later.max() < 5e-3
