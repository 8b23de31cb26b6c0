"""The linear equations of a plant in numbers: its matrices, and how long an error of its state lasts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Shaped

from simgap.greybox import two_masses
from simgap.greybox.linear_kernels import companion
from simgap.greybox.plant import Plant

SETTLED = 3.0  # time constants in which 95 % of an error is gone


def matrix(plant: Plant, theta: Float[np.ndarray, " p"]) -> Float[np.ndarray, "n n"]:
    """Return A of z' = A z + (inputs and forces)."""
    sections, n = theta[plant.layout.poles], plant.order
    if plant.machine is not None:
        return plant.machine.linear(theta, n)
    if plant.joint:
        return two_masses.matrix(sections)
    if plant.cascade:
        return np.diag(-sections) + np.diag(sections[:-1], -1)
    a = np.empty((n, n))
    companion(sections, a)
    return a


def readings(plant: Plant, thetas: Float[np.ndarray, "S p"]) -> Float[np.ndarray, "S ny n"]:
    """Return C of y = C z, before the sensors' effects; z = (force, rate) of an imposed motion."""
    c = np.zeros((len(thetas), plant.ny, 2 if plant.imposed else plant.order))
    if plant.cascade:
        c[:, 0, -1] = 1.0
        return c
    at = two_masses.MEASURED[plant.joint]
    c[:, 0, at] = 1.0
    c[:, 0, 1 : 1 + plant.zeros] = thetas[:, plant.layout.zeros]
    if plant.two_outputs:
        c[:, 1, at + 1] = thetas[:, plant.layout.velocity][:, 0]
    return c


def poles(plant: Plant, theta: Float[np.ndarray, " p"]) -> Shaped[np.ndarray, " n"]:
    """Return the eigenvalues of A, in rad/s, real or complex."""
    return np.linalg.eigvals(matrix(plant, theta))


def slowest(plant: Plant, theta: Float[np.ndarray, " p"]) -> float:
    """Return the size of the slowest pole, in 1/s; 0 where the plant integrates."""
    return float(np.min(np.abs(poles(plant, theta))))


def keeps_errors(plant: Plant, theta: Float[np.ndarray, " p"], duration: float) -> bool:
    """Tell whether an error of the state is still there after so many seconds, as where the plant integrates."""
    has_poles = plant.order > 0 and not plant.imposed and plant.machine is None
    return has_poles and slowest(plant, theta) * duration < SETTLED
