"""A limit between two filters: its equation, its special cases, and that it is found as one cause."""

import numpy as np
import pytest
from scipy.signal import cheby1, cheby2, lsim

from simgap.diagnosis.diagnose import diagnose
from simgap.greybox.effects.filtered_saturation import FilteredSaturation
from simgap.greybox.effects.inner_saturation import InnerSaturation
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet
from simgap.saved.archive import load_model, save_model

DT = 1e-3
RNG = np.random.default_rng


def passed(u, p, h):
    """What an input u [K] becomes."""
    return FilteredSaturation.term(u[None], np.array(p, dtype=float), h)[0]


@pytest.mark.parametrize("damping", [0.05, 0.3, 1.0, 1.0000001, 2.5])
def test_the_filter_is_one_of_third_order(damping):
    lag, second, steps = 3e-3, 2e-3, 50  # fine steps within each sample: what passes is the mean over one
    u = np.repeat(RNG(0).standard_normal(80), 1)
    u[0] = 0.0
    fine = np.repeat(u, steps)
    t = DT / steps * np.arange(len(fine) + 1)
    denominator = np.convolve([lag, 1.0], [second**2, 2 * damping * second, 1.0])
    _, w, _ = lsim(([1.0], denominator), np.append(fine, fine[-1]), t, interp=False)
    expected = 0.5 * (w[:-1] + w[1:]).reshape(-1, steps).mean(axis=1)
    ours = passed(fine, [lag, -99.0, 99.0, second, damping, 0.0, 0.0], DT / steps).reshape(-1, steps).mean(axis=1)
    assert ours == pytest.approx(expected, abs=2e-4)  # each step shows the mean over it, and the next filter sees that


def test_without_second_order_and_rounding_it_is_a_saturation_behind_a_lag():
    u = RNG(1).standard_normal((2, 300))
    simple = InnerSaturation.term(u, np.array([5e-3, -0.3, 0.4]), DT)
    assert FilteredSaturation.term(u, np.array([5e-3, -0.3, 0.4, 0.0, 0.5, 0.0, 0.0]), DT) == pytest.approx(simple)


def test_a_rounded_limit_comes_near_the_sharp_one_and_lets_its_share_pass():
    u = np.linspace(-3.0, 3.0, 601)
    sharp = passed(u, [0.0, -1.0, 1.5, 0.0, 0.5, 0.0, 0.25], DT)
    assert sharp == pytest.approx(np.clip(u, -1.0, 1.5) + 0.25 * (u - np.clip(u, -1.0, 1.5)))
    errors = [np.abs(passed(u, [0.0, -1.0, 1.5, 0.0, 0.5, r, 0.25], DT) - sharp).max() for r in (0.2, 0.02, 0.002)]
    assert errors == pytest.approx([0.75 * r * np.log(2.0) for r in (0.2, 0.02, 0.002)], rel=0.01)


@pytest.mark.parametrize("p", [
    (5e-3, -0.4, 0.5, 4e-3, 0.3, 0.1, 0.1), (0.0, -0.4, 0.5, 4e-3, 1.0, 0.1, 0.0),
    (5e-3, -9.0, 0.5, 4e-3, 2.0, 0.0, 0.2), (5e-3, -0.4, 0.5, 0.0, 0.3, 0.05, 0.1),
])  # fmt: skip
def test_an_input_passes_step_by_step_as_it_does_as_a_whole(p):
    u, cells = RNG(2).standard_normal(200), [0.0, 0.0, 0.0]
    stepped = [FilteredSaturation.step(value, list(p), 0, cells, 0, DT, k) for k, value in enumerate(u.tolist())]
    assert stepped == pytest.approx(passed(u, p, DT), abs=1e-12)


def circuit(u, limit):
    """A filter of third order, a diode, and another filter: simulated in fine steps by scipy, not by our code."""
    steps, rate = 10, 1 / DT
    fine, t = np.repeat(u, steps), DT / steps * np.arange(len(u) * steps)
    front = cheby1(3, 0.5, 2 * np.pi * 0.09 * rate, analog=True)
    back = cheby2(3, 30, 2 * np.pi * 0.1 * rate, analog=True)
    _, w, _ = lsim(front, fine, t, interp=False)
    _, y, _ = lsim(back, np.where(w > limit, limit + 0.1 * (w - limit), w), t, interp=False)
    return y[::steps]


@pytest.fixture(scope="module")
def recorded():
    """The circuit on one record, of which half is for training; noise of 0.2 %."""
    rng = RNG(5)
    u = np.convolve(rng.standard_normal(7000), np.ones(3) / 3, mode="same")
    y = circuit(u, 0.3)
    y = y + 0.002 * np.std(y) * rng.standard_normal(len(y))
    cuts = [(0, 3500), (3500, 5000), (5000, 7000)]
    train, valid, test = ((Experiment(f"e{a}", u[a:b, None], y[a:b, None], DT),) for a, b in cuts)
    channels = Channels((Channel("u", "V"),), (Channel("y", "V", "other"),))
    return Dataset("circuit", TrainingSet(train, valid, 50, channels), test, 50, channels)


@pytest.fixture(scope="module")
def answer(recorded):
    return diagnose(recorded, views_too=False)


@pytest.mark.slow
def test_a_diode_between_two_filters_is_one_cause_and_not_several(answer):
    causes = answer.findings.causes
    assert [cause.effect for cause in causes] == ["inner_saturation"]
    assert causes[0].title == FilteredSaturation.title
    assert answer.findings.gain.share > 0.8


@pytest.mark.slow
def test_it_is_saved_and_simulates_as_before(answer, recorded, tmp_path):
    save_model(answer.model, tmp_path / "circuit.simgap", recorded)
    again = load_model(tmp_path / "circuit.simgap")
    u, y = recorded.test[0].u[None], recorded.test[0].y[None, :50]
    assert np.array_equal(again.simulate(u, y), answer.model.simulate(u, y))
