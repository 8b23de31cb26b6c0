"""Where numbers end: perfect fits, what moves nothing, simulations that grow without bound, units of no machine."""

import numpy as np
import pytest

from simgap.greybox.baseline import Baseline
from simgap.greybox.data_checks import check_numbers
from simgap.greybox.linear import find_baseline
from simgap.greybox.noise import log_likelihood, schwarz_order
from simgap.greybox.normal_equations import Jacobian, NormalEquations
from simgap.greybox.selection import select
from simgap.records import Channels, Experiment, UnusableInput

from .parts import channels, experiments, initial_states, model, records, white_noise
from .plants import free_run, steps, velocity


def baseline_of(y, u, kind="velocity") -> Baseline:
    made = experiments(u, y, 0.1)
    return find_baseline(made[:-1], made[-1:], channels(kind), (0,), 10)


def test_data_without_noise_have_no_effects_and_no_outliers():
    u = steps(np.random.default_rng(0), (5, 80))
    chosen = select(baseline_of(free_run(velocity(), u, 0.1)[0], u))
    assert chosen.trial.names == () and chosen.baseline.outliers == ()
    assert np.isfinite([chosen.trial.train, chosen.trial.valid, chosen.trial.score]).all()


@pytest.mark.parametrize("offset", [0.0, 7.0])
@pytest.mark.parametrize("kind", ["position", "velocity", "level", "other"])
def test_an_output_that_never_moves_has_a_model_of_finite_numbers(kind, offset):
    u = steps(np.random.default_rng(1), (4, 60))
    baseline = baseline_of(np.full((4, 60, 1), offset), u, kind)
    assert (
        np.isfinite(baseline.estimate.theta).all()
        and np.isfinite(baseline.estimate.squares)
        and baseline.estimate.squares > 0
    )


def test_of_two_perfect_fits_none_is_more_likely():
    rng, mask = np.random.default_rng(2), np.ones((3, 50), dtype=bool)
    one, other = 1e-16 * rng.standard_normal((3, 50, 1)), np.zeros((3, 50, 1))
    likely = [log_likelihood(e, mask, 1, resolution=1e-9) for e in (one, other)]
    assert likely[0] == pytest.approx(likely[1], abs=1e-6)
    assert schwarz_order(other, mask, 1e-9) == 0


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_records_of_a_few_samples_tell_nothing_of_a_memory(samples):
    e = np.random.default_rng(3).standard_normal((6, samples, 1))
    assert schwarz_order(e, np.ones((6, samples), dtype=bool)) == 0
    assert np.isfinite(log_likelihood(e, np.ones((6, samples), dtype=bool), 3))


def test_numbers_that_move_nothing_stay_where_they_are():
    theta = np.zeros((2, 2, 5))
    theta[0] = 1.0
    local = np.zeros((2, 2, 5))
    local[0, 0] = np.arange(5.0)
    equations = NormalEquations.of(Jacobian.of(theta, local), np.ones((2, 5)))
    (step, own), promised = equations.step(np.ones(2, dtype=bool), 1e-9)
    assert step[1] == 0 and not own[1].any() and not own[:, 1].any()
    assert promised == pytest.approx(10.0)  # the first number of theta is all the error


@pytest.mark.parametrize("unit", [1e-25, 1e25])
def test_a_step_is_the_same_in_every_unit(unit):
    rng = np.random.default_rng(4)
    theta, local, white = (rng.standard_normal(shape) for shape in ((2, 3, 20), (2, 3, 20), (3, 20)))
    (step, own), _ = NormalEquations.of(Jacobian.of(theta, local), white).step(np.ones(2, dtype=bool), 1e-3)
    units = np.array([unit, 1.0])
    scaled = Jacobian.of(theta * units[:, None, None], local * units[::-1, None, None])
    (again, own_again), _ = NormalEquations.of(scaled, white).step(np.ones(2, dtype=bool), 1e-3)
    np.testing.assert_allclose(again * units, step, rtol=1e-9)
    np.testing.assert_allclose(own_again * units[::-1], own, rtol=1e-9)


def test_a_simulation_that_grows_without_bound_has_a_start_all_the_same():
    known = model("position", 0.01, [20.0, 9.0], 500.0, ("cubic_stiffness",))
    known.theta[-1] = -1e6  # a spring that pushes
    u, y = np.zeros((2, 400)), 1e3 * np.ones((2, 400, 1))
    assert np.isfinite(initial_states(known, records(u, y, 0.01), white_noise(1.0))).all()


@pytest.mark.parametrize(
    ("u", "y", "dt", "words"),
    [
        (np.ones((0, 1)), np.ones((0, 1)), 0.1, "one has no samples; leave it out"),
        (np.ones((9, 1)), np.full((9, 1), 1e40), 0.1, r"one: y0 is at most 1e\+40"),
        (np.full((9, 1), 1e-40), np.ones((9, 1)), 0.1, "one: u0 is at most 1e-40"),
        (np.ones((9, 1)), np.ones((9, 1)), 1e-15, "one: the sampling time is 1e-15 s"),
    ],
)
def test_units_of_no_machine_are_refused_in_a_sentence(u, y, dt, words):
    with pytest.raises(UnusableInput, match=words):
        check_numbers([Experiment("one", u, y, dt)], Channels.unnamed(1, 1))
