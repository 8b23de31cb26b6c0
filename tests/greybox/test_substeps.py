"""A sample is cut into as many substeps as the fastest pole asks for, and no more than the effects want."""

import numpy as np
import pytest

from .parts import model, own_numbers, records, simulated
from .plants import steps

DT = 0.01


def stage(swing, effect, fastest):
    """A body on a spring that swings at `swing` rad/s, with one effect."""
    return model("position", DT, [0.6 * swing, swing**2], 50.0 * swing**2 / 20.0**2, (effect,), fastest=fastest)


@pytest.mark.parametrize(("time_constant", "substeps"), [(30.0, 1), (16.0, 1), (10.0, 2), (6.0, 3), (4.0, 4), (0.1, 4)])
def test_a_substep_is_a_sixteenth_of_the_fastest_time_constant_or_less_until_effects_are_content(
    time_constant, substeps
):
    made = stage(20.0, "coulomb_friction", 1 / (time_constant * DT))
    assert made.plant.substeps == substeps


@pytest.mark.parametrize("effect", ["coulomb_friction", "cubic_stiffness", "input_delay", "quadratic_drag"])
@pytest.mark.parametrize("swing", [3.0, 6.0, 12.0])
def test_fewer_substeps_on_a_slow_plant_cost_less_than_two_percent_of_what_the_effect_does(effect, swing):
    u = 8.0 * steps(np.random.default_rng(0), (2, 400), hold=40)
    data = records(u, np.zeros((*u.shape, 1)), DT)

    def run(fastest, amount=1.0):
        made = stage(swing, effect, fastest)
        theta = made.theta.copy()
        theta[made.plant.n_linear] *= amount
        return made.plant.substeps, simulated(made, data, np.zeros((len(u), own_numbers(made))), theta)

    (few, y), (many, exact) = run(swing), run(np.inf)
    _, without = run(np.inf, 0.0)
    assert few < many
    assert np.sqrt(np.mean((y - exact) ** 2)) < 0.02 * np.sqrt(np.mean((without - exact) ** 2))
