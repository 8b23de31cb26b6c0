"""A free run of 1e5 samples next to SysIdentPy's."""

import numpy as np

from simgap.baselines.arx import Arx


def test_free_run_next_to_sysidentpy(record, compare, sysidentpy, timed):
    data = record(100_000)
    y, u = data.train[0].y.copy(), data.train[0].u.copy()
    model, other = Arx(na=2, nb=2, nk=1), sysidentpy()
    model.fit(data, 0)
    timed(other.fit, X=u, y=y)
    np.testing.assert_allclose(model.simulate(u[None], y[None, :2])[0], other.predict(X=u, y=y[:2])[2:], atol=0.05)

    def ours():
        model.simulate(u[None], y[None, :2])

    def peer():
        return timed(other.predict, X=u, y=y[:2], steps_ahead=None)

    compare("free run, 1e5 samples", "SysIdentPy", ours, peer, 7, limit=500)
