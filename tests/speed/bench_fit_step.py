"""A step of a grey box's fit, and free runs of a linear plant, next to NumPy and SciPy."""

from itertools import cycle

import numpy as np
from scipy.linalg import expm
from scipy.signal import dlsim

from simgap.greybox import dynamics
from simgap.greybox.normal_equations import Jacobian, NormalEquations
from simgap.greybox.plant import Plant
from simgap.greybox.simulation import Simulator

EXPERIMENTS, P, Q, SAMPLES = 8, 9, 4, 400


def test_a_damped_step_next_to_numpy(compare, timed):
    rng = np.random.default_rng(0)
    theta, local = rng.standard_normal((P, EXPERIMENTS, SAMPLES)), rng.standard_normal((Q, EXPERIMENTS, SAMPLES))
    normal = NormalEquations.of(Jacobian.of(theta, local), rng.standard_normal((EXPERIMENTS, SAMPLES)))
    inside = np.ones(P, dtype=bool)

    def eliminated():
        """Compute the same step by NumPy's solver, the numbers of each experiment eliminated in a batch."""
        i = np.arange(Q)
        blocks = normal.blocks.copy()
        blocks[:, i, i] *= 1 + 1e-3
        solved = np.linalg.solve(
            blocks, np.concatenate((normal.cross.swapaxes(1, 2), normal.block_gradient[:, :, None]), 2)
        )
        reduced = normal.cross @ solved  # [E, p, p + 1]
        h = normal.h - reduced[:, :, :-1].sum(0)
        h[np.arange(P), np.arange(P)] += 1e-3 * np.diag(normal.h)
        step = np.linalg.solve(h, normal.gradient - reduced[:, :, -1].sum(0))
        return step, solved[:, :, -1] - solved[:, :, :-1] @ step

    (step, own), _ = normal.step(inside, 1e-3)
    np.testing.assert_allclose(step, eliminated()[0], rtol=1e-6)
    np.testing.assert_allclose(own, eliminated()[1], rtol=1e-6)
    compare("damped step, 8 experiments", "NumPy", lambda: normal.step(inside, 1e-3), lambda: timed(eliminated), 50, 2)


def test_a_free_run_of_a_linear_plant_next_to_scipy(compare, timed):
    plant = Plant("other", 4, 1, 0.01)
    u = np.random.default_rng(1).standard_normal((1, 20_000, 1))
    theta = np.array([3.0, 40.0, 2.0, 9.0, 5.0])
    simulator = Simulator(plant, u)
    a = dynamics.matrix(plant, theta)
    whole = expm(0.01 * np.block([[a, np.eye(4)[:, 3:] * 5.0], [np.zeros((1, 5))]]))
    system = (whole[:4, :4], whole[:4, 4:], np.eye(1, 4), np.zeros((1, 1)), 0.01)

    thetas = cycle((theta, 1.1 * theta))  # what was simulated last is not simulated again

    def ours():
        return simulator.run(next(thetas), np.zeros((1, 4)))

    np.testing.assert_allclose(ours()[0, :, 0], dlsim(system, u[0])[1][:, 0], atol=1e-9)
    compare("free run of order 4, 2e4 samples", "SciPy dlsim", ours, lambda: timed(dlsim, system, u[0]), 10, 10)
