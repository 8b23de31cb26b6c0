"""A PID controller found on an exported model, and what it does on the machine: the simulated gimbal.

    python tests/controller_study.py [PICTURE.png]

A grey box with the effects that it finds, and the plain linear one, are fitted to twelve recordings of the gimbal and
exported to Gymnasium. On each environment, which draws a plant for every episode (`randomise=True`), a search finds the
PID that tracks five drawn references best. Then twenty other references are tracked on the environment and on the
true gimbal, with its noise, drift and encoder. The tracking error is the RMS of reference - reading.
"""

import runpy
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import differential_evolution

import simgap
from simgap.data.simulated.gimbal.motion import DT, simulate_gimbal
from simgap.data.simulated.gimbal.parameters import Gimbal
from simgap.exports.export import export
from simgap.saved.archive import FittedOn, SavedModel

LIMIT = 8.0  # V
SAMPLES = 120
# Gains of angle, its integral and its rate, as powers of ten: V/deg, V/(deg s), V s/deg.
LOW, HIGH = np.array([-2.5, -3.0, -4.0]), np.array([0.5, 0.5, 0.0])
TUNING, TRACKED = range(100, 105), range(20)
MODELS = {"plain": ("greybox", {"effects": ()}), "with effects": ("greybox-auto", {})}


def reference(seed):
    """Angles [T] in deg: turn to a drawn angle at a drawn speed and hold, again and again."""
    rng, angles = np.random.default_rng(seed), [0.0]
    while len(angles) <= SAMPLES:
        goal, speed = rng.uniform(-60.0, 60.0), rng.uniform(10.0, 60.0)
        steps = max(1, round(abs(goal - angles[-1]) / (speed * DT)))
        angles += np.linspace(angles[-1], goal, steps + 1)[1:].tolist() + [goal] * int(rng.integers(5, 20))
    return np.array(angles[:SAMPLES])


@dataclass
class PID:
    """u = P e + I sum(e) dt - D (phi' - r'), cut at the limit, where the sum stands still."""

    gains: np.ndarray
    total: float = 0.0

    def act(self, angle, rate, wanted, wanted_rate):
        error = wanted - angle
        p, i, d = self.gains
        u = p * error + i * (self.total + error * DT) - d * (rate - wanted_rate)
        if abs(u) < LIMIT or u * error < 0:
            self.total += error * DT
        return min(max(u, -LIMIT), LIMIT)


def track(gains, wanted, plant: Callable):
    """Let the loop run; give the readings [T] of the angle. plant(k, u) gives (phi, phi') at sample k + 1."""
    pid, (angle, rate), angles = PID(gains), plant(-1, 0.0), []
    rates = np.diff(wanted, append=wanted[-1]) / DT
    for k, (goal, speed) in enumerate(zip(wanted, rates, strict=True)):
        angles.append(angle)
        angle, rate = plant(k, pid.act(angle, rate, goal, speed))
    return np.array(angles)


def of_export(environment, seed):
    """The plant of an environment, drawn by a seed."""

    def plant(k, u):
        y = environment.reset(seed=seed)[0] if k < 0 else environment.step(np.array([u]))[0]
        return y[0], y[1]

    return plant


def of_gimbal(seed):
    """The true gimbal: what it was given so far is simulated anew, with the same noise, for each sample."""
    u = np.zeros((SAMPLES + 1, 1))

    def plant(k, voltage):
        if k >= 0:
            u[k] = voltage
        y = simulate_gimbal(Gimbal(), u[: k + 2], np.random.default_rng(seed))
        return y[k + 1]

    return plant


def error(wanted, angles):
    """Root mean square in deg, the worst there is for a loop that grows without bound."""
    return min(float(np.sqrt(np.mean((wanted - angles) ** 2))), 1e3)


def exported(name, params, folder):
    """Fit a model to the short recordings and export it; the class of its environment, which Gymnasium has checked."""
    data = simgap.load("gimbal_short")
    model = simgap.MODELS[name](**params)
    model.fit(data.training, 0)
    done = export(SavedModel(name, model, FittedOn.of(data)), data, "gymnasium", folder)
    assert done.passed, str(done)
    return runpy.run_path(str(Path(folder) / "environment.py"))["Plant"]


def tuned(environment, seed=0):
    """The gains that track the tuning references best, each on a plant of its own."""

    def cost(powers):
        runs = [error(reference(s), track(10**powers, reference(s), of_export(environment, s))) for s in TUNING]
        return float(np.mean(runs))

    bounds = list(zip(LOW, HIGH, strict=True))
    found = differential_evolution(cost, bounds, seed=seed, popsize=6, maxiter=9, tol=1e-3, polish=False)
    return 10**found.x


@dataclass
class Study:
    """Per model: the gains, and the errors [20] on its export and on the true gimbal; angles of the first reference."""

    gains: dict[str, np.ndarray]
    on_export: dict[str, np.ndarray]
    on_gimbal: dict[str, np.ndarray]
    angles: dict[str, tuple[np.ndarray, np.ndarray]]

    def __str__(self):
        lines = ["| PID found on | P, I, D | error on its export, deg | on the gimbal, deg | ratio, median |",
                 "|---|---|---|---|---|"]  # fmt: skip
        for name, gains in self.gains.items():
            here, there = self.on_export[name], self.on_gimbal[name]
            lines.append(
                f"| {name} | {', '.join(f'{g:.3g}' for g in gains)} | {np.median(here):.2f} | {np.median(there):.2f} "
                f"| {np.median(there / here):.2f} |"
            )
        return "\n".join(lines)


def study(models=MODELS) -> Study:
    """Do it all; medians are over the twenty references."""
    done = Study({}, {}, {}, {})
    for name, (model, params) in models.items():
        with tempfile.TemporaryDirectory() as folder:
            plant = exported(model, params, Path(folder) / "export")
        gains = done.gains[name] = tuned(plant(horizon=SAMPLES, randomise=True))
        fitted = plant(horizon=SAMPLES)
        runs = [(reference(s), of_export(fitted, s), of_gimbal(s)) for s in TRACKED]
        angles = [(r, track(gains, r, here), track(gains, r, there)) for r, here, there in runs]
        done.on_export[name] = np.array([error(r, here) for r, here, _ in angles])
        done.on_gimbal[name] = np.array([error(r, there) for r, _, there in angles])
        done.angles[name] = angles[0][1], angles[0][2]
    return done


def draw(done, file):
    """Show the first reference and how it is followed."""
    from matplotlib.figure import Figure

    t = DT * np.arange(SAMPLES)
    figure = Figure(figsize=(10, 8), layout="constrained")
    top, *axes = figure.subplots(3, 1, sharex=True)
    wanted = reference(TRACKED[0])
    top.plot(t, wanted, "k--", lw=1, label="reference")
    for axis, (name, (here, there)) in zip(axes, done.angles.items(), strict=True):
        top.plot(t, there, label=f"PID found on the model: {name}")
        axis.plot(t, wanted - here, color="tab:blue", label="on the export")
        axis.plot(t, wanted - there, color="tab:orange", label="on the gimbal")
        axis.set(title=f"PID found on the model: {name}", ylabel="reference - angle / deg", ylim=(-7, 7))
        axis.legend()
    top.set(title="The first reference, on the gimbal", ylabel="angle / deg")
    top.legend()
    axes[-1].set_xlabel("time / s")
    figure.savefig(file, dpi=100)


if __name__ == "__main__":
    result = study()
    print(result)
    if len(sys.argv) > 1:
        draw(result, sys.argv[1])
