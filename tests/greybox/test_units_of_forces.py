"""Units of the parameters of forces, with and without a known inertia."""

from dataclasses import replace

import numpy as np
import pytest
from parameters_of_effects import scales

from simgap.registry import EFFECTS


@pytest.mark.parametrize(
    ("kind", "order", "y_unit", "force", "effect", "unit"),
    [
        ("position", 2, "mm", "", "quadratic_drag", "1/mm"),
        ("velocity", 1, "mm/s", "", "quadratic_drag", "1/mm"),
        ("position", 3, "mm", "", "quadratic_drag", "1/(mm s)"),
        ("position", 2, "mm", "", "cubic_stiffness", "1/(mm^2 s^2)"),
        ("position", 2, "rad", "N m", "quadratic_drag", "N m s^2/rad^2"),
        ("velocity", 1, "rad/s", "N m", "quadratic_drag", "N m s^2/rad^2"),
        ("velocity", 1, "rpm", "N m", "quadratic_drag", "N m/rpm^2"),
        ("position", 2, "m", "N", "quadratic_stiffness", "N/m^2"),
        ("position", 2, "rad", "N m", "cubic_stiffness", "N m/rad^3"),
        ("other", 0, "N", "", "quadratic_drag", "N s^2/mm^2"),
    ],
)
def test_a_coefficient_has_the_unit_of_a_force_over_that_of_a_motion(kind, order, y_unit, force, effect, unit):
    seen = replace(scales(kind, order), y_unit=y_unit, u_unit="mm", force=force)
    assert EFFECTS[effect]().parameters(seen)[0].unit == unit


@pytest.mark.parametrize("unit", ["deg", "°", "Degrees", "rev", "mrad"])
def test_gravity_is_looked_for_in_every_unit_of_an_angle(unit):
    assert EFFECTS["gravity"]().applies_to(replace(scales(), y_unit=unit, x_max=1e4))
    assert not EFFECTS["gravity"]().applies_to(replace(scales(), y_unit="mm", x_max=1e4))


def test_a_gain_that_has_faded_away_does_not_drive_backwards():
    effect, rate = EFFECTS["gain_fade"](), np.array([0.1])
    faded = effect.term(np.ones((1, 200)), rate, 0.1)
    assert faded.min() == 0.0 and faded[0, 0] > 0.99
    assert effect.step(1.0, rate, 0, None, 0, 0.1, 150) == 0.0
