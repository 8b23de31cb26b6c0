"""ARX(2,2) next to Octave, SIPPY and SysIdentPy."""

import pytest

from simgap.baselines.arx import Arx

SAMPLES = pytest.mark.parametrize("samples", [100_000, 1_000_000], ids=["1e5", "1e6"])


def fitted(data):
    return lambda: Arx(na=2, nb=2, nk=1).fit(data, 0)


@SAMPLES
def test_arx_next_to_octave(samples, record, compare, octave):
    data = record(samples)
    octave.load(data)

    def peer():
        return octave.ask("tic; arx (dat, 'na', 2, 'nb', 2); disp (toc)")

    compare(f"ARX(2,2), {samples:.0e} samples", "Octave arx", fitted(data), peer, 15, limit=20)


@SAMPLES
def test_arx_next_to_sippy(samples, record, compare, sippy, timed):
    data = record(samples)
    y, u = data.train[0].y[:, 0].copy(), data.train[0].u[:, 0].copy()

    def peer():
        return timed(sippy, y, u, "ARX", ARX_orders=[2, 2, 0])

    rounds = 7 if samples == 100_000 else 3
    compare(f"ARX(2,2), {samples:.0e} samples", "SIPPY", fitted(data), peer, rounds, limit=500)


@SAMPLES
def test_arx_next_to_sysidentpy(samples, record, compare, sysidentpy, timed):
    data = record(samples)
    y, u = data.train[0].y.copy(), data.train[0].u.copy()

    def peer():
        return timed(sysidentpy().fit, X=u, y=y)

    compare(f"ARX(2,2), {samples:.0e} samples", "SysIdentPy FROLS", fitted(data), peer, 7)
