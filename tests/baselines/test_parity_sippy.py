"""ARMAX beside SIPPY's three methods: who finds the lower prediction error on the same data?"""

import contextlib
import io
import warnings

import numpy as np
import pytest

from simgap.baselines.armax import Armax

METHODS = ("ILLS", "RLLS", "OPT")


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


def best_of_sippy(sippy, record, cost) -> float:
    return min(cost(by_sippy(sippy, record, method)) for method in METHODS)


def excess(sippy, record) -> float:
    """How far our prediction error is above SIPPY's lowest, relative; negative where it is below."""
    model = Armax(record.na, record.nb, record.nc, offset=False)
    model.fit(record.training_set, 0)
    return record.cost(model.result.rows[0].values) / best_of_sippy(sippy, record, record.cost) - 1


def test_sippy_never_finds_a_lower_prediction_error(sippy, random_armax):
    above = {seed: excess(sippy, random_armax(seed)) for seed in range(12)}
    assert max(above.values()) <= 1e-9, above


@pytest.mark.slow
def test_sippy_never_finds_a_lower_prediction_error_on_300_systems(sippy, random_armax):
    above = {seed: excess(sippy, random_armax(seed)) for seed in range(300)}
    assert max(above.values()) <= 1e-9, above
