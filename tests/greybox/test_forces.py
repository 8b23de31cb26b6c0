"""Forces on bodies of every order that a plain model may have, beside a loop in Python."""

import numpy as np
import pytest
from parameters_of_effects import scales

from simgap.greybox import dynamics
from simgap.greybox.effects.coulomb_friction import CoulombFriction
from simgap.greybox.effects.cubic_stiffness import CubicStiffness
from simgap.greybox.linear_kernels import transition
from simgap.greybox.plant import Plant
from simgap.greybox.simulation import Simulator
from simgap.greybox.terms import PlantScales, Term

DT, STIFFNESS = 0.05, 0.7


def body(order, effects):
    """A stable plant of chains of equal sections, with these effects, and its linear parameters."""
    seen = scales("other", order)
    plant = Plant("other", order, 1, DT, scales=PlantScales((seen,), (seen,))).having([Term(e) for e in effects])
    theta = np.zeros(plant.size)
    poles = [[1.5, 4.0][i % 2] if i < order - order % 2 else 1.0 for i in range(order)]
    theta[plant.layout.poles], theta[plant.layout.gains] = poles, 4.0
    return plant, theta


@pytest.mark.parametrize("order", range(1, 9))
def test_a_force_acts_on_a_body_of_any_order_as_in_a_loop_in_python(order):
    plant, theta = body(order, [CubicStiffness()])
    theta[plant.part_of(plant.terms[0])] = STIFFNESS
    rng = np.random.default_rng(order)
    u, starts = rng.standard_normal((3, 40, 1)), 0.1 * rng.standard_normal((2, 3, order))
    found = Simulator(plant, u).states(np.stack([theta, theta]), starts)
    e, g0, g1 = np.empty((3, order, order))
    transition(dynamics.matrix(plant, theta), DT / plant.substeps, e, g0, g1)
    for s, experiment in np.ndindex(2, 3):
        z, before = starts[s, experiment], 0.0
        for step in range(40 * plant.substeps):
            k, since = divmod(step, plant.substeps)
            if since == 0:
                np.testing.assert_allclose(found[s, experiment, k], z, rtol=1e-9, atol=1e-12)
            force = -STIFFNESS * z[0] ** 3
            change = force - before if step else 0.0
            z = e @ z + g0[:, -1] * (4.0 * u[experiment, k, 0] + force) + g1[:, -1] * change
            before = force


@pytest.mark.parametrize("order", range(1, 9))
def test_friction_beyond_what_drives_a_body_of_any_order_holds_it(order):
    plant, theta = body(order, [CoulombFriction()])
    theta[plant.part_of(plant.terms[0])] = 10.0
    found = Simulator(plant, np.full((1, 40, 1), 1.0)).states(theta[None], np.zeros((1, 1, order)))
    assert np.abs(found[..., min(1, order - 1)]).max() < 1e-12
