"""The friction models of BAM beside our diagnosis, on the runs of the servo STS3215.

    python tests/diagnosis/bam_study.py FOLDER SECONDS [MODEL.simgap]

M1 (Coulomb and viscous) and M6 (Stribeck, load of motor and arm apart, quadratic) of Duclusaud, Passault, Padois, Ly,
Extended friction models for the physics simulation of servo actuators, ICRA 2025 (arXiv 2410.08650), written after the
paper's equations, on a motor of constants kt and R whose duty cycle follows the position error. `servo` adds what the
authors' program now has beside friction: a goal of limited speed that arrives late. FOLDER is a data set with the
columns of `sts3215`, or that name. Each model is fitted to the training and validation runs by CMA-ES (`pip install
cma`) on the mean absolute error, for so many seconds of CPU, and scored on the test runs, as a saved model of `simgap
diagnose --save` is.
"""

import math
import sys
import time
import warnings

import numpy as np
from numba import njit

from simgap import load, load_model
from simgap.data.formats.plant_table import with_known
from simgap.data.measured.servo_sts3215 import PLANT

# Name, where the search begins, bounds: those of the authors' program.
MOTOR = (("kt", 0.78, 0.05, 2.5), ("R", 2.0, 0.1, 10.0), ("armature", 1e-2, 1e-5, 0.04), ("gain", 0.166, 0.0166, 1.66),
         ("offset", 0.0, -0.2, 0.2))  # fmt: skip
COULOMB = (("base", 0.05, 0.0, 0.2), ("viscous", 0.1, 0.0, 1.0))
EXTENDED = (("stribeck", 0.05, 0.0, 0.2), ("load motor", 0.05, 0.0, 0.5), ("load external", 0.05, 0.0, 0.5),
            ("load motor stribeck", 0.05, 0.0, 1.0), ("load external stribeck", 0.05, 0.0, 1.0),
            ("quadratic motor", 0.0, 0.0, 0.01), ("quadratic external", 0.0, 0.0, 0.01),
            ("stribeck velocity", 0.2, 0.1, 1.0), ("alpha", 1.35, 1.0, 10.0))  # fmt: skip
SERVO = (("largest speed", 5.2, 0.5, 52.0), ("delay", 0.0, 0.0, 0.05))
FASTEST = 1e9
WITHOUT = {"stribeck velocity": 0.2, "alpha": 1.35, "largest speed": FASTEST}
ALL = MOTOR + COULOMB + EXTENDED + SERVO
MODELS = {
    "M1": MOTOR + COULOMB, "M6": MOTOR + COULOMB + EXTENDED,
    "M1, servo": MOTOR + COULOMB + SERVO, "M6, servo": MOTOR + COULOMB + EXTENDED + SERVO,
}  # fmt: skip
MAX_DUTY, GRAVITY, SUBSTEPS = 0.97, 9.80665, 2
N_INIT = 20
GLITCH = 1.0  # rad from the median of the readings around


@njit
def simulate(u, start, dt, p):
    """q [E, T] from u [E, T, 6] = goal, on, volts, kp, mass, arm: semi-implicit Euler, friction up to its budget."""
    kt, r, armature, gain, offset, base, viscous = p[:7]
    stribeck, motor, external, motor_s, external_s, motor_2, external_2, v_s, alpha, fastest, delay = p[7:]
    q_all, h = np.empty(u.shape[:2]), dt / SUBSTEPS
    whole = int(delay / dt)
    part = delay / dt - whole
    for e in range(len(u)):
        q, v, goal = start[e], 0.0, u[e, 0, 0]
        for k in range(u.shape[1]):
            q_all[e, k] = q
            on, volts, kp, mass, arm = u[e, k, 1], u[e, k, 2], u[e, k, 3], u[e, k, 4], u[e, k, 5]
            wanted = (1 - part) * u[e, max(k - whole, 0), 0] + part * u[e, max(k - whole - 1, 0), 0]
            inertia = mass * arm * arm + armature
            for _ in range(SUBSTEPS):
                goal = min(max(wanted, goal - fastest * h), goal + fastest * h)
                duty = min(max((goal - q) * kp * gain, -MAX_DUTY), MAX_DUTY)
                torque = on * (kt * volts * duty - kt * kt * v) / r
                bias = -mass * GRAVITY * arm * math.sin(q + offset)
                slow = math.exp(-((abs(v) / v_s) ** alpha))
                budget = base + abs(external * bias - motor * torque) + viscous * abs(v)
                budget += slow * (stribeck + abs(external_s * bias - motor_s * torque))
                if bias * torque < 0.0:
                    budget += slow * (external_2 * bias**2 if abs(bias) < abs(torque) else motor_2 * torque**2)
                stop = inertia / h * v + torque + bias
                v += h / inertia * (torque + bias - math.copysign(min(abs(stop), budget), stop))
                q += h * v
    return q_all


def arrays(runs):
    """u [E, T, 6] and q [E, T] of runs of one length."""
    return np.stack([x.u for x in runs]), np.stack([x.y[:, 0] for x in runs])


def glitches(q):
    """Which readings are single ones, far from those around them."""
    padded = np.pad(q, ((0, 0), (2, 2)), mode="edge")
    around = np.median([padded[:, i : i + q.shape[1]] for i in range(5)], axis=0)
    return np.abs(q - around) > GLITCH


def scores(y_hat, q):
    """Mean absolute error in mrad over the rows after the start, with and without glitches."""
    error, good = np.abs(y_hat - q)[:, N_INIT:], ~glitches(q)[:, N_INIT:]
    return 1e3 * error.mean(), 1e3 * error[good].mean()


def fit(names, u, q, dt, seconds, seed=0):
    """The parameters with the least mean absolute error that CMA-ES finds in so many seconds of CPU, and its runs."""
    import cma

    begin, low, high = (np.array([one[i] for one in names]) for i in (1, 2, 3))
    usual = np.array([WITHOUT.get(name, 0.0) for name, *_ in ALL])
    places = [[name for name, *_ in ALL].index(name) for name, *_ in names]

    def full(x):
        p = usual.copy()
        p[places] = low + np.clip(x, 0.0, 1.0) * (high - low)
        return p

    def error(x):
        y_hat = simulate(u, q[:, 0], dt, full(x))
        return float(np.nan_to_num(np.abs(y_hat - q)[:, N_INIT:].mean(), nan=10.0, posinf=10.0))

    began, best, runs = time.process_time(), (math.inf, None), 0
    first, restarts = (begin - low) / (high - low), 0
    while time.process_time() - began < seconds:
        # A search that has converged begins anew, with twice the population (Auger and Hansen 2005).
        size = int(4 + 3 * math.log(len(first))) * 2**restarts
        options = {"bounds": [0, 1], "seed": seed + 1 + restarts, "verbose": -9, "popsize": size}
        search = cma.CMAEvolutionStrategy(first, 0.2, options)
        while not search.stop() and time.process_time() - began < seconds:
            asked = search.ask()
            told = [error(x) for x in asked]
            search.tell(asked, told)
            runs += len(asked)
            best = min(best, (min(told), tuple(asked[int(np.argmin(told))])), key=lambda one: one[0])
        restarts += 1
    return full(np.array(best[1])), runs, best[0]


def main(folder, seconds, saved=""):
    """Print the table."""
    warnings.simplefilter("ignore")
    data = with_known(load(folder), PLANT)
    u, q = arrays(data.training.train + data.training.valid)
    u_test, q_test = arrays(data.test)
    dt = data.training.dt
    print(f"{len(q)} runs to fit, {len(q_test)} to test; glitches among the readings: {glitches(q_test).sum()}")
    print(
        "| model | numbers | CPU s | simulations | training | test | without glitches |\n|---|---|---|---|---|---|---|"
    )
    simulate(u, q[:, 0], dt, np.ones(len(ALL)))  # compiled before anything is timed
    for name, names in MODELS.items():
        began = time.process_time()
        p, runs, error = fit(names, u, q, dt, seconds)
        spent = time.process_time() - began
        with_all, without = scores(simulate(u_test, q_test[:, 0], dt, p), q_test)
        print(f"| {name} | {len(names)} | {spent:.0f} | {runs} | {1e3 * error:.1f} | {with_all:.1f} | {without:.1f} |")
        print("   ", {one: float(f"{v:.3g}") for (one, *_), v in zip(ALL, p, strict=True) if v}, file=sys.stderr)
    if saved:
        model = load_model(saved)
        rows = []
        for v, y in ((u, q), (u_test, q_test)):
            y_hat = model.simulate(v, y[:, :N_INIT, None])[..., 0]
            rows.append(scores(np.concatenate([y[:, :N_INIT], y_hat], axis=1), y))
        print(f"| {saved} | | | | {rows[0][0]:.1f} | {rows[1][0]:.1f} | {rows[1][1]:.1f} |")


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), *sys.argv[3:4])
