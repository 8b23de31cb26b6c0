import shutil
import subprocess

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.signal import lfilter

from simgap.baselines.estimation.levenberg import minimise
from simgap.baselines.estimation.state_space_error import StateSpaceError
from simgap.baselines.n4sid import N4sid
from simgap.records import Experiment, TrainingSet
from simgap.subspace.projections import WEIGHTINGS, state_spaces

POLES = np.array([0.5 - 0.3j, 0.5 + 0.3j, 0.7, 0.9])


def plant(seed, length=600, noise=0.0):
    """Two outputs and two inputs around an operating point: four states that both outputs share in part."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=(length + 100, 2))
    slow, fast = lfilter([0, 0.5, 0.2], np.poly([0.9, 0.7]), u[:, 0]), lfilter([0, 1, 0.4], np.poly(POLES[:2]), u[:, 1])
    y = np.stack((slow + fast, slow - 0.5 * fast + u[:, 1]), axis=1) + noise * rng.normal(size=(length + 100, 2))
    return Experiment(f"plant{seed}", 2 + u[100:], 5 + y[100:], 1.0)


def rmse(model, experiment, n_init=20):
    error = model.simulate(experiment.u[None], experiment.y[None, :n_init])[0] - experiment.y[n_init:]
    return float(np.sqrt(np.mean(error**2)))


def test_without_noise_every_weighting_finds_the_plant_exactly():
    models = list(state_spaces([plant(0), plant(1)], [4], 10))
    assert len(models) == len(WEIGHTINGS)
    for model in models:
        np.testing.assert_allclose(np.sort_complex(model.poles), POLES, atol=1e-7)
        assert rmse(model, plant(2)) < 1e-3  # the start state is found from 20 samples, against a prior


def test_a_noisy_plant_is_simulated_to_within_its_noise_with_the_right_order():
    noise = 0.1
    model = N4sid(max_order=6)
    model.fit(TrainingSet((plant(0, noise=noise), plant(1, noise=noise)), (plant(2, noise=noise),), 20), 0)
    assert model.fitted == {"order": 4}
    assert rmse(model, plant(3, noise=noise)) < 1.05 * noise


def test_the_gradient_is_the_slope_of_the_squares_near_the_plant():
    records = [plant(0, 150, 0.1), plant(1, 100, 0.1)]
    model = next(state_spaces(records, [3], 6))
    equation = StateSpaceError.of(model, records, 30, np.ones(2))
    theta = minimise(equation, equation.theta, 5).theta * 1.001
    steps = 1e-6 * np.eye(len(theta))
    slopes = [(equation.squares(theta + step) - equation.squares(theta - step)) / 4e-6 for step in steps]
    gradient = equation.cost(theta).gradient
    np.testing.assert_allclose(gradient, slopes, atol=0.02 * np.abs(gradient).max())


def test_a_start_of_few_samples_is_trusted_no_further_than_it_tells():
    model = N4sid(order=4)
    model.fit(TrainingSet((plant(0, noise=0.1),), (), 20), 0)
    test = plant(5, noise=0.1)
    at_rest = model.simulate(test.u[None], np.tile(model.model.y_mean, (1, 1, 1)))[0] - test.y[1:]
    assert rmse(model, test, 1) < np.sqrt(np.mean(at_rest**2))
    assert rmse(model, test, 20) <= rmse(model, test, 1)


def test_python_control_simulates_the_same():
    import control

    model = N4sid(order=4)
    model.fit(TrainingSet((plant(0),), (), 20), 0)
    u = plant(4).u
    sys = model.to_control()
    own, _ = model.model.run(u - model.model.u_mean, np.zeros(4))
    np.testing.assert_allclose(control.forced_response(sys, U=(u - model.model.u_mean).T).outputs.T, own, atol=1e-9)


def test_the_poles_of_moesp_are_those_of_octave(tmp_path):
    octave = shutil.which("octave-cli") or shutil.which("octave")
    if octave is None:
        pytest.skip("Octave is not installed: apt-get install octave octave-control")
    e = plant(0, 800, 0.2)
    centred = Experiment("", e.u - e.u.mean(axis=0), e.y - e.y.mean(axis=0), 1.0)
    savemat(tmp_path / "data.mat", {"u": centred.u, "y": centred.y})
    (tmp_path / "solve.m").write_text(
        "pkg load control; load('data.mat'); sys = moesp(iddata(y, u, 1), 4, 's', 10); p = pole(sys);"
        "save('-v6', 'poles.mat', 'p');"
    )
    done = subprocess.run([octave, "--norc", "--quiet", "solve.m"], cwd=tmp_path, capture_output=True, check=False)
    if not (tmp_path / "poles.mat").exists():
        assert b"control" in done.stderr, done.stderr
        pytest.skip("Octave has no control package: apt-get install octave-control")
    theirs = np.sort_complex(loadmat(tmp_path / "poles.mat")["p"].ravel())
    ours = dict(zip(WEIGHTINGS, state_spaces([_unscaled(centred)], [4], 10), strict=True))["moesp"]
    np.testing.assert_allclose(np.sort_complex(ours.poles), theirs, rtol=1e-3)


def _unscaled(e):
    """Outputs of size 1: scaling turns the singular vectors, which Octave takes of the data as they are."""
    return Experiment("", e.u / e.u.std(axis=0), e.y / e.y.std(axis=0), 1.0)
