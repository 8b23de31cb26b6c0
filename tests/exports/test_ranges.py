"""Ranges of parameters: they hold what repeats of the experiments find, and every export carries or uses them."""

import json
import runpy
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import simgap
from simgap.data.simulated.rigs import hide
from simgap.exports.export import export
from simgap.exports.ranges import VARIANTS, drawn, ends, ranges_of
from simgap.saved.archive import FittedOn, SavedModel

REPEATS = 40
HELD = 0.9


def fitted(rig, effects, seed=0, colour=0.0):
    data = hide(rig, dict.fromkeys(effects, 0.5), noise=0.05, colour=colour, seed=seed)
    model = simgap.MODELS["greybox"](effects=effects)
    model.fit(data.training, 0)
    return model, data


@pytest.fixture(scope="module")
def cart(tmp_path_factory):
    """A saved model, so that the ranges have been through a file."""
    model, data = fitted("cart", ("coulomb_friction",))
    file = tmp_path_factory.mktemp("cart") / "cart.simgap"
    simgap.save_model(model, file, data)
    return model, SavedModel("greybox", simgap.load_model(file), FittedOn.of(data)), data


@pytest.mark.slow
@pytest.mark.parametrize("colour", [0.0, 0.9])
@pytest.mark.parametrize(
    ("rig", "effects"),
    [
        ("cart", ("coulomb_friction",)),
        ("stage", ("coulomb_friction", "cubic_stiffness")),
        ("slide", ("dead_zone", "quadratic_drag")),
    ],
)
def test_the_ranges_of_one_data_set_hold_nine_of_ten_estimates_of_its_repeats(rig, effects, colour):
    plants = [fitted(rig, effects, seed, colour)[0].plants[0] for seed in range(REPEATS)]
    theta = np.array([plant.estimate.theta for plant in plants])  # [R, p]
    low, high = np.swapaxes([ends(plant) for plant in plants], 0, 1)
    inside = (low[:, None] <= theta) & (theta <= high[:, None])  # [R, R, p]: of the ranges of one, of the others
    others = ~np.eye(REPEATS, dtype=bool)
    held = inside[others].mean(axis=0)
    print(rig, colour, held.round(3))
    assert (held[plants[0].estimate.plant.free] >= HELD).all(), held


def test_a_saved_model_has_the_ranges_of_the_fitted_one_and_they_hold_the_truth(cart):
    model, saved, data = cart
    ranges = ranges_of(saved.model, data.channels)
    assert ranges == ranges_of(model, data.channels)
    truth = {"damping over inertia": 1.6, "gain of force": 0.8, "friction force": 0.3}
    assert {one.parameter for one in ranges} == set(truth)
    assert all(one.low < truth[one.parameter] < one.high for one in ranges)


def test_drawn_models_keep_the_correlations_of_their_parameters(cart):
    model = cart[0]
    theta = np.array([one.plants[0].estimate.theta for _, one in zip(range(2000), drawn(model, 0), strict=False)])
    np.testing.assert_allclose(np.cov(theta.T), 2 * model.plants[0].uncertainty.covariance, rtol=0.2, atol=1e-9)


@pytest.mark.parametrize("form", ["python", "c", "mjcf", "urdf"])
def test_every_export_carries_the_ranges(cart, tmp_path, form):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    _, saved, data = cart
    export(saved, data, form, tmp_path / "out", known={"inertia": 0.3})
    written = json.loads((tmp_path / "out" / "export.json").read_text())["ranges"]
    assert [one["parameter"] for one in written] == ["damping over inertia", "gain of force", "friction force"]
    assert [one["part"] for one in written] == ["linear part", "linear part", "coulomb_friction"]
    if form in ("mjcf", "urdf"):
        joint = json.loads((tmp_path / "out" / "joint.json").read_text())["ranges"]
        of_friction = written[2]
        np.testing.assert_allclose(
            joint["frictionloss"], [0.3 * of_friction["low"], 0.3 * of_friction["high"]], rtol=0.01
        )
        text = (tmp_path / "out" / f"model.{'xml' if form == 'mjcf' else 'urdf'}").read_text()
        assert "to draw at random, in SI units: damping" in text
        assert ET.fromstring(text) is not None


def test_an_environment_draws_a_plant_for_each_episode_when_it_is_asked_to(cart, tmp_path):
    pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
    _, saved, data = cart
    export(saved, data, "gymnasium", tmp_path / "out")
    module = runpy.run_path(str(tmp_path / "out" / "environment.py"))
    assert len(module["VARIANTS"]) == VARIANTS

    def run(environment, seed, **options):
        environment.reset(seed=seed, options=options)
        return np.array([environment.step([2.0])[0][0] for _ in range(40)])

    plain, drawing = module["Plant"](), module["Plant"](randomise=True)
    runs = [run(drawing, seed) for seed in range(8)]
    assert len({run[-1] for run in runs}) > 4
    np.testing.assert_array_equal(run(plain, 0), run(plain, 1))
    np.testing.assert_array_equal(run(drawing, 3), runs[3])
    np.testing.assert_array_equal(run(plain, 0, variant=2), run(drawing, 0, variant=2))
    np.testing.assert_allclose(np.mean(runs, axis=0), run(plain, 0), rtol=0.02)
    # Two environments side by side each keep their own plant.
    one, other = module["Plant"](), module["Plant"]()
    one.reset(seed=0, options={"variant": 0})
    other.reset(seed=0, options={"variant": 1})
    together = np.array([(one.step([2.0])[0][0], other.step([2.0])[0][0]) for _ in range(40)])
    np.testing.assert_array_equal(together[:, 0], run(plain, 0, variant=0))
    np.testing.assert_array_equal(together[:, 1], run(plain, 0, variant=1))
