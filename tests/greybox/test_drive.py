"""What drives a plant: for several parameter vectors at once as for each alone, and one sample's steps apart."""

import numpy as np
import pytest
from parameters_of_effects import scales

from simgap.greybox.drive import Drive
from simgap.greybox.effects.dead_zone import DeadZone
from simgap.greybox.effects.load_drift import LoadDrift
from simgap.greybox.effects.periodic_disturbance import AnyPhase
from simgap.greybox.past import Past
from simgap.greybox.plant import Plant
from simgap.greybox.simulation import Simulator
from simgap.greybox.terms import PlantScales, Term
from simgap.registry import EFFECTS


@pytest.mark.parametrize("effects", [(), (DeadZone(),), (LoadDrift(),), (AnyPhase(), LoadDrift())])
@pytest.mark.parametrize("taps", [(0,), (0, -1, 1)])
@pytest.mark.parametrize("offset", [False, True])
def test_the_drives_of_several_parameter_vectors_are_those_of_each(effects, taps, offset):
    seen = scales("other", 2)
    plant = Plant("other", 2, 2, 0.1, offset=offset, taps=taps, scales=PlantScales((seen,), (seen,)))
    drive_of = plant.having([Term(effect) for effect in effects])
    rng = np.random.default_rng(0)
    drive = Drive(drive_of, rng.standard_normal((3, 20, 2)))
    thetas = np.clip(rng.standard_normal((4, drive_of.size)), drive_of.low, drive_of.high)
    starts = rng.standard_normal((4, 3, drive_of.n_moving - drive_of.order))
    alone = np.stack([drive.of(theta, start) for theta, start in zip(thetas, starts, strict=True)])
    np.testing.assert_allclose(drive.of_each(thetas, starts), alone, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("effect", "values"), [("gain_fade", [0.05]), ("periodic_disturbance", [3.0, 0.31, 0.7])])
def test_a_record_cut_in_two_is_simulated_as_the_whole_one(effect, values):
    seen = scales("velocity", 1)
    plant = Plant("velocity", 1, 1, 0.1, offset=False, scales=PlantScales((seen,), (seen,)))
    plant = plant.having([Term(EFFECTS[effect]())])
    theta = np.array([1.5, 2.0, *values])  # pole, gain
    u = np.random.default_rng(0).standard_normal((1, 100, 1))
    whole = Simulator(plant, u).states(theta[None], np.zeros((1, 1, 1)))[0]
    later = Simulator(plant, u[:, 60:], Past.none(u).at(np.array([60]), u, plant.dt)).states(
        theta[None], whole[None, :, 60]
    )[0]
    np.testing.assert_allclose(later, whole[:, 60:], atol=5e-3)  # the first step extrapolates no force
    anew = Simulator(plant, u[:, 60:]).states(theta[None], whole[None, :, 60])[0]
    assert np.abs(anew - whole[:, 60:]).max() > 0.1


def test_an_input_holds_until_the_next_sample_and_its_neighbours_act_through_their_gains():
    plant = Plant("other", 1, 1, 0.1, taps=(0, -1, 1))
    theta = np.zeros(plant.size)
    theta[plant.layout.gains] = 1.0, 10.0, 100.0
    u = np.array([1.0, 2.0, 3.0])
    found = Drive(plant, u[None, :, None]).of(theta)[0].reshape(3, -1)
    earlier, later = np.array([1.0, 1.0, 2.0]), np.array([2.0, 3.0, 3.0])
    assert (found == (u + 10 * earlier + 100 * later)[:, None]).all()
