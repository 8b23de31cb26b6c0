"""ARMAX(2,2,2) next to SIPPY."""

import pytest

from simgap.baselines.armax import Armax


@pytest.mark.parametrize(("method", "limit"), [("OPT", 100), ("ILLS", None)])
def test_armax_next_to_sippy(method, limit, record, compare, sippy, timed):
    data = record(10_000, c=(1.0, 0.5, 0.2))
    y, u = data.train[0].y[:, 0].copy(), data.train[0].u[:, 0].copy()

    def ours():
        Armax(na=2, nb=2, nc=2, nk=1).fit(data, 0)

    def peer():
        return timed(sippy, y, u, "ARMAX", ARMAX_orders=[2, 2, 2, 0], ARMAX_mod=method)

    compare("ARMAX(2,2,2), 1e4 samples", f"SIPPY {method}", ours, peer, 5, limit)
