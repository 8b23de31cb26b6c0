"""Where the simulations of a grey box begin."""

import numpy as np
import pytest

from simgap.greybox.effects.effect import Scene
from simgap.greybox.fitting import Problem, Records
from simgap.greybox.noise import white
from simgap.greybox.plant import Scenes, Structure, Term
from simgap.greybox.simulation import Simulator
from simgap.greybox.starting import starts
from simgap.registry import EFFECTS

SCENE = Scene("position", 2, 0.01, 1.0, -10.0, 10.0, 5.0, -90.0, 90.0, 40.0, 90.0, 200.0, 100.0, 1000.0)


@pytest.mark.parametrize("effects", [(), ("coulomb_friction", "position_torque"), ("absolute_sensor",)])
def test_starts_found_side_by_side_are_those_that_are_found_one_by_one(effects):
    plain = Structure("position", 2, 1, 0.01, two_outputs=True, scenes=Scenes((SCENE,), (SCENE, SCENE)))
    structure = plain.having([Term(EFFECTS[name]()) for name in effects])
    theta = np.zeros(structure.size)
    for part, values in zip(structure.at[:2], ([20.0, 9.0], [500.0]), strict=True):
        theta[part] = values
    theta[structure.at[4]] = 1.0
    for term in structure.terms:
        theta[structure.term_at(term)] = structure.starts_of(term)[0].values

    rng = np.random.default_rng(0)
    u, true = 5 * rng.standard_normal((7, 30, 1)), rng.standard_normal((7, 2)) * [40.0, 100.0]
    y = Simulator(structure, u).run(theta, true) + 0.1 * rng.standard_normal((7, 30, 2))
    noise = white(np.array([0.1, 0.1]))
    found = starts(structure, theta, u, y, noise)

    fixed = np.ones(structure.size, dtype=bool)
    for i in range(len(u)):
        one = Records(u[i : i + 1], y[i : i + 1], np.ones((1, 30), dtype=bool), structure.dt)
        alone = Problem(structure, one, noise).fit(theta, fixed=fixed, max_steps=15).local
        np.testing.assert_allclose(found[i : i + 1], alone, rtol=1e-6, atol=1e-6)
    if not structure.signless:  # the reading's side of zero is not known
        np.testing.assert_allclose(found, true, atol=3.0)
